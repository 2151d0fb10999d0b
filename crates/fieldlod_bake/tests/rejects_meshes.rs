//! One test for each fault of a mesh or a setting.

use fieldlod_bake::{BakeConfig, MeshError, SourceMesh, bake_mesh, fixtures};
use glam::{Vec2, Vec3};

fn fault_of(mesh: &SourceMesh) -> MeshError {
    bake_mesh(mesh, &BakeConfig::default()).unwrap_err()
}

#[test]
fn rejects_a_mesh_without_triangles() {
    assert_eq!(fault_of(&SourceMesh::default()), MeshError::NoTriangles);
}

#[test]
fn rejects_a_partial_triangle() {
    let mut mesh = fixtures::plane(2);
    mesh.indices.pop();
    assert_eq!(fault_of(&mesh), MeshError::PartialTriangle { count: 23 });
}

#[test]
fn rejects_an_index_out_of_range() {
    let mut mesh = fixtures::plane(2);
    mesh.indices[4] = 9;
    let fault = MeshError::IndexOutOfRange {
        position: 4,
        index: 9,
        vertices: 9,
    };
    assert_eq!(fault_of(&mesh), fault);
}

#[test]
fn rejects_invalid_positions() {
    for x in [f32::NAN, f32::INFINITY, -2e18] {
        let mut mesh = fixtures::plane(2);
        mesh.positions[3].x = x;
        let fault = fault_of(&mesh);
        assert!(
            matches!(fault, MeshError::BadPosition { vertex: 3, .. }),
            "{fault}"
        );
    }
}

#[test]
fn rejects_incomplete_attributes() {
    let mut mesh = fixtures::plane(2);
    mesh.normals.pop();
    let fault = fault_of(&mesh);
    assert!(
        matches!(
            fault,
            MeshError::AttributeCount {
                attribute: "normals",
                ..
            }
        ),
        "{fault}"
    );
    let mut mesh = fixtures::plane(2);
    mesh.uvs.push(Vec2::ZERO);
    let fault = fault_of(&mesh);
    assert!(
        matches!(
            fault,
            MeshError::AttributeCount {
                attribute: "uvs",
                ..
            }
        ),
        "{fault}"
    );
}

#[test]
fn rejects_settings_out_of_range() {
    let mesh = fixtures::plane(2);
    let fine = BakeConfig::default;
    for (field, config) in [
        (
            "cluster_triangles",
            BakeConfig {
                cluster_triangles: 257,
                ..fine()
            },
        ),
        (
            "group_clusters",
            BakeConfig {
                group_clusters: 1,
                ..fine()
            },
        ),
        (
            "stuck_ratio",
            BakeConfig {
                stuck_ratio: 1.5,
                ..fine()
            },
        ),
        (
            "simplify_ratio",
            BakeConfig {
                simplify_ratio: 0.9,
                ..fine()
            },
        ),
    ] {
        assert_eq!(bake_mesh(&mesh, &config), Err(MeshError::Config { field }));
    }
    for preset in [BakeConfig::default(), BakeConfig::fine_grained()] {
        preset.validate().unwrap();
    }
}

#[test]
fn replaces_attributes_that_are_not_finite() {
    let mut mesh = fixtures::height_field(60);
    mesh.normals[7] = Vec3::splat(f32::NAN);
    mesh.uvs[9] = Vec2::splat(f32::INFINITY);
    mesh.uvs[11] = Vec2::splat(3e38);
    let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
    hierarchy.validate().unwrap();
    assert!(hierarchy.level_count() > 1);
    assert!(hierarchy.vertices.normals.iter().all(|n| n.is_finite()));
    assert!(hierarchy.vertices.uvs.iter().all(|uv| uv.is_finite()));
}
