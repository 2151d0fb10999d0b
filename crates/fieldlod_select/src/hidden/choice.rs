//! Which instances are drawn into the depth image, and how: large ones by the triangles of one of their
//! levels, small ones by points.

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

/// The least radius in the image of an instance that hides others, in texels.
const LEAST_RADIUS: f32 = 1.0;
/// Points for each texel that a sphere covers.
const POINTS_PER_TEXEL: f32 = 0.5;
/// How meshes are drawn that have levels in pieces, and those that have levels as a whole. The finest piece by
/// piece: what is near in a ground hides much, and a coarse one hides what stands on it. Points show the gaps in
/// crowns, and close them no more than their coarse levels do.
const IN_PIECES: Fineness = Fineness {
    largest_point_area: 1400.0,
    triangles_per_texel: 0.12,
};
const AS_A_WHOLE: Fineness = Fineness {
    largest_point_area: 20_000.0,
    triangles_per_texel: 0.012,
};
/// The most of what is left of the budget that one instance may take.
const SHARE_OF_REST: u32 = 4;
/// Points that cost as much as a triangle.
const POINTS_PER_TRIANGLE: u32 = 32;

struct Fineness {
    /// Texels that a sphere covers up to which its instance is drawn by points.
    largest_point_area: f32,
    /// Triangles for each texel that a sphere covers, at most.
    triangles_per_texel: f32,
}

/// The choice of one view, in storage that is used again.
#[derive(Clone, Debug, Default)]
pub(crate) struct OccluderChoice {
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) chosen: Vec<ChosenOccluder>,
    pub(crate) triangle_count: u32,
    pub(crate) point_count: u32,
}

/// One instance as it is drawn.
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
    /// Texels that its sphere covers, about.
    area: f32,
}

/// Placement of an instance in camera space: linear part and origin.
pub(crate) fn camera_from_local(view: &View, world_from_local: &Affine3A) -> (Mat3, Vec3) {
    let from_eye = Vec3::from(world_from_local.translation) - view.eye_in_world;
    let linear = view.camera_from_world * Mat3::from(world_from_local.matrix3);
    (linear, view.camera_from_world * from_eye)
}

impl OccluderChoice {
    /// How an instance is drawn, if what is left of the triangles of the `budget` allows; its cost counts
    /// from then on.
    pub(crate) fn choose(
        &mut self,
        scene: &Scene,
        view: &View,
        plane: &ImagePlane,
        budget: u32,
        Candidate { instance, area }: Candidate,
    ) -> Option<ChosenOccluder> {
        let mesh = scene.entries[instance as usize].occluder_mesh(view.layers)?;
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
            // The finest level that is worth its texels.
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

    /// Notes how many points the one that was chosen last has taken.
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

    /// Begins another image: lists what may hide others, the largest first.
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
                let instance = columns.occupants[element * LANES + lane];
                self.candidates.push(Candidate { instance, area });
            }
        }
        self.candidates.sort_unstable_by(|a, b| {
            let by_area = b.area.total_cmp(&a.area);
            by_area.then(a.instance.cmp(&b.instance))
        });
    }
}

/// The search for what is large in the image.
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

    /// About how many texels eight things of some radii in spheres cover at most; 0 of those that are outside the
    /// view or too small.
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
