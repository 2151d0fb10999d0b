//! One pair of reference cameras, and how many of their samples merge in a layered depth image.
//!
//! Both references sample the scene. Samples inside both frusta are projected into one camera; of
//! those that fall into one of its pixels at nearly the same depth, all but one are merged away
//! (§4.2.3).

use camera_field::double::{
    FieldLine, Intrinsics, ParallelCamera, Pose, PosedCamera, compound_field, convergent_point,
    equivalent_camera,
};
use fieldlod_hierarchy::fixtures::Random;
use glam::{DVec2, DVec3, dvec2, dvec3};
use serde::Serialize;

use super::scene::Scene;

/// Samples closer than this share of their depth are taken for one piece of surface.
const SAME_DEPTH: f64 = 0.02;
/// The pixel grid is shifted so often and the counts averaged: otherwise chance alignment of the
/// grids decides.
const GRID_SHIFTS: u32 = 8;

/// Samples that merge, by the position of the camera of the layered depth image.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LdiCounts {
    /// Merged at the convergent point.
    pub convergent_point: f64,
    /// Merged at the average position, with the convergent camera's focal length.
    pub average_same_focal: f64,
    /// Merged at the average position, with the focal length that gives the same density on the
    /// plane at the mean depth.
    pub average_same_density: f64,
}

/// The result of one pair of cameras.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SetResult {
    /// Samples of both cameras inside both frusta.
    pub samples: usize,
    /// Depths of the plane at the mean depth of the samples, from both cameras.
    pub plane_depths: [f64; 2],
    /// Focal length of the camera at the convergent point, in pixels.
    pub focal_px: f64,
    /// Samples merged away.
    pub merged: LdiCounts,
}

/// A pair of reference cameras and the camera positions that are compared.
#[derive(Clone, Debug)]
pub(super) struct CameraSet {
    pub(super) references: [PosedCamera; 2],
    pub(super) convergent: DVec3,
    pub(super) average: DVec3,
    pub(super) result: SetResult,
}

/// The placement of the two cameras of a set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    /// The point that the pair looks at.
    pub(super) target: DVec3,
    /// Heading of the pair, around the vertical.
    pub(super) heading: f64,
    /// Each camera turns by up to this much towards or from the other.
    pub(super) most_toe_in: f64,
}

impl CameraSet {
    pub(super) fn new(scene: &Scene, placement: Placement, random: &mut Random) -> Self {
        // Two cameras, and the samples that both see.
        let references = free_references(scene, placement, random);
        let points = shared_samples(scene, &references);
        // The plane across the mean axis, at the mean depth of the samples.
        let axis = (references[0].pose.axis() + references[1].pose.axis()).normalize();
        let plane = points.iter().map(|p| p.dot(axis)).sum::<f64>() / points.len() as f64;
        let depth_from = |origin: DVec3| plane - origin.dot(axis);
        let plane_depths = references.map(|camera| depth_from(camera.pose.origin));
        // The two positions that are compared.
        let average = (references[0].pose.origin + references[1].pose.origin) * 0.5;
        let parallel = references[0].pose.axis().dot(references[1].pose.axis()) > 1.0 - 1e-12;
        let (convergent, focal_px) = if parallel {
            parallel_case(&references, plane_depths)
        } else {
            general_case(&references, &points, axis, depth_from)
        };
        // How many samples merge in a camera there.
        let merged = |origin: DVec3, focal_px: f64| merged(&points, origin, axis, focal_px);
        let same_density = focal_px * depth_from(average) / depth_from(convergent);
        let counts = LdiCounts {
            convergent_point: merged(convergent, focal_px),
            average_same_focal: merged(average, focal_px),
            average_same_density: merged(average, same_density),
        };
        let result = SetResult {
            samples: points.len(),
            plane_depths,
            focal_px,
            merged: counts,
        };
        Self {
            references,
            convergent,
            average,
            result,
        }
    }
}

/// (21) and appendix v.
fn parallel_case(references: &[PosedCamera; 2], plane_depths: [f64; 2]) -> (DVec3, f64) {
    let [a, b] = [0, 1].map(|index| ParallelCamera {
        origin: references[index].pose.origin,
        focal_px: references[index].intrinsics.focal_px.x,
        depth: plane_depths[index],
    });
    let camera = equivalent_camera(&[a, b]).expect("two cameras before the plane");
    (camera.origin, camera.focal_px)
}

/// The least-squares convergent point, and the focal length that gives the mean density of the
/// compound field towards the axis.
fn general_case(
    references: &[PosedCamera; 2],
    points: &[DVec3],
    axis: DVec3,
    depth_from: impl Fn(DVec3) -> f64,
) -> (DVec3, f64) {
    let lines = points
        .iter()
        .filter_map(|&p| FieldLine::through(references, p));
    let origin = convergent_point(lines).expect("the lines are not parallel");
    // The mean density of the field towards the axis, at the depth of the plane.
    let facing = |&p: &DVec3| -compound_field(references, p).dot(axis);
    let density = points.iter().map(facing).sum::<f64>() / points.len() as f64;
    (origin, density.sqrt() * depth_from(origin))
}

/// A random number between two.
pub(super) fn between(random: &mut Random, least: f64, greatest: f64) -> f64 {
    least + (greatest - least) * f64::from(random.unit())
}

