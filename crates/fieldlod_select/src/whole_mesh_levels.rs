//! Levels of the mesh as a whole, also known as discrete LODs, out of a hierarchy of its pieces.
//!
//! A prop is drawn with one command at one level. Its levels are a hierarchy too, of one group and one
//! unit for each level, so that the same selection decides for both kinds.

use fieldlod_hierarchy::{Aabb, Cluster, Group, Hierarchy, NO_GROUP, Sphere, Unit};
use glam::Vec3;

use crate::cut::{Cut, select_with};
use crate::settings::LodSettings;

/// A level that keeps more than this share of the triangles of the one before is left out.
const MOST_KEPT: f32 = 0.75;

/// The levels of the whole mesh, one unit each, finest first; `None` if a level has more vertices
/// than 16-bit indices reach.
///
/// The result is a hierarchy itself, to be selected from like any other, which always draws exactly
/// one unit: for props, of which one command draws all instances at a level. A level with more than
/// three quarters of the triangles of the one before is left out. The step from one level to the next
/// errs as much as the worst of the groups that it simplifies.
#[must_use]
pub fn whole_mesh_levels(baked: &Hierarchy) -> Option<Hierarchy> {
    let levels = kept_levels(baked);
    let mut whole = Hierarchy {
        source: baked.source,
        vertices: baked.vertices.clone(),
        ..Hierarchy::default()
    };
    let bounds = Sphere::around(baked.vertices.positions.iter().copied());
    for (index, level) in levels.iter().enumerate() {
        let next = levels.get(index + 1);
        add_unit(&mut whole, index as u32, &level.triangles)?;
        let step = |length: fn(&Group) -> f32| {
            next.map_or(f32::INFINITY, |next| {
                largest(baked, next.group_level, length)
            })
        };
        whole.groups.push(Group {
            bounds,
            error_in_local: step(|group| group.error_in_local),
            deviation_in_local: step(|group| group.deviation_in_local),
            normal_error: next.map_or(0.0, |n| largest(baked, n.group_level, |g| g.normal_error)),
            uv_error: next.map_or(0.0, |n| largest(baked, n.group_level, |g| g.uv_error)),
            mean_normal: mean_normal(baked, &level.triangles),
            level: index as u32,
            first_finer: whole.finer.len() as u32,
            finer_count: u32::from(index > 0),
            first_unit: index as u32,
            unit_count: 1,
        });
        if index > 0 {
            whole.finer.push(index as u32 - 1);
        }
    }
    Some(whole)
}

struct Level {
    /// Groups below this level are refined no more.
    group_level: u32,
    triangles: Vec<[u32; 3]>,
}

fn kept_levels(baked: &Hierarchy) -> Vec<Level> {
    let mut kept: Vec<Level> = Vec::new();
    for group_level in 0..baked.level_count() {
        let triangles = triangles_from_level(baked, group_level);
        let most = |last: &Level| last.triangles.len() as f32 * MOST_KEPT;
        if kept
            .last()
            .is_none_or(|last| triangles.len() as f32 <= most(last))
        {
            kept.push(Level {
                group_level,
                triangles,
            });
        }
    }
    kept
}

/// The cut that keeps nothing finer than `group_level`, unless there is nothing coarser.
fn triangles_from_level(baked: &Hierarchy, group_level: u32) -> Vec<[u32; 3]> {
    let mut cut = Cut::default();
    select_with(baked, &LodSettings::default(), &mut cut, |group| {
        if baked.groups[group].level >= group_level {
            f32::INFINITY
        } else {
            0.0
        }
    });
    let units = cut.units().iter();
    units
        .flat_map(|&unit| baked.source_triangles_of(&baked.units[unit as usize]))
        .collect()
}

/// The largest of the groups whose simplification is drawn from `group_level` on.
fn largest(baked: &Hierarchy, group_level: u32, length: fn(&Group) -> f32) -> f32 {
    let simplified = baked.groups.iter();
    simplified
        .filter(|group| group.level < group_level && !group.is_terminal())
        .map(length)
        .fold(0.0, f32::max)
}

/// Area-weighted mean of the unit normals.
fn mean_normal(baked: &Hierarchy, triangles: &[[u32; 3]]) -> Vec3 {
    let corner = |vertex: u32| baked.vertices.positions[vertex as usize];
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

/// Appends one unit of one cluster with `triangles` of source vertices.
fn add_unit(whole: &mut Hierarchy, index: u32, triangles: &[[u32; 3]]) -> Option<()> {
    let first_vertex = whole.unit_vertices.len();
    let first_triangle = whole.indices.len() / 3;
    let mut used: Vec<u32> = triangles.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    for vertex in triangles.as_flattened() {
        let place = used.binary_search(vertex).ok()?;
        whole.indices.push(u16::try_from(place).ok()?);
    }
    let positions = used
        .iter()
        .map(|&vertex| whole.vertices.positions[vertex as usize]);
    let bounds = Sphere::around(positions.clone());
    let aabb = Aabb::around(positions).unwrap_or_default();
    let triangle_count = triangles.len() as u32;
    whole.units.push(Unit {
        aabb,
        consumed_by: index,
        produced_by: index.checked_sub(1).unwrap_or(NO_GROUP),
        first_vertex: first_vertex as u32,
        vertex_count: used.len() as u32,
        first_triangle: first_triangle as u32,
        triangle_count,
        first_cluster: index,
        cluster_count: 1,
    });
    whole.clusters.push(Cluster {
        bounds,
        first_triangle: first_triangle as u32,
        triangle_count,
    });
    whole.unit_vertices.extend(used);
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldlod_hierarchy::fixtures;

    #[test]
    fn whole_mesh_levels_are_a_valid_hierarchy_of_one_unit_a_level() {
        for levels in 1..4 {
            let baked = fixtures::grid_pyramid(levels);
            let whole = whole_mesh_levels(&baked).unwrap();
            assert_eq!(whole.validate(), Ok(()));
            assert_eq!(whole.units.len(), whole.groups.len());
            assert_eq!(whole.source_triangle_count(), baked.source_triangle_count());
        }
    }

    #[test]
    fn levels_shrink_and_errors_grow() {
        let whole = whole_mesh_levels(&fixtures::grid_pyramid(3)).unwrap();
        let counts: Vec<u32> = whole.units.iter().map(|u| u.triangle_count).collect();
        assert!(counts.len() > 2, "{counts:?}");
        for pair in counts.windows(2) {
            assert!(pair[1] as f32 <= pair[0] as f32 * MOST_KEPT, "{counts:?}");
        }
        assert!(whole.groups.is_sorted_by_key(|g| g.error_in_local));
    }

    #[test]
    fn refuses_levels_that_need_wider_indices() {
        let mut baked = fixtures::two_level_strip();
        let far = 70_000u32;
        baked.vertices.positions = (0..=far).map(|i| Vec3::splat(i as f32)).collect();
        baked.unit_vertices = (0..=far).collect();
        // One unit of the strip's source that uses them all cannot be indexed by 16 bits; the
        // level would have to.
        let triangles: Vec<[u32; 3]> = (0..far - 1).map(|i| [i, i + 1, i + 2]).collect();
        assert!(add_unit(&mut baked, 0, &triangles).is_none());
    }
}
