//! Chooses the instances that are drawn into the depth image. Large instances are drawn by triangles of a coarse level,
//! small instances by points.

use glam::{Mat3, Vec3};

use super::ImagePlane;
use super::occluder::{OccluderPart, parts_in_view};
use super::surface_samples::MESH_SAMPLES;
use crate::lanes::bits::LANES;
use crate::lanes::{Eight, larger, smaller, with_avx2};
use crate::scene::columns::sphere_at;
use crate::scene::table::GroupTable;
use crate::scene::{MeshId, Scene};
use crate::view::View;
use crate::view::sides::LensSides;

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
    pub(crate) instance: u32,
    pub(crate) mesh: MeshId,
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
        table: &'a GroupTable,
        plane: &ImagePlane,
        linear: &Mat3,
        origin: Vec3,
        rest: u32,
    ) -> Option<DrawnBy<'a>> {
        let fineness = if table.has_one_place() {
            AS_A_WHOLE
        } else {
            IN_PIECES
        };
        if self.area <= fineness.largest_point_area {
            let count = ((self.area * POINTS_PER_TEXEL) as u32).min(MESH_SAMPLES);
            let points = table.samples.of_mesh(count as usize);
            return (count / POINTS_PER_TRIANGLE <= rest).then_some(DrawnBy::Points(points));
        }
        let worth = (self.area * fineness.triangles_per_texel) as u32;
        let most = worth.min(rest / SHARE_OF_REST);
        // The finest level within that limit.
        let mut levels = table.occluders.iter().map(|parts| {
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
    plane: &ImagePlane,
    candidates: &mut Vec<Candidate>,
) {
    candidates.clear();
    let sides = LensSides::of(&view.image_camera);
    let columns = &scene.columns;
    let elements = columns.spheres.iter().zip(&columns.occluder_radii);
    with_avx2(
        #[inline(always)]
        || {
            for (element, (spheres, radii)) in elements.enumerate() {
                let mut areas = [0.0; LANES];
                for (lane, area) in areas.iter_mut().enumerate() {
                    *area = area_of(view, &sides, plane, sphere_at(spheres, lane), radii[lane]);
                }
                for (lane, &area) in areas.iter().enumerate().filter(|(_, area)| **area > 0.0) {
                    let occupant = columns.occupants[element * LANES + lane];
                    let seen = occupant.seen_mesh(view.layers);
                    candidates.extend(seen.map(|mesh| Candidate {
                        instance: occupant.id.index,
                        mesh,
                        area,
                    }));
                }
            }
        },
    );
    // Ties by the instance: the image must not depend on the order of slots.
    candidates.sort_unstable_by(|a, b| {
        let by_area = b.area.total_cmp(&a.area);
        by_area.then(a.instance.cmp(&b.instance))
    });
}

/// Approximate area in texels of an occluder; 0 outside the view and for small occluders.
#[inline(always)]
fn area_of(
    view: &View,
    sides: &LensSides,
    plane: &ImagePlane,
    (center, radius): (Vec3, f32),
    occluder_radius: f32,
) -> f32 {
    let from_eye = center - view.eye_in_world;
    let is_beyond = sides.least_inside(view.camera_from_world * from_eye) + radius < 0.0;
    let mut texels_squared = occluder_radius * occluder_radius * (plane.scale.x * plane.scale.y);
    if plane.is_perspective {
        let gap = from_eye.dot(from_eye).sqrt() - radius;
        let nearest = larger(gap, 0.0) + occluder_radius;
        texels_squared /= nearest * nearest;
    }
    let is_large = texels_squared >= LEAST_RADIUS * LEAST_RADIUS;
    let counts = is_large & !is_beyond & (occluder_radius > 0.0);
    let area = texels_squared * std::f32::consts::PI;
    let area = smaller(area, (plane.width * plane.height) as f32);
    if counts { area } else { 0.0 }
}
