//! Which instances are drawn into the depth image, and how: large ones by the triangles of one of their
//! levels, small ones by points.

use camera_field::Camera;
use fieldlod_hierarchy::Sphere;
use glam::{Affine3A, Mat3, Vec3};

use super::ImagePlane;
use super::occluder::OccluderPart;
use super::solid::SolidLevel;
use super::surface_samples::MESH_SAMPLES;
use crate::lane::V3;
use crate::scene::{Instance, MeshId, Scene};
use crate::sides::Sides;
use crate::stretch::largest_stretch;
use crate::table::GroupTable;
use crate::tree::FAN;
use crate::view::View;

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
/// The least radius of what hides for certain, and by how much a level of it may err where there is a
/// coarser one; in texels.
const LEAST_SOLID_RADIUS: f32 = 4.0;
const SOLID_ERROR: f32 = 0.5;
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
    /// So many points.
    Points(usize),
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) instance: u32,
    /// Texels that its sphere covers, about.
    area: f32,
}

struct Search<'a> {
    scene: &'a Scene,
    view: &'a View,
    sides: Sides<f32>,
    /// Texels per unit of length at unit distance, squared.
    scale_squared: f32,
    image_area: f32,
}

/// Where an instance is in camera space: its linear part and its origin.
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

    /// What was chosen so far, in triangles.
    pub(crate) fn cost_in_triangles(&self) -> u32 {
        self.triangle_count + self.point_count / POINTS_PER_TRIANGLE
    }

    /// Begins another image: lists what may hide others, the largest first.
    pub(crate) fn begin(&mut self, scene: &Scene, view: &View, plane: &ImagePlane) {
        self.candidates.clear();
        self.chosen.clear();
        (self.triangle_count, self.point_count) = (0, 0);
        let search = Search {
            scene,
            view,
            sides: Sides::of(&view.image_camera),
            scale_squared: plane.scale.x * plane.scale.y,
            image_area: (plane.width * plane.height) as f32,
        };
        if let Some(level) = scene.tree.levels.len().checked_sub(1) {
            search.visit(level, 0, &mut self.candidates);
        }
        self.candidates.sort_unstable_by(|a, b| {
            let by_area = b.area.total_cmp(&a.area);
            by_area.then(a.instance.cmp(&b.instance))
        });
    }
}

/// The level by which an instance hides for certain: the coarsest that errs little in the image, or else the
/// finest; of at most `budget` triangles.
pub(crate) fn solid_level<'a>(
    table: &'a GroupTable,
    instance: &Instance,
    view: &View,
    plane: &ImagePlane,
    budget: u32,
) -> Option<&'a SolidLevel> {
    let sphere = &instance.node.bounds.sphere;
    let gap = (sphere.center - view.eye_in_world).length() - sphere.radius;
    if plane.texels(sphere.radius, gap) < LEAST_SOLID_RADIUS {
        return None;
    }
    let stretch = largest_stretch(&Mat3::from(instance.world_from_local.matrix3));
    let levels = table.occluders.iter().rev();
    let levels = levels.filter_map(|level| level.solid.as_ref());
    let mut levels = levels.filter(|solid| solid.triangles.len() <= budget as usize);
    let errs_little =
        |solid: &&SolidLevel| plane.texels(solid.deviation_in_local * stretch, gap) <= SOLID_ERROR;
    levels.clone().find(errs_little).or(levels.next_back())
}

impl Search<'_> {
    fn visit(&self, level: usize, index: usize, candidates: &mut Vec<Candidate>) {
        let tree = &self.scene.tree;
        let Some(node) = tree.levels[level].get(index) else {
            return;
        };
        let sphere = &node.bounds.sphere;
        if self.area(sphere, node.occluder_radius) <= 0.0 {
            return;
        }
        if level > 0 {
            let end = tree.levels[level - 1].len().min((index + 1) * FAN);
            for child in index * FAN..end {
                self.visit(level - 1, child, candidates);
            }
            return;
        }
        let end = tree.order.len().min((index + 1) * FAN);
        for &instance in &tree.order[index * FAN..end] {
            let node = &self.scene.instances[instance as usize].node;
            let area = self.area(&node.bounds.sphere, node.occluder_radius);
            if area > 0.0 {
                candidates.push(Candidate { instance, area });
            }
        }
    }

    /// About how many texels something of a radius within a sphere covers at most; 0 if it is outside the
    /// view or too small.
    fn area(&self, sphere: &Sphere, radius: f32) -> f32 {
        let from_eye = sphere.center - self.view.eye_in_world;
        let center = V3::splat(self.view.camera_from_world * from_eye);
        if self.sides.exclude(center, sphere.radius) || radius <= 0.0 {
            return 0.0;
        }
        let texels_squared = match self.view.camera {
            Camera::Perspective(_) => {
                let nearest = (from_eye.length() - sphere.radius).max(0.0) + radius;
                radius * radius * self.scale_squared / (nearest * nearest)
            }
            Camera::Orthographic(_) => radius * radius * self.scale_squared,
        };
        if texels_squared < LEAST_RADIUS * LEAST_RADIUS {
            return 0.0;
        }
        (texels_squared * std::f32::consts::PI).min(self.image_area)
    }
}
