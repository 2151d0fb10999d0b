//! The specification of [`select`](crate::select): the cut rule, straight from its words. Slow,
//! readable, and what the fast path is tested against.

use camera_field::Camera;
use fieldlod_hierarchy::Hierarchy;

use crate::scene::{InstanceId, Scene};
use crate::settings::LodSettings;
use crate::view::View;

/// Whether `group` is refined: it has no simplification, or its error exceeds the threshold, or a
/// finer group is refined.
///
/// `was_refined` tells the last cut's answer for a group, for the hysteresis.
pub fn is_refined(
    hierarchy: &Hierarchy,
    group: usize,
    settings: &LodSettings,
    was_refined: &impl Fn(usize) -> bool,
    error_px: &impl Fn(usize) -> f32,
) -> bool {
    let data = &hierarchy.groups[group];
    data.is_terminal()
        || settings
            .thresholds(1.0)
            .exceeded_by(error_px(group), was_refined(group))
        || hierarchy
            .finer_groups(data)
            .iter()
            .any(|&finer| is_refined(hierarchy, finer as usize, settings, was_refined, error_px))
}

/// The units to draw, ascending: a unit is drawn if the group that consumes it is refined and it is
/// source geometry or the group that produced it is not refined.
pub fn select(
    hierarchy: &Hierarchy,
    settings: &LodSettings,
    was_refined: &impl Fn(usize) -> bool,
    error_px: &impl Fn(usize) -> f32,
) -> Vec<u32> {
    let refined =
        |group: u32| is_refined(hierarchy, group as usize, settings, was_refined, error_px);
    let drawn = |index: &u32| {
        let unit = &hierarchy.units[*index as usize];
        refined(unit.consumed_by) && unit.producer().is_none_or(|group| !refined(group))
    };
    (0..hierarchy.units.len() as u32).filter(drawn).collect()
}

/// The size of an instance on screen, in rendered pixels: what a [`Selector`](crate::Selector) compares with
/// [`LodSettings::cull_below_px`]. Infinite for an instance without a place; of no meaning once removed.
#[must_use]
pub fn size_px(scene: &Scene, instance: InstanceId, view: &View, settings: &LodSettings) -> f32 {
    let placed = &scene.instances[instance.index()];
    let radius = scene.columns.size(instance.index());
    let diameter = 2.0 * radius * settings.resolution_scale;
    match view.camera {
        Camera::Perspective(camera) => {
            let distance = placed.sphere.center.distance(view.eye_in_world);
            diameter * camera.focal_px.max_element() / distance
        }
        Camera::Orthographic(camera) => {
            let camera_per_world = view.camera_from_world.x_axis.length();
            diameter * camera.pixels_per_unit.max_element() * camera_per_world
        }
    }
}
