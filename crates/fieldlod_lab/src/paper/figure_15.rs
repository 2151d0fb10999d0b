//! Figure 15: a model drawn from splats, beside its triangles.

use std::path::Path;

use camera_field::double::{Intrinsics, Pose, PosedCamera};
use fieldlod_hierarchy::fixtures::Random;
use glam::{DVec2, DVec3, dvec2, dvec3};
use serde::Serialize;

use super::model::{Vertex, sample_surface, torus_knot};
use super::raster::{Image, draw_triangles};
use super::splatting::{SplatMode, draw_splats};
use crate::canvas::{Canvas, Color, Rect};
use crate::files::WriteError;

/// The numbers of figure 15.
#[derive(Clone, Debug, Serialize)]
pub struct Figure15 {
    /// Triangles of the model.
    pub triangles: usize,
    /// Sample points on the whole model.
    pub samples: usize,
    /// Pixels that the triangles cover.
    pub covered_px: usize,
    /// The paper's kernel.
    pub paper: SplatErrors,
    /// Our kernel, sheared to second order.
    pub sheared: SplatErrors,
    /// The exact projection of each disk.
    pub exact: SplatErrors,
}

/// Differences of a picture of splats from that of the triangles.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SplatErrors {
    /// Root mean square difference of colour, in 0..=255, where both cover the pixel.
    pub rmse_of_255: f64,
    /// Pixels that the triangles cover and the splats do not.
    pub missing_px: usize,
    /// Pixels that the splats cover and the triangles do not.
    pub extra_px: usize,
    /// Root mean square difference of colour to the exact splats, where both cover the pixel.
    pub rmse_to_exact_splats_of_255: f64,
}

const SIDE: usize = 400;
const SAMPLES: u32 = 9000;

pub(super) fn draw(path: &Path) -> Result<Figure15, WriteError> {
    // The model, as triangles and as samples.
    let camera = camera();
    let triangles = torus_knot();
    let (samples, stratum) = sample_surface(&triangles, SAMPLES, &mut Random::new(15));
    // Disks of eight strata: random samples leave few gaps.
    let radius = (8.0 * stratum / core::f64::consts::PI).sqrt();
    // Its picture, by triangles and by splats of each kernel.
    let reference = draw_triangles(&camera, &triangles, SIDE);
    let splats = |mode| draw_splats(&camera, &samples, radius, mode, SIDE);
    let [paper, sheared, exact] =
        [SplatMode::Paper, SplatMode::Sheared, SplatMode::Exact].map(splats);
    let numbers = Figure15 {
        triangles: triangles.len(),
        samples: samples.len(),
        covered_px: (0..SIDE * SIDE)
            .filter(|&index| reference.covered(index))
            .count(),
        paper: errors(&reference, &exact, &paper),
        sheared: errors(&reference, &exact, &sheared),
        exact: errors(&reference, &exact, &exact),
    };
    // Above the pictures, below their differences.
    let mut canvas = Canvas::new(1260, 910);
    let left = 20.0;
    draw_image(
        &mut canvas,
        [left, 40.0],
        "triangles, and a tenth of the samples",
        &reference,
    );
    draw_samples(&mut canvas, [left, 40.0], &camera, &samples, &reference);
    draw_image(
        &mut canvas,
        [left + 410.0, 40.0],
        "splats, the paper's kernel",
        &paper,
    );
    draw_image(
        &mut canvas,
        [left + 820.0, 40.0],
        "splats, our sheared kernel",
        &sheared,
    );
    let paper_difference = shifted_difference(&paper, &reference, 2.0);
    draw_image(
        &mut canvas,
        [left, 490.0],
        "paper's - triangles, x 2",
        &paper_difference,
    );
    let to_exact = shifted_difference(&paper, &exact, 8.0);
    draw_image(
        &mut canvas,
        [left + 410.0, 490.0],
        "paper's - exact splats, x 8",
        &to_exact,
    );
    let to_exact = shifted_difference(&sheared, &exact, 8.0);
    draw_image(
        &mut canvas,
        [left + 820.0, 490.0],
        "ours - exact splats, x 8",
        &to_exact,
    );
    canvas.save(path)?;
    Ok(numbers)
}

/// Near the model and wide, so that perspective is strong.
fn camera() -> PosedCamera {
    PosedCamera {
        intrinsics: Intrinsics::centered(190.0, DVec2::splat(SIDE as f64)),
        pose: Pose::looking_at(dvec3(0.2, -0.5, -2.05), DVec3::ZERO, DVec3::NEG_Y),
    }
}

fn rmse_of_255(one: &Image, other: &Image) -> f64 {
    let both = (0..SIDE * SIDE).filter(|&index| one.covered(index) && other.covered(index));
    let (mut sum, mut count) = (0.0, 0.0);
    for index in both {
        sum += (one.color[index] - other.color[index]).length_squared() / 3.0;
        count += 1.0;
    }
    255.0 * (sum / f64::max(count, 1.0)).sqrt()
}

fn errors(reference: &Image, exact: &Image, image: &Image) -> SplatErrors {
    // Pixels that one covers and the other does not.
    let only = |one: &Image, other: &Image| {
        let indices = 0..SIDE * SIDE;
        indices
            .filter(|&index| one.covered(index) && !other.covered(index))
            .count()
    };
    SplatErrors {
        rmse_of_255: rmse_of_255(reference, image),
        missing_px: only(reference, image),
        extra_px: only(image, reference),
        rmse_to_exact_splats_of_255: rmse_of_255(exact, image),
    }
}

/// Gray where two images agree.
fn shifted_difference(image: &Image, other: &Image, gain: f64) -> Image {
    let mut difference = image.clone();
    for (color, other) in difference.color.iter_mut().zip(&other.color) {
        *color = (*color - *other) * gain + 0.5;
    }
    difference
}

fn draw_image(canvas: &mut Canvas, [left, top]: [f64; 2], name: &str, image: &Image) {
    let area = Rect::new(left, top, SIDE as f64, SIDE as f64);
    canvas.shade(area, |pixel| {
        let index = pixel.y as usize * SIDE + pixel.x as usize;
        Color::from_unit(image.color[index].to_array())
    });
    canvas.frame(area, Color::PALE);
    canvas.caption(dvec2(area.center().x, top - 16.0), name);
}

/// The visible ones of a tenth of the samples.
fn draw_samples(
    canvas: &mut Canvas,
    [left, top]: [f64; 2],
    camera: &PosedCamera,
    samples: &[Vertex],
    reference: &Image,
) {
    let corner = dvec2(left, top);
    canvas.clip_to(Some(Rect::new(left, top, SIDE as f64, SIDE as f64)));
    // Samples are stored ring by ring: a fixed step would pick lines of them.
    let picked = |index: usize| (index as f64 * 0.618_034).fract() < 0.1;
    for (_, sample) in samples
        .iter()
        .enumerate()
        .filter(|&(index, _)| picked(index))
    {
        // Only what the triangles do not hide.
        let p = camera.pose.to_camera(sample.position);
        let pixel = camera.intrinsics.project_px(p);
        let at = pixel + 0.5 * SIDE as f64;
        let inside = at.min_element() >= 0.0 && at.max_element() < SIDE as f64;
        if p.z > 0.0 && inside {
            let index = at.y as usize * SIDE + at.x as usize;
            if p.z <= reference.depth[index] + 0.02 {
                canvas.dot(corner + at, 2.6, Color::INK);
                canvas.dot(corner + at, 1.8, Color::WHITE);
            }
        }
    }
    canvas.clip_to(None);
}
