//! Levels of the mesh as a whole, also known as discrete LODs, out of a hierarchy of its pieces.
//!
//! A prop is drawn with one command at one level. Its levels are a hierarchy too, of one group and one
//! unit for each level, so that the same selection decides for both kinds.

use fieldlod_hierarchy::{Aabb, Group, Hierarchy, NO_GROUP, Sphere};
use glam::Vec3;

/// The levels of the whole mesh, one unit each, finest first; `None` if a level has more vertices
/// than 16-bit indices reach.
///
/// The result is a hierarchy itself, to be selected from like any other, which always draws exactly
/// one unit: for props, of which one command draws all instances at a level. A level with more than
/// three quarters of the triangles of the one before is left out. A level errs as much as
/// [pictures of it](Group::whole_mesh_error_in_local) look, and without pictures as the worst of the
/// groups that it simplifies; its deviation is that of the worst in any case.
#[must_use]
pub fn whole_mesh_levels(baked: &Hierarchy) -> Option<Hierarchy> {
    let levels = baked.whole_mesh_cuts();
    // One unit and one group for each level that is kept.
    let mut whole = Hierarchy {
        source: baked.source,
        vertices: baked.vertices.clone(),
        source_vertex_count: baked.source_vertex_count,
        moved_from: baked.moved_from.clone(),
        ..Hierarchy::default()
    };
    let bounds = Sphere::around(baked.vertices.positions.iter().copied());
    for (index, level) in (0u32..).zip(&levels) {
        let finer = index.checked_sub(1);
        push_unit(&mut whole, finer.unwrap_or(NO_GROUP), &level.triangles)?;
        // The coarsest level has no step to a next one.
        let next = levels.get(index as usize + 1);
        let step = |error: fn(&Group) -> f32| {
            next.map_or(f32::INFINITY, |next| {
                baked.largest_below(next.group_level, error)
            })
        };
        let group = Group {
            bounds,
            error_in_local: step(seen_error),
            deviation_in_local: step(|group| group.deviation_in_local),
            mean_normal: mean_normal(baked, &level.triangles),
            ..Group::default()
        };
        whole.push_group(group, finer);
    }
    Some(whole)
}

/// What the step to a level errs by: as pictures of it look, if some were drawn.
fn seen_error(group: &Group) -> f32 {
    match group.whole_mesh_error_in_local {
        0.0 => group.error_in_local,
        seen => seen,
    }
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

/// Appends one unit with `triangles` of vertices.
fn push_unit(whole: &mut Hierarchy, produced_by: u32, triangles: &[[u32; 3]]) -> Option<()> {
    // The vertices that are used, and where in that list each corner is.
    let mut used: Vec<u32> = triangles.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    let index_of = |vertex: &u32| u16::try_from(used.binary_search(vertex).ok()?).ok();
    let corners = triangles.as_flattened().iter();
    let indices: Vec<u16> = corners.map(index_of).collect::<Option<_>>()?;
    let position = |&vertex: &u32| whole.vertices.positions[vertex as usize];
    let aabb = Aabb::around(used.iter().map(position)).unwrap_or_default();
    whole.push_unit(produced_by, aabb, used, indices);
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
        // One unit of the strip's source that uses them all cannot be indexed by 16 bits; the
        // level would have to.
        let triangles: Vec<[u32; 3]> = (0..far - 1).map(|i| [i, i + 1, i + 2]).collect();
        assert!(push_unit(&mut baked, NO_GROUP, &triangles).is_none());
    }
}
