//! Levels of the mesh as a whole, also known as discrete LODs: cuts that keep nothing finer than a level.
//!
//! A prop is drawn with one command at one level. Its levels form a hierarchy too, with one group and one
//! unit per level, so that the same selection decides for both kinds.

use glam::Vec3;

use crate::bounds::{Aabb, Sphere};
use crate::hierarchy::{Group, Hierarchy, NO_GROUP};
use crate::vertices::Vertices;

/// The whole mesh at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct WholeMeshCut {
    /// Groups below this level are not refined.
    pub group_level: u32,
    /// Triangles as indices into [`Hierarchy::vertices`].
    pub triangles: Vec<[u32; 3]>,
}

impl WholeMeshCut {
    /// A level with more than this share of the triangles of the finer level is left out.
    pub const MOST_KEPT: f32 = 0.75;
}

impl Hierarchy {
    /// The levels of the mesh as a whole, finest first, each with three quarters of the triangles of
    /// the one before at most.
    #[must_use]
    pub fn whole_mesh_cuts(&self) -> Vec<WholeMeshCut> {
        let mut kept: Vec<WholeMeshCut> = Vec::new();
        for group_level in 0..self.level_count() {
            let triangles = self.triangles_from_level(group_level);
            let most = kept
                .last()
                .map(|last| last.triangles.len() as f32 * WholeMeshCut::MOST_KEPT);
            if most.is_none_or(|most| triangles.len() as f32 <= most) {
                kept.push(WholeMeshCut {
                    group_level,
                    triangles,
                });
            }
        }
        kept
    }

    /// The levels of the whole mesh, one unit each, finest first; `None` if a level has more vertices
    /// than 16-bit indices reach.
    ///
    /// The result is a hierarchy itself, from which every cut draws exactly one unit: for props, of which one
    /// command draws all instances at a level. A level with more than three quarters of the triangles of the finer
    /// level is left out. The error of a level is [measured on pictures](Group::whole_mesh_error_in_local) if some
    /// were drawn, else it is the largest error of the groups that the level simplifies. Its deviation is the
    /// largest deviation of these groups. A hierarchy that already has this form is returned unchanged.
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
            ..Self::default()
        };
        let bounds = Sphere::around(self.vertices.positions.iter().copied());
        let levels = self.whole_mesh_cuts();
        for (index, level) in levels.iter().enumerate() {
            // The step to the next level; the coarsest level has none.
            let largest = |length: fn(&Group) -> f32| {
                let next = levels.get(index + 1);
                next.map_or(f32::INFINITY, |next| {
                    self.largest_below(next.group_level, length)
                })
            };
            let group = Group {
                bounds,
                error_in_local: largest(seen_error),
                deviation_in_local: largest(|group| group.deviation_in_local),
                mean_normal: mean_normal(&self.vertices, &level.triangles),
                ..Group::default()
            };
            whole.push_whole_mesh(&level.triangles, group)?;
        }
        Some(whole)
    }

    /// Adds the next coarser level of the whole mesh: its triangles of [`Hierarchy::vertices`], and the group
    /// that simplifies them. Returns `None` and adds nothing if the level has more vertices than 16-bit indices
    /// reach.
    pub fn push_whole_mesh(&mut self, triangles: &[[u32; 3]], group: Group) -> Option<()> {
        let finer = (self.groups.len() as u32).checked_sub(1);
        let mut used: Vec<u32> = triangles.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        let index_of = |vertex: &u32| u16::try_from(used.binary_search(vertex).ok()?).ok();
        let corners = triangles.as_flattened().iter();
        let indices: Vec<u16> = corners.map(index_of).collect::<Option<_>>()?;
        let position = |&vertex: &u32| self.vertices.positions[vertex as usize];
        let aabb = Aabb::around(used.iter().map(position)).unwrap_or_default();
        self.push_unit(finer.unwrap_or(NO_GROUP), aabb, used, indices);
        let seen = group.error_in_local;
        let group = Group {
            whole_mesh_error_in_local: if seen.is_finite() { seen } else { 0.0 },
            ..group
        };
        self.push_group(group, finer);
        Some(())
    }

    /// Whether every level is one group with one unit, with the same sphere and the error of its pictures.
    fn is_chain_of_whole_meshes(&self) -> bool {
        let Some(first) = self.groups.first() else {
            return false;
        };
        let is_level = |(index, group): (usize, &Group)| {
            let is_seen = group.whole_mesh_error_in_local == group.error_in_local;
            let is_alone = group.unit_count == 1 && group.level as usize == index;
            is_alone && group.bounds == first.bounds && (is_seen || group.is_terminal())
        };
        self.groups.iter().enumerate().all(is_level)
    }

    /// The largest length of the groups that a cut at `group_level` does not refine; 0 if there are none.
    #[must_use]
    pub fn largest_below(&self, group_level: u32, length: impl Fn(&Group) -> f32) -> f32 {
        let simplified = self.groups.iter();
        simplified
            .filter(|group| group.level < group_level && !group.is_terminal())
            .map(length)
            .fold(0.0, f32::max)
    }

    /// The triangles of the cut at a level.
    fn triangles_from_level(&self, group_level: u32) -> Vec<[u32; 3]> {
        let units = self.units_at_level(group_level).into_iter();
        units
            .flat_map(|unit| self.triangles_of(&self.units[unit]))
            .collect()
    }
}

/// The error measured on pictures if some were drawn, else the error of the group.
fn seen_error(group: &Group) -> f32 {
    match group.whole_mesh_error_in_local {
        0.0 => group.error_in_local,
        seen => seen,
    }
}

/// Area-weighted mean of the unit normals.
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
    fn whole_mesh_levels_are_a_valid_hierarchy_of_one_unit_a_level() {
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
    fn levels_shrink_and_errors_grow() {
        let whole = fixtures::grid_pyramid(3).whole_mesh_levels().unwrap();
        let counts: Vec<u32> = whole.units.iter().map(|u| u.triangle_count).collect();
        assert!(counts.len() > 2, "{counts:?}");
        for pair in counts.windows(2) {
            assert!(pair[1] * 4 <= pair[0] * 3, "{counts:?}");
        }
        assert!(whole.groups.is_sorted_by_key(|g| g.error_in_local));
    }

    #[test]
    fn refuses_levels_that_need_wider_indices() {
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
