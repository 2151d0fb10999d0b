//! Chooses the instances that are drawn into the depth image. Large instances are drawn by triangles of a coarse level,
//! small instances by points.

use camera_field::Camera;
use glam::{Affine3A, Mat3, Vec3};
use wide::f32x8;

use super::ImagePlane;
use super::occluder::OccluderPart;
use super::surface_samples::MESH_SAMPLES;
use crate::lanes::bits::LANES;
use crate::lanes::{Lane, M3, V3};
use crate::scene::{MeshId, Scene};
use crate::view::View;
use crate::view::sides::LensSides;

/// Least radius of an occluder in texels. Smaller occluders hide little, and cost as much as larger occluders.
const LEAST_RADIUS: f32 = 1.0;
/// Points for each texel of a sphere. Fewer points leave gaps; more points cost time in proportion.
const POINTS_PER_TEXEL: f32 = 0.5;
/// Limits for meshes of clusters, for example grounds. Near parts hide much, and a coarse ground hides the objects on
/// it, so that these meshes get more triangles.
const IN_PIECES: Fineness = Fineness {
    largest_point_area: 1400.0,
    triangles_per_texel: 0.12,
};
/// Limits for meshes that are drawn as a whole, for example trees. Points keep the gaps in crowns open, which coarse
/// levels close.
const AS_A_WHOLE: Fineness = Fineness {
    largest_point_area: 20_000.0,
    triangles_per_texel: 0.012,
};
/// One instance takes at most one part in this number of the remaining budget, so that other instances can hide too.
const SHARE_OF_REST: u32 = 4;
/// Points that take as long as a triangle.
const POINTS_PER_TRIANGLE: u32 = 32;

struct Fineness {
    /// Largest area of a sphere in texels at which its instance is drawn by points.
    largest_point_area: f32,
    /// Largest number of triangles for each texel of a sphere.
    triangles_per_texel: f32,
}

/// The choice of one view, in buffers that are reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct OccluderChoice {
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) chosen: Vec<ChosenOccluder>,
    pub(crate) triangle_count: u32,
    pub(crate) point_count: u32,
}

/// How one instance is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChosenOccluder {
    pub(crate) instance: u32,
    pub(crate) mesh: MeshId,
    pub(crate) drawn_by: DrawnBy,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum DrawnBy {
    /// The triangles of a level.
    Level(usize),
    /// This number of points.
    Points(usize),
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) instance: u32,
    mesh: MeshId,
    /// Approximate area of the instance's sphere in texels.
    area: f32,
}

/// Placement of an instance in camera space: linear part and origin.
pub(crate) fn camera_from_local(view: &View, world_from_local: &Affine3A) -> (Mat3, Vec3) {
    let from_eye = Vec3::from(world_from_local.translation) - view.eye_in_world;
    let linear = view.camera_from_world * Mat3::from(world_from_local.matrix3);
    (linear, view.camera_from_world * from_eye)
}

impl OccluderChoice {
    /// Chooses how to draw an instance within the rest of the triangle `budget`, and adds its cost; `None` if the rest
    /// is too small.
    pub(crate) fn choose(
        &mut self,
        scene: &Scene,
        view: &View,
        plane: &ImagePlane,
        budget: u32,
        candidate: Candidate,
    ) -> Option<ChosenOccluder> {
        let Candidate {
            instance,
            mesh,
            area,
        } = candidate;
        let rest = budget.saturating_sub(self.cost_in_triangles());
        let table = scene.table(mesh);
        let fineness = if table.has_one_place() {
            AS_A_WHOLE
        } else {
            IN_PIECES
        };
        let drawn_by = if area <= fineness.largest_point_area {
            let points = ((area * POINTS_PER_TEXEL) as u32).min(MESH_SAMPLES);
            if points / POINTS_PER_TRIANGLE > rest {
                return None;
            }
            DrawnBy::Points(points as usize)
        } else {
            let placement = &scene.instances[instance as usize].world_from_local;
            let (linear, origin) = camera_from_local(view, placement);
            let worth = (area * fineness.triangles_per_texel) as u32;
            let most = worth.min(rest / SHARE_OF_REST);
            // The finest level within that limit.
            let levels = table.occluders.iter().enumerate();
            let mut counted = levels.map(|(level, mesh)| {
                let parts = mesh.parts_in_view(plane, &linear, origin);
                (level, parts.map(OccluderPart::triangle_count).sum::<u32>())
            });
            let (level, count) = counted.find(|&(_, count)| count <= most)?;
            self.triangle_count += count;
            DrawnBy::Level(level)
        };
        let chosen = ChosenOccluder {
            instance,
            mesh,
            drawn_by,
        };
        self.chosen.push(chosen);
        Some(chosen)
    }

