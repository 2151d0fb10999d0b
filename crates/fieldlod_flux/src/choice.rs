//! Chooses the instances that are drawn into the depth image. Large instances are drawn by triangles of a coarse level,
//! small instances by points.

use camera_field::{FieldOfView, SeenSphere};
use fieldlod_select::lanes::Eight;
use fieldlod_select::{PlacedInstance, Scene, View};
use glam::{Mat3, Vec3};

use crate::image_plane::ImagePlane;
use crate::occluder::{Occluder, OccluderPart, Occluders, parts_in_view};
use crate::surface_samples::MESH_SAMPLES;

// The constants were measured in a walk of 240 frames among 10,000 rocks, with a ground and without: triangles that the
// view draws, and the time of the depth image.

/// Least radius of an occluder in texels. Smaller occluders hide little, and cost as much as larger occluders: 0.5 drew
/// 0.95 of the triangles in 1.5 times the time, and 2 drew 1.5 times the triangles in 0.7 of the time.
const LEAST_RADIUS: f32 = 1.0;
/// Points for each texel of a sphere. Fewer points leave gaps: 0.25 drew 1.2 times the triangles in 0.9 of the time, and 1
/// drew 0.83 of the triangles in 1.2 times the time.
const POINTS_PER_TEXEL: f32 = 0.5;
/// Limits for meshes of clusters, for example grounds. Near parts hide much, and a coarse ground hides the objects on
/// it, so that these meshes get more triangles. Half the area drew 0.93 of the triangles in 1.1 times the time, and twice
/// the area 1.005 times the triangles. Half and twice the triangles per texel made no difference.
const IN_PIECES: Fineness = Fineness {
    largest_point_area: 1400.0,
    triangles_per_texel: 0.12,
};
/// Limits for meshes that are drawn as a whole, for example trees. Points keep the gaps in crowns open, which coarse
/// levels close. No rock of the walk was large enough for triangles.
const AS_A_WHOLE: Fineness = Fineness {
    largest_point_area: 20_000.0,
    triangles_per_texel: 0.012,
};
/// One instance takes at most one part in this number of the remaining budget, so that other instances can hide too. 2
/// took 1.5 times the time for the same triangles; 8 made no difference.
const SHARE_OF_REST: u32 = 4;
/// Points that take as long as a triangle. Half and twice made no difference in the walk, which did not use up the budget.
pub(crate) const POINTS_PER_TRIANGLE: u32 = 32;

struct Fineness {
    /// Largest area of a sphere in texels at which its instance is drawn by points.
    largest_point_area: f32,
    /// Largest number of triangles for each texel of a sphere.
    triangles_per_texel: f32,
}

/// An instance that may hide others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) placed: PlacedInstance,
    /// Approximate area of the instance's sphere in texels.
    area: f32,
}

/// How one instance is drawn.
pub(crate) enum DrawnBy<'a> {
    /// The parts of a level, and the number of their triangles in view.
    Level(&'a [OccluderPart], u32),
    Points(&'a [Eight<3>]),
}

impl Candidate {
    /// How to draw the instance within the `rest` of the triangle budget; `None` if no level is coarse enough, or the
    /// rest is too small.
    pub(crate) fn drawn_by<'a>(
        &self,
        occluder: &'a Occluder,
        plane: &ImagePlane,
        linear: &Mat3,
        origin: Vec3,
        rest: u32,
    ) -> Option<DrawnBy<'a>> {
        let fineness = if occluder.is_whole {
            AS_A_WHOLE
        } else {
            IN_PIECES
        };
        if self.area <= fineness.largest_point_area {
            let count = ((self.area * POINTS_PER_TEXEL) as u32).min(MESH_SAMPLES);
            let points = occluder.samples.first(count as usize);
            return (count / POINTS_PER_TRIANGLE <= rest).then_some(DrawnBy::Points(points));
        }
        let worth = (self.area * fineness.triangles_per_texel) as u32;
        let most = worth.min(rest / SHARE_OF_REST);
        // The finest level within that limit.
        let mut levels = occluder.levels.iter().map(|parts| {
            let in_view = parts_in_view(parts, plane, linear, origin);
            let count = in_view.map(|part| part.triangles.len() as u32).sum();
            (parts, count)
        });
        let (parts, count) = levels.find(|&(_, count)| count <= most)?;
        Some(DrawnBy::Level(parts, count))
    }
}

/// Lists the instances that may hide others, the largest first.
pub(crate) fn list_candidates(
    scene: &Scene,
    view: &View,
    occluders: &Occluders,
    plane: &ImagePlane,
    candidates: &mut Vec<Candidate>,
) {
    candidates.clear();
    let image = FieldOfView::of(view.camera());
    // Most instances are too small.
    for placed in scene.all_placed() {
        let center = view.in_camera(placed.sphere.center);
        let sphere = SeenSphere::new(center, placed.sphere.radius);
        let area = area_of(&image, plane, &sphere);
        let is_seen = placed.layers & view.layers() != 0;
        if area > 0.0 && is_seen && occluders.hiding(placed.id, placed.mesh).is_some() {
            candidates.push(Candidate { placed, area });
        }
    }
    // Ties by the instance: the image must not depend on the order of the list.
    candidates.sort_unstable_by(|a, b| {
        let by_area = b.area.total_cmp(&a.area);
        by_area.then(a.placed.id.cmp(&b.placed.id))
    });
}

/// Approximate area in texels of an occluder; 0 outside the view and for small occluders.
fn area_of(image: &FieldOfView, plane: &ImagePlane, sphere: &SeenSphere) -> f32 {
    let radius = sphere.radius;
    let mut texels_squared = radius * radius * (plane.scale.x * plane.scale.y);
    if plane.is_perspective {
        let nearest = (sphere.distance - radius).max(0.0) + radius;
        texels_squared /= nearest * nearest;
    }
    let is_large = texels_squared >= LEAST_RADIUS * LEAST_RADIUS;
    if !is_large || image.excludes(sphere) {
        return 0.0;
    }
    let area = texels_squared * std::f32::consts::PI;
    area.min((plane.width * plane.height) as f32)
}
