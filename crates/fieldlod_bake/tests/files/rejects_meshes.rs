//! Invalid meshes and settings are rejected; invalid attributes are replaced.

use fieldlod_bake::{BakeConfig, MeshError, SourceMesh, bake_mesh, fixtures};
use glam::{Vec2, Vec3};

#[test]
fn rejects_faulty_meshes() {
    let cases: [(fn(&mut SourceMesh), &str); 8] = [
        (|m| m.indices.clear(), "the mesh has no triangles"),
        (
            |m| m.indices.truncate(23),
            "the number of indices, 23, is not a multiple of 3",
        ),
        (
            |m| m.indices[4] = 9,
            "index 4 is 9, but there are only 9 vertices",
        ),
        (|m| m.positions[3].x = f32::NAN, "vertex 3 lies at "),
        (|m| m.positions[3].x = f32::INFINITY, "vertex 3 lies at "),
        (|m| m.positions[3].x = -2e18, "vertex 3 lies at "),
        (|m| m.normals.truncate(8), "8 normals for 9 vertices"),
        (|m| m.uvs.push(Vec2::ZERO), "10 uvs for 9 vertices"),
    ];
    for (damage, message) in cases {
        let mut mesh = fixtures::plane(2);
        damage(&mut mesh);
        let fault = bake_mesh(&mesh, &BakeConfig::default()).unwrap_err();
        assert!(fault.to_string().starts_with(message), "{fault}");
    }
}

#[test]
fn rejects_settings_out_of_range() {
    let mesh = fixtures::plane(2);
    let valid = BakeConfig::default;
    for (field, config) in [
        (
            "cluster_triangles",
            BakeConfig {
                cluster_triangles: 257,
                ..valid()
            },
        ),
        (
            "group_clusters",
            BakeConfig {
                group_clusters: 1,
                ..valid()
            },
        ),
        (
            "stuck_ratio",
            BakeConfig {
                stuck_ratio: 1.5,
                ..valid()
            },
        ),
        (
            "simplify_ratio",
            BakeConfig {
                simplify_ratio: 0.9,
                ..valid()
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
    // Finite, but sums of two overflow.
    mesh.uvs[11] = Vec2::splat(3e38);
    let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
    hierarchy.validate().unwrap();
    assert!(hierarchy.level_count() > 1);
    assert!(hierarchy.vertices.normals.iter().all(|n| n.is_finite()));
    assert!(hierarchy.vertices.uvs.iter().all(|uv| uv.is_finite()));
}
