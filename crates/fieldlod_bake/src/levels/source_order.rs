//! Levels of blended meshes, whose triangles are drawn in the order of the source.

use fieldlod_hierarchy::Hierarchy;
use rustc_hash::FxHashMap;

use crate::mesh::SourceMesh;
use crate::mesh::two_sided::least_first;

/// Levels of the whole mesh, with triangles in the order of the source. Units have no common order, so the hierarchy is
/// returned as it is if a level has more vertices than 16-bit indices allow. `origin` has the source vertex of each
/// vertex.
pub(crate) fn in_source_order(
    hierarchy: Hierarchy,
    mesh: &SourceMesh,
    origin: &[u32],
) -> Hierarchy {
    let Some(whole) = hierarchy.whole_mesh_levels() else {
        return hierarchy;
    };
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    let numbered = || (0u32..).zip(triangles);
    let of_source: FxHashMap<[u32; 3], u32> =
        numbered().map(|(n, t)| (least_first(*t), n)).collect();
    // The first triangle of each vertex. Layers that are drawn one after the other have vertices of their own.
    let mut first = vec![u32::MAX; mesh.positions.len()];
    for (number, &vertex) in numbered().flat_map(|(n, t)| t.iter().map(move |v| (n, v))) {
        first[vertex as usize] = first[vertex as usize].min(number);
    }
    let place = |triangle: &[u32; 3]| {
        let corners = triangle.map(|vertex| first[origin[vertex as usize] as usize]);
        let last = corners.into_iter().max().unwrap_or(0);
        of_source
            .get(&least_first(*triangle))
            .copied()
            .unwrap_or(last)
    };
    let mut ordered = Hierarchy {
        groups: Vec::new(),
        finer: Vec::new(),
        units: Vec::new(),
        unit_vertices: Vec::new(),
        indices: Vec::new(),
        ..whole.clone()
    };
    for (unit, group) in whole.units.iter().zip(&whole.groups) {
        let mut triangles: Vec<[u32; 3]> = whole.triangles_of(unit).collect();
        triangles.sort_by_key(place);
        // Its vertices did fit before.
        let _ = ordered.push_whole_mesh(&triangles, *group);
    }
    ordered
}
