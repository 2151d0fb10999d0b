//! Levels of the whole mesh, also known as discrete LODs.
//!
//! A prop is drawn with one draw call at one level. Its levels also form a hierarchy with one group and one unit per
//! level, so both kinds of meshes use the same selection.

use glam::Vec3;

use crate::bounds::{Aabb, Sphere};
use crate::hierarchy::{Group, Hierarchy, NO_GROUP};
use crate::vertices::Vertices;

/// A level with more than this share of the triangles of the finer level is skipped. A larger share keeps levels that
/// save little but cost memory; a smaller one makes changes of level more visible.
const MOST_KEPT: f32 = 0.75;

/// Meshes with at least this many triangles are drawn in units by default, smaller ones as whole meshes. At 20,480
/// triangles, units draw 5 % fewer triangles than whole meshes, with 2.5 times the entities (`tests/benches/RECORD.md`,
/// "frame, kinds").
pub const CLUSTERS_FROM_TRIANGLES: u32 = 20_000;

/// The whole mesh at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct WholeMeshCut {
    /// The cut refines only groups of this level and coarser levels.
    pub group_level: u32,
    /// Triangles as indices into [`Hierarchy::vertices`].
    pub triangles: Vec<[u32; 3]>,
}

impl Hierarchy {
    /// The levels of the whole mesh, finest first. Each level has at most three quarters of the triangles
    /// of the previous level.
    #[must_use]
    pub fn whole_mesh_cuts(&self) -> Vec<WholeMeshCut> {
        let mut kept: Vec<WholeMeshCut> = Vec::new();
        for group_level in 0..self.level_count() {
            let triangles = self.triangles_from_level(group_level);
            let count = triangles.len() as f32;
            let finer = kept.last();
            if finer.is_none_or(|finer| count <= finer.triangles.len() as f32 * MOST_KEPT) {
                kept.push(WholeMeshCut {
                    group_level,
                    triangles,
                });
            }
        }
        kept
    }

    /// Converts the hierarchy to one unit per level of the whole mesh, finest first. `None` if a level has more
    /// vertices than 16-bit indices allow.
    ///
    /// Each cut of the result draws exactly one unit, so one draw call can draw all instances of a prop at one level. A
    /// level with more than three quarters of the triangles of the finer level is skipped.
    ///
    /// The error of a level is [measured on pictures](Group::whole_mesh_error_in_local), or else the largest error of
    /// the groups that the level simplifies. Its deviation is the largest deviation of these groups. A hierarchy that
    /// already has this form is returned unchanged.
    #[must_use]
    pub fn whole_mesh_levels(&self) -> Option<Self> {
        if self.is_chain_of_whole_meshes() {
            return Some(self.clone());
        }
        let mut whole = Self {
            source: self.source,
            vertices: self.vertices.clone(),
            source_vertex_count: self.source_vertex_count,
            moved_from: self.moved_from.clone(),
            carrier_joint: self.carrier_joint,
            ..Self::default()
        };
        let bounds = Sphere::around(self.vertices.positions.iter().copied());
        let levels = self.whole_mesh_cuts();
        for (index, level) in levels.iter().enumerate() {
            // The coarsest level has no simplification, so its error and deviation are infinite.
            let largest = |length: fn(&Group) -> f32| {
                let next = levels.get(index + 1);
                next.map_or(f32::INFINITY, |next| {
                    self.largest_below(next.group_level, length)
                })
            };
            let group = Group {
                bounds,
                error_in_local: largest(Group::error_of_step),
                deviation_in_local: largest(|group| group.deviation_in_local),
                mean_normal: mean_normal(&self.vertices, &level.triangles),
                ..Group::default()
            };
            whole.push_whole_mesh(&level.triangles, group)?;
        }
        Some(whole)
    }

    /// Adds the next coarser level of the whole mesh. `triangles` are indices into
    /// [`Hierarchy::vertices`], and `group` simplifies them.
    ///
    /// Returns `None` and adds nothing if the level has more vertices than 16-bit indices allow.
    pub fn push_whole_mesh(&mut self, triangles: &[[u32; 3]], group: Group) -> Option<()> {
        let finer = (self.groups.len() as u32).checked_sub(1);
        // Sorted, so that neighbours in memory stay neighbours, and a search finds the index of a vertex.
        let mut used: Vec<u32> = triangles.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        let index_of = |vertex: &u32| u16::try_from(used.binary_search(vertex).ok()?).ok();
        let corners = triangles.as_flattened().iter();
        let indices: Vec<u16> = corners.map(index_of).collect::<Option<_>>()?;
        let position = |&vertex: &u32| self.vertices.positions[vertex as usize];
        let aabb = Aabb::around(used.iter().map(position)).unwrap_or_default();
        self.push_unit(finer.unwrap_or(NO_GROUP), aabb, used, indices);
        // The group is the whole mesh, so its error is the whole-mesh error. Terminal groups have 0, because a
        // whole-mesh error must be finite.
        let error = group.error_in_local;
        let group = Group {
            whole_mesh_error_in_local: if error.is_finite() { error } else { 0.0 },
            ..group
        };
        self.push_group(group, finer);
        Some(())
    }

