//! Image errors of the levels of whole meshes, by size on screen.
//!
//! Every level of the whole mesh is drawn and compared with the source, from directions spread over
//! the sphere. [`RADII_PX`] are the radii of the bounding sphere on screen. Textures are not drawn.

mod prop;

use std::fmt::Write;

use fieldlod_hierarchy::{Hierarchy, Sphere};
use glam::{Vec2, Vec3};
use serde::Serialize;

use crate::eye::Eye;
use crate::measure::image_error;
use crate::render::{Picture, RenderError, Renderer};

pub use prop::Prop;

/// Radii of the mesh on screen, in pixels. At the largest, the mesh is a fifth as high as a picture of 1080 px.
pub const RADII_PX: [f32; 5] = [6.0, 12.0, 25.0, 50.0, 100.0];
/// The threshold of the selection, in pixels.
pub const ERROR_PX: f32 = 1.0;
/// Number of view directions. Fewer directions would miss sides of plants that look different; more take longer.
const DIRECTIONS: u32 = 8;
/// Field of view of the pictures, in degrees. It is narrow, because props are small on screen when they are far away.
const FOVY_DEG: f32 = 10.0;

/// The levels of one mesh.
#[derive(Clone, Debug, Serialize)]
pub struct PropResult {
    /// The mesh's name.
    pub name: String,
    /// Triangles of the source.
    pub triangles: u64,
    /// The levels without the source, finest first.
    pub levels: Vec<LevelResult>,
}

/// One level.
#[derive(Clone, Debug, Serialize)]
pub struct LevelResult {
    /// Triangles of the level.
    pub triangles: u32,
    /// Error of the level, relative to the radius of the mesh.
    pub error: f32,
    /// Image errors at each of [`RADII_PX`].
    pub looks: Vec<Look>,
}

/// Differences of pictures from pictures of the source; means over all directions.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Look {
    /// Root mean squared difference of the colour channels, on a scale of 255.
    pub rmse: f64,
    /// Sum of FLIP by shown pixel; see [`ImageError::flip`](crate::measure::ImageError::flip).
    pub flip: f64,
    /// Covered area, relative to that of the source.
    pub covered: f64,
}

/// Measures the levels of a prop of one or more `baked` meshes.
///
/// # Errors
/// The errors of [`Renderer::draw`].
pub fn measure(
    renderer: &Renderer,
    name: &str,
    baked: &[Hierarchy],
) -> Result<PropResult, RenderError> {
    let prop = Prop::new(renderer, baked);
    let levels = prop.levels();
    let share = f64::from(DIRECTIONS).recip();
    let mut looks = vec![vec![Look::default(); RADII_PX.len()]; levels.len()];
    for (at, &radius_px) in RADII_PX.iter().enumerate() {
        for direction in (0..DIRECTIONS).map(|index| direction(index, DIRECTIONS)) {
            let eye = eye(&prop.sphere, direction, radius_px);
            let reference = prop.draw(renderer, &eye, &prop.source())?;
            let look = |units: &[Vec<u32>]| {
                let picture = prop.draw(renderer, &eye, units)?;
                Ok::<_, RenderError>(look_of(&reference, &picture))
            };
            for (looks, (_, units)) in looks.iter_mut().zip(&levels) {
                looks[at].add(&look(units)?, share);
            }
        }
    }
    let levels = levels.iter().zip(looks);
    let levels = levels.map(|((error, units), looks)| LevelResult {
        triangles: prop.triangles(units),
        error: error / prop.sphere.radius,
        looks,
    });
    Ok(PropResult {
        name: name.to_owned(),
        triangles: prop.triangles(&prop.source()).into(),
        levels: levels.collect(),
    })
}

impl Look {
    fn add(&mut self, other: &Self, share: f64) {
        self.rmse += other.rmse * share;
        self.flip += other.flip * share;
        self.covered += other.covered * share;
    }
}

/// The differences of a picture from a picture of the source.
#[must_use]
pub fn look_of(reference: &Picture, picture: &Picture) -> Look {
    let error = image_error(reference, picture, true);
    let area = |covered: &[bool]| covered.iter().filter(|c| **c).count() as f64;
    Look {
        rmse: error.rmse,
        flip: error.flip.unwrap_or_default(),
        covered: area(&picture.covered) / area(&reference.covered).max(1.0),
    }
}

/// One of `count` directions on a spiral from pole to pole.
#[must_use]
pub fn direction(index: u32, count: u32) -> Vec3 {
    let y = 1.0 - 2.0 * (index as f32 + 0.5) / count as f32;
    // Steps of the golden angle spread the directions evenly around the axis.
    let (sin, cos) = (index as f32 * 2.399_963).sin_cos();
    let across = (1.0 - y * y).max(0.0).sqrt();
    Vec3::new(across * cos, y, across * sin)
}

/// An eye from which a sphere has a radius of `radius_px` on screen.
#[must_use]
pub fn eye(sphere: &Sphere, direction: Vec3, radius_px: f32) -> Eye {
    // The margin of 40 % leaves room for levels that reach beyond the sphere.
    let size_px = (2.8 * radius_px).ceil().max(16.0);
    let eye = Eye::perspective(FOVY_DEG, Vec2::splat(size_px), sphere.radius * 1e-2);
    let distance = sphere.radius * eye.focal_px() / radius_px;
    eye.looking_at(sphere.center + direction * distance, sphere.center)
}

/// A table for each mesh: one row per level, one column per size.
#[must_use]
pub fn table(results: &[PropResult]) -> String {
    let mut text =
        String::from("levels by radius on screen: RMSE on a scale of 255, FLIP, covered area\n");
    for result in results {
        let _ = write!(
            text,
            "\n{}, {} triangles\n{:>9}   {:>7}",
            result.name, result.triangles, "triangles", "error"
        );
        for radius_px in RADII_PX {
            let _ = write!(text, "   {radius_px:>3.0} px         ");
        }
        text.push('\n');
        for level in &result.levels {
            let _ = write!(text, "{:>9}   {:>7.4}", level.triangles, level.error);
            text.extend(level.looks.iter().map(look_text));
            text.push('\n');
        }
    }
    text
}

fn look_text(look: &Look) -> String {
    let Look {
        rmse,
        flip,
        covered,
    } = look;
    format!("  {rmse:>4.1} {flip:.3} {covered:>4.2}")
}
