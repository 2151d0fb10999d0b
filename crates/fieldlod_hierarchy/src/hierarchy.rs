//! The hierarchy itself: groups, drawable units, and the rule that makes a cut.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::bounds::{Aabb, Sphere};
use crate::vertices::{SourceHash, Vertices};

/// Marks "no group" in [`Unit::produced_by`]: the unit is source geometry.
pub const NO_GROUP: u32 = u32::MAX;

/// One mesh at all its levels of detail.
///
/// # The cut rule
/// Let a *criterion* decide for every group whether it is *refined* (its simplification is too coarse
/// for the view). A group without a simplification ([`Group::is_terminal`]) is always refined, and
/// a group is refined whenever one of its [finer groups](Hierarchy::finer_groups) is. Then a unit
/// is drawn if and only if
///
/// 1. the group that consumes it is refined, and
/// 2. it is source geometry, or the group that produced it is not refined.
///
/// The units so drawn cover the surface exactly once, without cracks, whatever the criterion.
/// [`Hierarchy::refine_by`] refines by a criterion, and [`Hierarchy::drawn_units`] lists the units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hierarchy {
    /// The mesh that this was baked from.
    pub source: SourceHash,
    /// The vertices of the source mesh in its order, and behind them those that simplification
    /// made, which only coarser units use: the moved vertices.
    pub vertices: Vertices,
    /// How many of `vertices` are the source mesh's.
    pub source_vertex_count: u32,
    /// For each moved vertex, the source vertex that it came from: vertex attributes that
    /// [`Vertices`] does not hold are taken from there. Empty if the source has no others.
    pub moved_from: Vec<u32>,
    /// Groups, finer before coarser: every finer group of a group has a smaller index.
    pub groups: Vec<Group>,
    /// The lists that [`Group`]'s `finer` ranges point into: group indices.
    pub finer: Vec<u32>,
    /// Drawable units, ordered by the group that consumes them.
    pub units: Vec<Unit>,
    /// The lists that [`Unit`]'s vertex ranges point into: indices into `vertices`.
    pub unit_vertices: Vec<u32>,
    /// Triangle lists of the units, three entries a triangle, each an index into the unit's own
    /// list of vertices.
    pub indices: Vec<u16>,
}

/// Triangles that are simplified together: one decision of a cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Group {
    /// Sphere around the group's surface before and after its simplification, in local space.
    pub bounds: Sphere,
    /// Geometric error of the simplified surface against the one that it replaces, in local units,
    /// as the simplifier reports it. Never less than that of any finer group, and infinite for a
    /// terminal group.
    pub error_in_local: f32,
    /// Deviation from the source: the two-sided Hausdorff distance between the simplified surface
    /// and the *source* surface under the group, in local units, as measured. Never less than that
    /// of any finer group, and infinite for a terminal group. Infinite for all groups of a
    /// hierarchy that was not measured ([`Hierarchy::is_measured`]).
    pub deviation_in_local: f32,
    /// Error of the whole mesh drawn at the level that this group is simplified to, in local units, as
    /// pictures of it look: a mesh drawn as a whole is chosen by it. Never less than that of a finer
    /// level; 0 for a terminal group, and for all groups of a hierarchy of which no pictures were drawn.
    pub whole_mesh_error_in_local: f32,
    /// Area-weighted mean of the unit normals of the group's triangles, |m| ≤ 1: near 1 for a flat
    /// piece, near 0 for a closed one.
    pub mean_normal: Vec3,
    /// Level of detail that the group consumes: 0 for source geometry, one more at each
    /// simplification.
    pub level: u32,
    /// First entry of this group in [`Hierarchy::finer`].
    pub first_finer: u32,
    /// Number of its entries there.
    pub finer_count: u32,
    /// First unit that this group consumes.
    pub first_unit: u32,
    /// Number of units that it consumes.
    pub unit_count: u32,
}

/// The smallest drawable piece: triangles that share the group that produced them and the group that
/// consumes them.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Unit {
    /// Tight box around the unit's triangles, for culling.
    pub aabb: Aabb,
    /// The group that simplifies these triangles into coarser ones.
    pub consumed_by: u32,
    /// The group whose simplification these triangles are, or [`NO_GROUP`] for source geometry.
    pub produced_by: u32,
    /// First entry of this unit in [`Hierarchy::unit_vertices`].
    pub first_vertex: u32,
    /// Number of its vertices.
    pub vertex_count: u32,
    /// First triangle of this unit; its indices start at three times this in
    /// [`Hierarchy::indices`].
    pub first_triangle: u32,
    /// Number of its triangles.
    pub triangle_count: u32,
}

fn range(first: u32, count: u32) -> Range<usize> {
    first as usize..(first as usize + count as usize)
}

