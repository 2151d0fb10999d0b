//! A flight towards a prop: what changes from frame to frame where its level does.

use std::fmt::Write;

use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{InstanceId, LodSettings, Scene, Selector};
use glam::Affine3A;
use serde::Serialize;

use super::prop::{Prop, Units};
use super::{ASKED_PX, Look, direction, eye, look_of};
use crate::render::{RenderError, Renderer};

/// The radii between which an eye flies, in pixels.
const FROM_TO_PX: [f32; 2] = [3.0, 160.0];
/// By how much the radius grows in a frame: 3 m/s at 60 frames a second, 3 m away.
const STEP: f32 = 1.0 / 60.0;

/// One frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FlightFrame {
    /// Radius of the prop on screen, in pixels.
    pub radius_px: f32,
    /// Triangles that are drawn.
    pub triangles: u32,
    /// How they differ from the source.
    pub look: Look,
}

/// A change of level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pop {
    /// Radius on screen, in pixels.
    pub radius_px: f32,
    /// Triangles before and after.
    pub triangles: [u32; 2],
    /// FLIP against full detail before the change over that after it.
    pub flip_ratio: f64,
    /// By how much the area covered changes, as a share of the source's.
    pub area_step: f64,
}

/// Flies towards a prop of one or more meshes, whose level is chosen at [`ASKED_PX`], and compares each frame with full detail.
///
/// # Errors
/// As [`Renderer::draw`].
pub fn fly(renderer: &Renderer, baked: &[Hierarchy]) -> Result<Vec<FlightFrame>, RenderError> {
    let prop = Prop::new(renderer, baked);
    let mut scene = Scene::default();
    let add = |mesh: &Hierarchy| {
        let mesh = scene.add_mesh(mesh);
        scene.add_instance(mesh, Affine3A::IDENTITY, 1.0)
    };
    let instances: Vec<InstanceId> = prop.meshes.iter().map(add).collect();
    scene.update();
    let mut selector = Selector::default();
    let settings = LodSettings::with_error_px(ASKED_PX);
    let [from, to] = FROM_TO_PX;
    let radii = std::iter::successors(Some(from), |radius| Some(radius * (1.0 + STEP)));
    let frame = |radius_px: f32| {
        // A little from above, as one who comes sees a tree.
        let eye = eye(&prop.sphere, direction(3, 8), radius_px);
        selector.select(&scene, &eye.view(), &settings);
        let units = instances
            .iter()
            .filter_map(|&id| selector.units(&scene, id).first());
        let units: Units = units.copied().collect();
        let reference = prop.draw(renderer, &eye, &prop.source())?;
        let picture = prop.draw(renderer, &eye, &units)?;
        Ok(FlightFrame {
            radius_px,
            triangles: prop.triangles(&units),
            look: look_of(&reference, &picture),
        })
    };
    radii.take_while(|radius| *radius < to).map(frame).collect()
}

/// Where the level changes. Nothing is said of the change to or from full detail, which has no error.
#[must_use]
pub fn pops(frames: &[FlightFrame]) -> Vec<Pop> {
    let changes = frames.windows(2).filter_map(|pair| {
        let [a, b] = pair else { return None };
        let both = [a.look.flip, b.look.flip];
        let differ = a.triangles != b.triangles && both.iter().all(|flip| *flip > 0.0);
        differ.then(|| Pop {
            radius_px: b.radius_px,
            triangles: [a.triangles, b.triangles],
            flip_ratio: a.look.flip / b.look.flip,
            area_step: b.look.covered - a.look.covered,
        })
    });
    changes.collect()
}

/// A row for each change of level.
#[must_use]
pub fn pop_table(flights: &[(String, Vec<Pop>)]) -> String {
    let mut text = String::new();
    for (name, pops) in flights {
        let _ = writeln!(
            text,
            "\n{name}\n   radius   triangles    FLIP, before over after   area covered"
        );
        for pop in pops {
            let Pop {
                radius_px,
                triangles: [before, after],
                flip_ratio,
                area_step,
            } = pop;
            let _ = writeln!(
                text,
                "{radius_px:>6.1} px {before:>6} {after:>6} {flip_ratio:>12.2} {area_step:>+20.3}"
            );
        }
    }
    text
}