    /// Returns `true` if each level is one group with one unit, all spheres are equal, and the error of each group that
    /// is not terminal is its whole-mesh error.
    #[must_use]
    pub fn is_chain_of_whole_meshes(&self) -> bool {
        let Some(first) = self.groups.first() else {
            return false;
        };
        let is_level = |(index, group): (usize, &Group)| {
            let has_error = group.whole_mesh_error_in_local == group.error_in_local;
            let is_alone = group.unit_count == 1 && group.level as usize == index;
            is_alone && group.bounds == first.bounds && (has_error || group.is_terminal())
        };
        self.groups.iter().enumerate().all(is_level)
    }

    /// Largest value of `length` over the groups that a cut at `group_level` does not refine. 0 without such groups.
    #[must_use]
    pub fn largest_below(&self, group_level: u32, length: impl Fn(&Group) -> f32) -> f32 {
        let simplified = self.groups.iter();
        simplified
            .filter(|group| group.level < group_level && !group.is_terminal())
            .map(length)
            .fold(0.0, f32::max)
    }

    /// Triangles of the cut at a level.
    fn triangles_from_level(&self, group_level: u32) -> Vec<[u32; 3]> {
        let units = self.units_at_level(group_level).into_iter();
        units
            .flat_map(|unit| self.triangles_of(&self.units[unit]))
            .collect()
    }
}

impl Group {
    /// The whole-mesh error if it was measured on pictures, otherwise the error of the group.
    #[must_use]
    pub fn error_of_step(&self) -> f32 {
        match self.whole_mesh_error_in_local {
            0.0 => self.error_in_local,
            measured => measured,
        }
    }
}

/// Area-weighted mean of the unit normals of triangles.
fn mean_normal(vertices: &Vertices, triangles: &[[u32; 3]]) -> Vec3 {
    let corner = |vertex: u32| vertices.positions[vertex as usize];
    let crosses = triangles.iter().map(|&[a, b, c]| {
        let (a, b, c) = (corner(a), corner(b), corner(c));
        (b - a).cross(c - a)
    });
    let (sum, area) = crosses.fold((Vec3::ZERO, 0.0f32), |(sum, area), cross| {
        (sum + cross, area + cross.length())
    });
    if area > 0.0 {
        (sum / area).clamp_length_max(1.0)
    } else {
        Vec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;

    #[test]
    fn whole_mesh_levels_are_a_valid_hierarchy() {
        for levels in 1..4 {
            let baked = fixtures::grid_pyramid(levels);
            let whole = baked.whole_mesh_levels().unwrap();
            assert_eq!(whole.validate(), Ok(()));
            assert_eq!(whole.units.len(), whole.groups.len());
            assert_eq!(whole.source_triangle_count(), baked.source_triangle_count());
            assert_eq!(whole.whole_mesh_levels().as_ref(), Some(&whole));
        }
    }

    #[test]
    fn coarser_levels_shrink_and_errors_grow() {
        let whole = fixtures::grid_pyramid(3).whole_mesh_levels().unwrap();
        let counts: Vec<u32> = whole.units.iter().map(|u| u.triangle_count).collect();
        assert!(counts.len() > 2, "{counts:?}");
        for pair in counts.windows(2) {
            assert!(pair[1] * 4 <= pair[0] * 3, "{counts:?}");
        }
        assert!(whole.groups.is_sorted_by_key(|g| g.error_in_local));
    }

    #[test]
    fn rejects_levels_that_need_wider_indices() {
        let mut baked = fixtures::two_level_strip();
        let far = 70_000u32;
        baked.vertices.positions = (0..=far).map(|i| Vec3::splat(i as f32)).collect();
        baked.unit_vertices = (0..=far).collect();
        let triangles: Vec<[u32; 3]> = (0..far - 1).map(|i| [i, i + 1, i + 2]).collect();
        assert!(
            baked
                .push_whole_mesh(&triangles, Group::default())
                .is_none()
        );
    }
}
