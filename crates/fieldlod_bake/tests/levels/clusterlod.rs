//! The clusterlod baseline.

use fieldlod_bake::{BakeConfig, SourceMesh, bare_clusterlod, clusterlod_hierarchy, fixtures};

fn meshes() -> Vec<(&'static str, SourceMesh)> {
    vec![
        ("rock", fixtures::rock(4, 3)),
        ("knot", fixtures::torus_knot(128, 16)),
        ("hills", fixtures::height_field(48)),
        ("islands", fixtures::islands(400)),
        ("fan", fixtures::non_manifold_fan(9)),
        ("doubled", fixtures::doubled(fixtures::icosphere(3))),
        ("one triangle", fixtures::one_triangle()),
    ]
}

#[test]
fn baseline_is_valid_without_deviations() {
    for (name, mesh) in meshes() {
        let hierarchy = clusterlod_hierarchy(&mesh, &BakeConfig::fine_grained()).unwrap();
        assert_eq!(hierarchy.validate(), Ok(()), "{name}");
        assert_eq!(hierarchy.vertices.positions, mesh.positions, "{name}");
        let triangles = hierarchy.source_triangle_count();
        assert_eq!(triangles, mesh.triangle_count() as u64, "{name}");
        let mut deviations = hierarchy.groups.iter().map(|g| g.deviation_in_local);
        assert!(deviations.all(f32::is_infinite), "{name}");
    }
}

#[test]
fn baseline_uses_only_cluster_and_group_sizes() {
    let mesh = fixtures::rock(5, 3);
    let config = BakeConfig::default();
    let other = BakeConfig {
        simplify_ratio: 0.7,
        ..config.clone()
    };
    let hierarchy = clusterlod_hierarchy(&mesh, &config).unwrap();
    assert_eq!(clusterlod_hierarchy(&mesh, &other).unwrap(), hierarchy);
    let fine = clusterlod_hierarchy(&mesh, &BakeConfig::fine_grained()).unwrap();
    assert!(fine.groups.len() > 2 * hierarchy.groups.len());
    let triangles = hierarchy
        .units
        .iter()
        .map(|unit| unit.triangle_count as usize);
    assert_eq!(bare_clusterlod(&mesh, &config), triangles.sum::<usize>());
}