    /// Sets the number of points that the last chosen occluder took.
    pub(crate) fn note_points(&mut self, count: usize) {
        if let Some(ChosenOccluder {
            drawn_by: DrawnBy::Points(points),
            ..
        }) = self.chosen.last_mut()
        {
            *points = count;
            self.point_count += count as u32;
        }
    }

    /// Triangles chosen so far.
    pub(crate) fn cost_in_triangles(&self) -> u32 {
        self.triangle_count + self.point_count / POINTS_PER_TRIANGLE
    }

    /// Starts another image: lists the instances that may hide others, the largest first.
    pub(crate) fn begin(&mut self, scene: &Scene, view: &View, plane: &ImagePlane) {
        self.candidates.clear();
        self.chosen.clear();
        (self.triangle_count, self.point_count) = (0, 0);
        let search = Search::new(view, plane);
        let columns = &scene.columns;
        let elements = columns.spheres.iter().zip(&columns.occluder_radii);
        for (element, (spheres, radii)) in elements.enumerate() {
            let radii = f32x8::new(*radii);
            let areas = search.areas(spheres.center(), spheres.radius(), radii);
            let areas = areas.to_array();
            for (lane, &area) in areas.iter().enumerate().filter(|(_, area)| **area > 0.0) {
                let occupant = columns.occupants[element * LANES + lane];
                self.candidates
                    .extend(occupant.seen_mesh(view.layers).map(|mesh| Candidate {
                        instance: occupant.id.index,
                        mesh,
                        area,
                    }));
            }
        }
        self.candidates.sort_unstable_by(|a, b| {
            let by_area = b.area.total_cmp(&a.area);
            by_area.then(a.instance.cmp(&b.instance))
        });
    }
}

/// The search for large instances in the image.
struct Search<'a> {
    view: &'a View,
    sides: LensSides,
    is_perspective: bool,
    /// Texels per unit of length at unit distance, squared.
    scale_squared: f32,
    image_area: f32,
}

impl<'a> Search<'a> {
    fn new(view: &'a View, plane: &ImagePlane) -> Self {
        Self {
            view,
            sides: LensSides::of(&view.image_camera),
            is_perspective: matches!(view.camera, Camera::Perspective(_)),
            scale_squared: plane.scale.x * plane.scale.y,
            image_area: (plane.width * plane.height) as f32,
        }
    }

    /// Approximate areas in texels of eight occluders; 0 outside the view and for small occluders.
    #[inline(always)]
    fn areas(&self, center: V3<f32x8>, radius: f32x8, occluder_radius: f32x8) -> f32x8 {
        let zero = f32x8::zero();
        let from_eye = center.minus(V3::splat(self.view.eye_in_world));
        let seen = M3::splat(&self.view.camera_from_world).of(from_eye);
        let beyond = (self.sides.least_inside(seen) + radius).is_below(zero);
        let mut texels_squared =
            occluder_radius * occluder_radius * f32x8::splat(self.scale_squared);
        if self.is_perspective {
            let gap = from_eye.dot(from_eye).sqrt() - radius;
            let nearest = gap.larger(zero) + occluder_radius;
            texels_squared /= nearest * nearest;
        }
        let is_large = f32x8::splat(LEAST_RADIUS * LEAST_RADIUS).is_at_most(texels_squared);
        let area = texels_squared * f32x8::splat(std::f32::consts::PI);
        let area = area.smaller(f32x8::splat(self.image_area));
        f32x8::choose(
            is_large & !beyond & zero.is_below(occluder_radius),
            area,
            zero,
        )
    }
}
