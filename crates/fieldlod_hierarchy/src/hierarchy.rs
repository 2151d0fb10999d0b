//! The hierarchy: groups, units, and the cut rule.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::bounds::{Aabb, Sphere};
use crate::vertices::{SourceHash, Vertices};

/// Value of [`Unit::produced_by`] for source geometry.
pub const NO_GROUP: u32 = u32::MAX;

/// All levels of detail of one mesh.
///
/// # The cut rule
/// A *criterion* decides which groups are *refined*, because their simplification is too coarse for the
/// view. A group without a simplification ([`Group::is_terminal`]) is always refined. A group is also
/// refined if one of its [finer groups](Hierarchy::finer_groups) is refined. A unit is drawn if and
/// only if
///
/// 1. the group that consumes it is refined, and
/// 2. it is source geometry, or the group that produced it is not refined.
///
/// For any criterion, the drawn units cover the surface exactly once and without cracks.
/// [`Hierarchy::refine_by`] applies a criterion, and [`Hierarchy::drawn_units`] lists the units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hierarchy {
    /// Hash of the source mesh.
    pub source: SourceHash,
    /// The vertices of the source mesh in its order, followed by the *moved vertices*. Simplification
    /// creates these, and only coarser units use them.
    pub vertices: Vertices,
    /// Number of source vertices in `vertices`.
    pub source_vertex_count: u32,
    /// For each moved vertex, the source vertex that it came from. Vertex attributes that [`Vertices`]
    /// does not hold are read from there. Empty if the source has no other attributes.
    pub moved_from: Vec<u32>,
    /// The joint whose pose places the mesh for selection, as an index into the joint list of its skin. `None` for
    /// a mesh without a skin.
    ///
    /// Bounds and lengths of a skinned mesh are in its local space, and this joint moves them. With
    /// `world_from_local = joint_global * inverse_bind`, the spheres contain the mesh in all sampled poses.
    pub carrier_joint: Option<u16>,
    /// Groups. Each finer group of a group has a smaller index.
    pub groups: Vec<Group>,
    /// Group indices. The `finer` ranges of [`Group`] refer to this list.
    pub finer: Vec<u32>,
    /// Units, ordered by the group that consumes them.
    pub units: Vec<Unit>,
    /// Indices into `vertices`. The vertex ranges of [`Unit`] refer to this list.
    pub unit_vertices: Vec<u32>,
    /// Triangles of the units, three indices each. An index refers to the vertex list of its unit.
    pub indices: Vec<u16>,
}

/// Weight of V in the screen error `e √(c (4 V + 0.4 p))` of `fieldlod_select`. V is the visible share of the projection
/// factor (Lin and Lee, eq. 16), and a quarter for a surface with normals in all directions.
pub const VISIBLE_WEIGHT: f32 = 4.0;
/// Weight of p, the silhouette, in the same error: a tenth of the weight of V. At equal silhouettes, a prototype drew 0.97
/// of clusterlod's triangles with it, and 1.02 without.
pub const SILHOUETTE_WEIGHT: f32 = 0.1 * VISIBLE_WEIGHT;

/// Triangles that are simplified together. A cut refines all of them or none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Group {
    /// Sphere around the surface of the group before and after simplification, in local space.
    pub bounds: Sphere,
    /// Geometric error between the simplified surface and the surface that it replaces, in local units,
    /// as reported by the simplifier. Not smaller than the error of any finer group. Infinite for a
    /// terminal group.
    pub error_in_local: f32,
    /// Deviation from the source, in local units: the measured two-sided Hausdorff distance between the simplified
    /// surface and the *source* surface that it replaces. Not smaller than the deviation of any finer group. Infinite
    /// for a terminal group, and for all groups of an unmeasured hierarchy ([`Hierarchy::is_measured`]).
    pub deviation_in_local: f32,
    /// Error of the whole mesh at the next coarser level, in local units: measured on pictures, or the error
    /// that [`Hierarchy::push_whole_mesh`] copies. It selects the level of a mesh that is drawn as a whole. Not
    /// smaller than that of a finer group. 0 for a terminal group, and if there is no whole-mesh error.
    pub whole_mesh_error_in_local: f32,
    /// Area-weighted mean of the unit normals of the triangles. Its length is near 1 for a flat surface
    /// and near 0 for a closed surface.
    pub mean_normal: Vec3,
    /// Level of the coarsest consumed unit: 0 for source geometry, plus 1 per simplification.
    pub level: u32,
    /// First entry in [`Hierarchy::finer`].
    pub first_finer: u32,
    /// Number of entries in [`Hierarchy::finer`].
    pub finer_count: u32,
    /// First consumed unit.
    pub first_unit: u32,
    /// Number of consumed units.
    pub unit_count: u32,
}

/// The smallest drawable piece: triangles with the same producing group and the same consuming group.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Unit {
    /// Tight box around the triangles, for culling.
    pub aabb: Aabb,
    /// The group that simplifies these triangles.
    pub consumed_by: u32,
    /// The group whose simplification produced these triangles, or [`NO_GROUP`] for source geometry.
    pub produced_by: u32,
    /// First entry in [`Hierarchy::unit_vertices`].
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertex_count: u32,
    /// First triangle. Its indices start at `3 * first_triangle` in [`Hierarchy::indices`].
    pub first_triangle: u32,
    /// Number of triangles.
    pub triangle_count: u32,
}

