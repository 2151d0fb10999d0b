//! Props with seams, hard edges and an atlas: texture coordinates stay in place, and tangents create no seams.

use fieldlod_bake::{BakeConfig, SourceMesh, VerifySettings, bake_mesh, fixtures, verify};
use fieldlod_hierarchy::Hierarchy;
use glam::{UVec2, Vec2};

fn bake(mesh: &SourceMesh) -> Hierarchy {
    bake_mesh(mesh, &BakeConfig::fine_grained()).unwrap()
}

/// A machine whose hierarchy stores the source vertex of each moved vertex.
fn machine() -> SourceMesh {
    let mut machine = fixtures::machine(3);
    machine.has_other_attributes = true;
    machine
}

/// Atlas cell of the machine.
fn cell(uv: Vec2) -> UVec2 {
    (uv * 8.0).as_uvec2()
}

/// Triangles of levels that keep texture seams. Coarser ones may tear them.
fn untorn_triangles(baked: &Hierarchy) -> impl Iterator<Item = [u32; 3]> {
    let cuts = baked.whole_mesh_cuts().into_iter();
    cuts.filter(|cut| cut.triangles.len() > 500)
        .flat_map(|cut| cut.triangles)
}

#[test]
fn texture_coordinates_stay_in_their_atlas_cell() {
    let machine = machine();
    let baked = bake(&machine);
    let mut moved: Vec<u32> = untorn_triangles(&baked).flatten().collect();
    moved.retain(|&vertex| vertex >= baked.source_vertex_count);
    assert!(moved.len() > 1_000);
    for vertex in moved {
        let origin = baked.origin_of(vertex).unwrap();
        let [uv, of_origin] = [vertex, origin].map(|v| baked.vertices.uvs[v as usize]);
        assert_eq!(cell(uv), cell(of_origin), "{uv} from {of_origin}");
    }
}

#[test]
fn no_triangle_spans_two_atlas_cells() {
    let baked = bake(&machine());
    for triangle in untorn_triangles(&baked) {
        let [a, b, c] = triangle.map(|v| cell(baked.vertices.uvs[v as usize]));
        assert!(a == b && b == c, "{a} {b} {c}");
    }
}

#[test]
fn tangents_create_no_seams() {
    let mut knot = fixtures::torus_knot(96, 24);
    let without = bake(&knot);
    knot.tangents = knot
        .normals
        .iter()
        .map(|n| n.any_orthonormal_vector().extend(1.0))
        .collect();
    let with = bake(&knot);
    assert_eq!(with.vertices.positions, without.vertices.positions);
    assert_eq!(with.indices, without.indices);
    for (tangent, normal) in with.vertices.tangents.iter().zip(&with.vertices.normals) {
        assert!(tangent.truncate().dot(*normal).abs() < 1e-3);
        assert!((tangent.truncate().length() - 1.0).abs() < 1e-3);
    }
}

#[test]
fn game_props_pass_verification() {
    for mesh in [fixtures::machine(3), fixtures::kit(3)] {
        let baked = bake(&mesh);
        verify(&mesh, &baked, &VerifySettings::default()).unwrap();
    }
}