/// A pair of which no camera stands inside a solid.
fn free_references(scene: &Scene, placement: Placement, random: &mut Random) -> [PosedCamera; 2] {
    loop {
        let pair = references(placement, random);
        if pair
            .iter()
            .all(|camera| scene.is_free(camera.pose.origin, 0.3))
        {
            return pair;
        }
    }
}

/// Two cameras side by side, one of them further back, with one focal length.
fn references(placement: Placement, random: &mut Random) -> [PosedCamera; 2] {
    let axis = dvec3(placement.heading.sin(), 0.0, placement.heading.cos());
    let side = dvec3(axis.z, 0.0, -axis.x);
    // How far they are away and apart, and how much they turn.
    let distance = between(random, 8.0, 11.0);
    let nearer = between(random, 0.0, 4.5);
    let apart = between(random, 1.0, 3.5);
    let height = between(random, -0.6, 0.4);
    let toe_in = if placement.most_toe_in > 0.0 {
        between(random, 0.25, 1.0) * placement.most_toe_in
    } else {
        0.0
    };
    let image_px = dvec2(240.0, 180.0);
    let intrinsics = Intrinsics::centered(between(random, 150.0, 240.0), image_px);
    let camera = |across: f64, back: f64, height: f64, turn: f64| {
        let origin = placement.target - axis * back + side * across + DVec3::Y * height;
        let looks = axis * turn.cos() + side * turn.sin();
        let pose = Pose::looking_at(origin, origin + looks, DVec3::NEG_Y);
        PosedCamera { intrinsics, pose }
    };
    [
        camera(-0.5 * apart, distance, height, toe_in),
        camera(0.5 * apart, distance - nearer, -0.3 * height, -toe_in),
    ]
}

/// The samples of both cameras that lie inside both frusta.
fn shared_samples(scene: &Scene, references: &[PosedCamera; 2]) -> Vec<DVec3> {
    references
        .iter()
        .flat_map(|camera| scene.capture(camera))
        .flatten()
        .map(|hit| hit.position)
        .filter(|&p| references.iter().all(|camera| camera.contains(p)))
        .collect()
}

/// Samples merged away by a camera at `origin` that looks along `axis`: all but one of each pixel
/// and depth.
fn merged(points: &[DVec3], origin: DVec3, axis: DVec3, focal_px: f64) -> f64 {
    let pose = Pose::looking_at(origin, origin + axis, DVec3::NEG_Y);
    // Samples on the image, with their depths.
    let projected: Vec<DVec3> = points
        .iter()
        .map(|&p| pose.to_camera(p))
        .filter(|p| p.z > 0.0)
        .map(|p| (p.truncate() / p.z * focal_px).extend(p.z))
        .collect();
    // The R2 sequence (Roberts 2018) covers the pixel evenly without a period of its own.
    let shifts = (0..GRID_SHIFTS).map(|index| {
        let step = f64::from(index) + 0.5;
        dvec2(
            (step * 0.754_877_666).fract(),
            (step * 0.569_840_291).fract(),
        )
    });
    let total: usize = shifts.map(|shift| merged_on_grid(&projected, shift)).sum();
    total as f64 / f64::from(GRID_SHIFTS)
}

fn merged_on_grid(projected: &[DVec3], shift: DVec2) -> usize {
    // Row, column and depth in one key: bits of positive floats are in the order of the floats.
    let mut keys: Vec<u64> = projected
        .iter()
        .map(|p| {
            let pixel =
                [p.y + shift.y, p.x + shift.x].map(|at| u64::from(at.floor() as i16 as u16));
            pixel[0] << 48 | pixel[1] << 32 | u64::from((p.z as f32).to_bits())
        })
        .collect();
    keys.sort_unstable();
    // From the nearest to the farthest of each pixel: a depth beyond the last layer's is a new one.
    let mut layers = 0;
    let mut layer: Option<(u64, f64)> = None;
    for key in &keys {
        let (pixel, depth) = (key >> 32, f64::from(f32::from_bits(*key as u32)));
        let same = layer.is_some_and(|(layer_pixel, nearest)| {
            layer_pixel == pixel && depth - nearest <= SAME_DEPTH * nearest
        });
        if !same {
            layers += 1;
            layer = Some((pixel, depth));
        }
    }
    keys.len() - layers
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A camera that resamples its own image merges nothing; at half the focal length it merges
    /// three of four.
    #[test]
    fn a_camera_keeps_its_own_samples() {
        let pose = Pose::looking_at(DVec3::ZERO, DVec3::Z, DVec3::NEG_Y);
        let pixels = (-20..20).flat_map(|x| (-20..20).map(move |y| dvec2(x.into(), y.into())));
        let points: Vec<DVec3> = pixels
            .map(|pixel| pose.to_world(((pixel + 0.5) / 100.0).extend(1.0) * 5.0))
            .collect();
        assert_eq!(
            merged(&points, DVec3::ZERO, DVec3::Z, 100.0 * (1.0 + 1e-9)),
            0.0
        );
        let at_half = merged(&points, DVec3::ZERO, DVec3::Z, 50.0);
        assert!((at_half - 1200.0).abs() < 40.0, "{at_half}");
        // Depths apart are layers, not merged.
        let two = [DVec3::Z * 2.0, DVec3::Z * 3.0];
        assert_eq!(merged(&two, DVec3::ZERO, DVec3::Z, 100.0), 0.0);
    }
}
