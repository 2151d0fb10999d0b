//! Builds a hierarchy group by group.

use crate::bounds::Aabb;
use crate::hierarchy::{Group, Hierarchy, Unit};

impl Hierarchy {
    /// Adds a unit to the group that the next call of [`push_group`](Self::push_group) adds.
    ///
    /// `vertices` are indices into [`Hierarchy::vertices`], and `indices` are three indices into
    /// `vertices` for each triangle.
    pub fn push_unit(
        &mut self,
        produced_by: u32,
        aabb: Aabb,
        vertices: impl IntoIterator<Item = u32>,
        indices: impl IntoIterator<Item = u16>,
    ) {
        let first_vertex = self.unit_vertices.len() as u32;
        let first_triangle = self.triangle_count();
        self.unit_vertices.extend(vertices);
        self.indices.extend(indices);
        self.units.push(Unit {
            aabb,
            consumed_by: self.groups.len() as u32,
            produced_by,
            first_vertex,
            vertex_count: self.unit_vertices.len() as u32 - first_vertex,
            first_triangle,
            triangle_count: self.triangle_count() - first_triangle,
        });
    }

    /// Adds a group that consumes all units added since the last group. `finer` lists each group that
    /// produced one of these units once.
    ///
    /// The level and the ranges are computed; those of `group` are ignored.
    pub fn push_group(&mut self, group: Group, finer: impl IntoIterator<Item = u32>) {
        let first_finer = self.finer.len();
        self.finer.extend(finer);
        // `validate` reports links to groups that do not exist yet.
        let links = self.finer[first_finer..].iter();
        let levels = links.filter_map(|&finer| Some(self.groups.get(finer as usize)?.level + 1));
        let level = levels.max().unwrap_or(0);
        let first_unit = self.groups.last().map_or(0, |last| last.units().end) as u32;
        self.groups.push(Group {
            level,
            first_finer: first_finer as u32,
            finer_count: (self.finer.len() - first_finer) as u32,
            first_unit,
            unit_count: self.units.len() as u32 - first_unit,
            ..group
        });
    }

    /// Number of triangles of all units.
    fn triangle_count(&self) -> u32 {
        (self.indices.len() / 3) as u32
    }
}
