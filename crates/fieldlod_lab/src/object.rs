//! A hierarchy with the data that other systems bake: nested bounds, errors of whole levels, tuned ranges.

use fieldlod_hierarchy::{Aabb, Group, Hierarchy, Sphere};
use glam::{Vec3, Vec3Swizzles};
use serde::Serialize;

/// Height of the reference view, in pixels.
pub(crate) const REFERENCE_HEIGHT_PX: f32 = 1080.0;
/// Focal length of the reference view, which is 60° and 1080 px high: 540 px / tan 30°.
pub const REFERENCE_FOCAL_PX: f32 = 935.307_4;

/// The error of a group that the baselines use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorSource {
    /// The deviation measured at bake, an upper bound.
    #[default]
    Measured,
    /// The error that the simplifier reports, as other systems use it.
    Reported,
}

/// A hierarchy with the inputs of all methods.
#[derive(Clone, Debug)]
pub struct LodObject {
    /// The hierarchy itself.
    pub hierarchy: Hierarchy,
    /// Error of each group in local units; infinite for terminal groups.
    pub errors_in_local: Vec<f32>,
    /// For each group, a sphere around its own bounds and the nested bounds of all finer groups.
    pub nested_bounds: Vec<Sphere>,
    /// Error of each level of the whole object, in local units; 0 for level 0.
    pub level_errors_in_local: Vec<f32>,
    /// Box around the source.
    pub aabb: Aabb,
    /// Center of the box.
    pub center: Vec3,
    /// Radius around `center` that holds every vertex of the source.
    pub radius: f32,
}

impl LodObject {
    /// Prepares a hierarchy.
    #[must_use]
    pub fn new(hierarchy: Hierarchy, source: ErrorSource) -> Self {
        let error = |group: &Group| match source {
            ErrorSource::Measured => group.deviation_in_local,
            ErrorSource::Reported => group.error_in_local,
        };
        let errors_in_local: Vec<f32> = hierarchy.groups.iter().map(error).collect();
        // The center of the source's box is the same for all hierarchies of a mesh.
        let source_units = hierarchy.source_units();
        let boxes = source_units.map(|unit| &hierarchy.units[unit].aabb);
        let corners = boxes.flat_map(|aabb| [aabb.min, aabb.max]);
        let aabb = Aabb::around(corners).unwrap_or_default();
        let center = (aabb.min + aabb.max) * 0.5;
        let positions = source_positions(&hierarchy).iter();
        Self {
            nested_bounds: nested_bounds(&hierarchy),
            level_errors_in_local: level_errors(&hierarchy, &errors_in_local),
            errors_in_local,
            aabb,
            center,
            radius: positions.map(|p| p.distance(center)).fold(0.0, f32::max),
            hierarchy,
        }
    }

    /// The number of levels, including the source.
    #[must_use]
    pub fn level_count(&self) -> u32 {
        self.level_errors_in_local.len() as u32
    }

    /// The distance to the object's center at which a hand-tuned range of `level` starts. At the near side of the
    /// object's sphere, the error of the level is then `threshold_px` in the reference view, at unit scale.
    #[must_use]
    pub fn range_start(&self, level: u32, threshold_px: f32) -> f32 {
        if level == 0 {
            return 0.0;
        }
        let error = self.level_errors_in_local[level as usize];
        error * REFERENCE_FOCAL_PX / threshold_px + self.radius
    }

    /// The units of the source.
    #[must_use]
    pub fn source_units(&self) -> Vec<u32> {
        let units = self.hierarchy.source_units();
        units.map(|unit| unit as u32).collect()
    }

    /// Triangles of some units.
    #[must_use]
    pub fn triangle_count(&self, units: &[u32]) -> u64 {
        let all = &self.hierarchy.units;
        let triangles = units.iter().map(|&unit| all[unit as usize].triangle_count);
        triangles.map(u64::from).sum()
    }

    /// Triangles of the coarsest cut.
    #[must_use]
    pub fn coarsest_triangle_count(&self) -> u64 {
        let groups = self.hierarchy.groups.iter();
        let terminal = groups.filter(|group| group.is_terminal());
        let counts = terminal.map(|group| self.hierarchy.triangle_count_of(group));
        counts.sum()
    }

    /// The vertex nearest to a vertical line through the box. `x` and `z` place the line, from 0 to 1 across the box.
    #[must_use]
    pub fn vertex_below(&self, x: f32, z: f32) -> Vec3 {
        let at = (self.aabb.min + (self.aabb.max - self.aabb.min) * Vec3::new(x, 0.0, z)).xz();
        let positions = source_positions(&self.hierarchy).iter();
        let across = |p: &Vec3| p.xz().distance_squared(at);
        let nearest = positions.min_by(|a, b| across(a).total_cmp(&across(b)));
        nearest.copied().unwrap_or_default()
    }
}

/// The positions of the source's vertices, which come first in a hierarchy.
fn source_positions(hierarchy: &Hierarchy) -> &[Vec3] {
    &hierarchy.vertices.positions[..hierarchy.source_vertex_count as usize]
}

/// Merges spheres from fine to coarse, as clusterlod does. Finer groups come first in a hierarchy.
fn nested_bounds(hierarchy: &Hierarchy) -> Vec<Sphere> {
    let mut nested: Vec<Sphere> = Vec::with_capacity(hierarchy.groups.len());
    for group in &hierarchy.groups {
        let finer = hierarchy.finer_groups(group).iter();
        let merged = finer.map(|&finer| nested[finer as usize]);
        nested.push(merged.fold(group.bounds, merge));
    }
    nested
}

/// The smallest sphere around two.
fn merge(a: Sphere, b: Sphere) -> Sphere {
    let between = b.center - a.center;
    let distance = between.length();
    // One sphere may contain the other.
    if distance + b.radius <= a.radius {
        return a;
    }
    if distance + a.radius <= b.radius {
        return b;
    }
    let radius = 0.5 * (distance + a.radius + b.radius);
    Sphere {
        center: a.center + between * ((radius - a.radius) / distance),
        radius,
    }
}

/// A level simplifies all finer groups, so its error is the largest error of these groups.
fn level_errors(hierarchy: &Hierarchy, errors_in_local: &[f32]) -> Vec<f32> {
    // Simplifying a group of level n makes units of level n + 1.
    let mut of_level = vec![0.0f32; hierarchy.level_count() as usize];
    for (group, &error) in hierarchy.groups.iter().zip(errors_in_local) {
        if !group.is_terminal() {
            let coarser = &mut of_level[group.level as usize + 1];
            *coarser = coarser.max(error);
        }
    }
    // The error of a level includes the errors of all finer levels.
    let mut greatest = 0.0f32;
    for error in &mut of_level {
        greatest = greatest.max(*error);
        *error = greatest;
    }
    of_level
}