impl Group {
    /// Whether nothing coarser exists: such a group is refined in every cut.
    #[must_use]
    pub fn is_terminal(&self) -> bool {
        self.error_in_local == f32::INFINITY
    }

    /// The units that this group consumes, as indices into [`Hierarchy::units`].
    #[must_use]
    pub fn units(&self) -> Range<usize> {
        range(self.first_unit, self.unit_count)
    }

    pub(crate) fn finer(&self) -> Range<usize> {
        range(self.first_finer, self.finer_count)
    }
}

impl Unit {
    /// The group whose simplification this unit is; `None` for source geometry.
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
    /// The source vertex that `vertex` is or came from; `None` for a moved vertex if [`Hierarchy::moved_from`] is empty.
    #[must_use]
    pub fn origin_of(&self, vertex: u32) -> Option<u32> {
        match vertex.checked_sub(self.source_vertex_count) {
            Some(moved) => self.moved_from.get(moved as usize).copied(),
            None => Some(vertex),
        }
    }

    /// How many levels there are; 0 for a hierarchy of nothing.
    #[must_use]
    pub fn level_count(&self) -> u32 {
        self.groups.iter().map(|g| g.level + 1).max().unwrap_or(0)
    }

    /// Whether deviations were measured; there is nothing to measure where nothing is simplified. A
    /// guarantee asked of a hierarchy that was not measured draws all detail.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        let mut simplified = self.groups.iter().filter(|group| !group.is_terminal());
        let first = simplified.next();
        first.is_none_or(|first| {
            let mut all = std::iter::once(first).chain(simplified);
            all.any(|group| group.deviation_in_local.is_finite())
        })
    }

    /// Triangles of the source mesh (degenerate ones included).
    #[must_use]
    pub fn source_triangle_count(&self) -> u64 {
        let counts = self
            .source_units()
            .map(|unit| u64::from(self.units[unit].triangle_count));
        counts.sum()
    }

    /// How many triangles `group` consumes.
    #[must_use]
    pub fn triangle_count_of(&self, group: &Group) -> u64 {
        let units = &self.units[group.units()];
        let counts = units.iter().map(|unit| u64::from(unit.triangle_count));
        counts.sum()
    }

    /// The area of the triangles of `unit`, in local units squared.
    #[must_use]
    pub fn area_of_unit(&self, unit: &Unit) -> f64 {
        let corner = |vertex: u32| self.vertices.positions[vertex as usize].as_dvec3();
        let areas = self.triangles_of(unit).map(|triangle| {
            let [a, b, c] = triangle.map(corner);
            (b - a).cross(c - a).length() * 0.5
        });
        areas.sum()
    }

    /// The units of source geometry: as indices into [`Hierarchy::units`], ascending.
    pub fn source_units(&self) -> impl Iterator<Item = usize> {
        (0..self.units.len()).filter(|&unit| self.units[unit].producer().is_none())
    }

    /// The groups whose simplification `group` consumes: as indices into `groups`, each smaller
    /// than the index of `group`.
    #[must_use]
    pub fn finer_groups(&self, group: &Group) -> &[u32] {
        &self.finer[group.finer()]
    }

    /// The vertices that `unit` uses: indices into [`Hierarchy::vertices`].
    #[must_use]
    pub fn vertices_of(&self, unit: &Unit) -> &[u32] {
        &self.unit_vertices[unit.vertices()]
    }

    /// The triangle list of `unit`: three entries a triangle, indices into
    /// [`Hierarchy::vertices_of`].
    #[must_use]
    pub fn indices_of(&self, unit: &Unit) -> &[u16] {
        let triangles = unit.triangles();
        &self.indices[triangles.start * 3..triangles.end * 3]
    }

    /// The triangles of `unit` as indices into [`Hierarchy::vertices`].
    pub fn triangles_of(&self, unit: &Unit) -> impl Iterator<Item = [u32; 3]> + '_ {
        let vertices = self.vertices_of(unit);
        let (triangles, _) = self.indices_of(unit).as_chunks::<3>();
        triangles
            .iter()
            .map(|triangle| triangle.map(|index| vertices[usize::from(index)]))
    }

    /// The level at which `unit` stands: 0 for source geometry.
    #[must_use]
    pub fn level_of(&self, unit: &Unit) -> u32 {
        unit.producer()
            .map_or(0, |group| self.groups[group as usize].level + 1)
    }

    /// The box around the whole mesh; `None` without any unit.
    #[must_use]
    pub fn aabb(&self) -> Option<Aabb> {
        let corners = self.units.iter().flat_map(|u| [u.aabb.min, u.aabb.max]);
        Aabb::around(corners)
    }
}