fn range(first: u32, count: u32) -> Range<usize> {
    first as usize..(first as usize + count as usize)
}

impl Group {
    /// Returns `true` if there is no coarser level. A terminal group is refined in every cut.
    #[must_use]
    pub fn is_terminal(&self) -> bool {
        self.error_in_local == f32::INFINITY
    }

    /// Indices of the consumed units in [`Hierarchy::units`].
    #[must_use]
    pub fn units(&self) -> Range<usize> {
        range(self.first_unit, self.unit_count)
    }

    pub(crate) fn finer(&self) -> Range<usize> {
        range(self.first_finer, self.finer_count)
    }
}

impl Unit {
    /// The group that produced this unit. `None` for source geometry.
    #[must_use]
    pub fn producer(&self) -> Option<u32> {
        (self.produced_by != NO_GROUP).then_some(self.produced_by)
    }

    pub(crate) fn vertices(&self) -> Range<usize> {
        range(self.first_vertex, self.vertex_count)
    }

    pub(crate) fn triangles(&self) -> Range<usize> {
        range(self.first_triangle, self.triangle_count)
    }
}

impl Hierarchy {
    /// The source vertex that `vertex` is or came from. `None` for a moved vertex if
    /// [`Hierarchy::moved_from`] is empty.
    #[must_use]
    pub fn origin_of(&self, vertex: u32) -> Option<u32> {
        match vertex.checked_sub(self.source_vertex_count) {
            Some(moved) => self.moved_from.get(moved as usize).copied(),
            None => Some(vertex),
        }
    }

    /// Number of levels. 0 for an empty hierarchy.
    #[must_use]
    pub fn level_count(&self) -> u32 {
        self.groups.iter().map(|g| g.level + 1).max().unwrap_or(0)
    }

    /// Returns `true` if deviations were measured, or if no group is simplified. With a guaranteed
    /// deviation, selection draws unmeasured hierarchies at full detail.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        let mut groups = self.groups.iter();
        groups.clone().all(Group::is_terminal)
            || groups.any(|group| group.deviation_in_local.is_finite())
    }

    /// Number of triangles of the source mesh, including degenerate ones.
    #[must_use]
    pub fn source_triangle_count(&self) -> u64 {
        let counts = self
            .source_units()
            .map(|unit| u64::from(self.units[unit].triangle_count));
        counts.sum()
    }

    /// Number of triangles that `group` consumes.
    #[must_use]
    pub fn triangle_count_of(&self, group: &Group) -> u64 {
        let units = &self.units[group.units()];
        let counts = units.iter().map(|unit| u64::from(unit.triangle_count));
        counts.sum()
    }

    /// Area of `unit` in square local units.
    #[must_use]
    pub fn area_of_unit(&self, unit: &Unit) -> f64 {
        let corner = |vertex: u32| self.vertices.positions[vertex as usize].as_dvec3();
        let areas = self.triangles_of(unit).map(|triangle| {
            let [a, b, c] = triangle.map(corner);
            (b - a).cross(c - a).length() * 0.5
        });
        areas.sum()
    }

    /// Indices of the source units in [`Hierarchy::units`], ascending.
    pub fn source_units(&self) -> impl Iterator<Item = usize> {
        (0..self.units.len()).filter(|&unit| self.units[unit].producer().is_none())
    }

    /// Indices of the groups that produced the units of `group`. They are smaller than the index of
    /// `group`.
    #[must_use]
    pub fn finer_groups(&self, group: &Group) -> &[u32] {
        &self.finer[group.finer()]
    }

    /// Vertex list of `unit`: indices into [`Hierarchy::vertices`].
    #[must_use]
    pub fn vertices_of(&self, unit: &Unit) -> &[u32] {
        &self.unit_vertices[unit.vertices()]
    }

    /// Triangles of `unit`, three indices into [`Hierarchy::vertices_of`] each.
    #[must_use]
    pub fn indices_of(&self, unit: &Unit) -> &[u16] {
        let triangles = unit.triangles();
        &self.indices[triangles.start * 3..triangles.end * 3]
    }

    /// Triangles of `unit` as indices into [`Hierarchy::vertices`].
    pub fn triangles_of(&self, unit: &Unit) -> impl Iterator<Item = [u32; 3]> + '_ {
        let vertices = self.vertices_of(unit);
        let (triangles, _) = self.indices_of(unit).as_chunks::<3>();
        triangles
            .iter()
            .map(|triangle| triangle.map(|index| vertices[usize::from(index)]))
    }

    /// The level of `unit`. 0 for source geometry.
    #[must_use]
    pub fn level_of(&self, unit: &Unit) -> u32 {
        unit.producer()
            .map_or(0, |group| self.groups[group as usize].level + 1)
    }

    /// Bounding box of the mesh. `None` without units.
    #[must_use]
    pub fn aabb(&self) -> Option<Aabb> {
        let corners = self.units.iter().flat_map(|u| [u.aabb.min, u.aabb.max]);
        Aabb::around(corners)
    }
}
