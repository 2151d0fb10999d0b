//! The deviations that a bake states, held against independent samples ten times as dense.

use fieldlod_bake::{BakeConfig, SourceMesh, VerifySettings, bake_mesh, fixtures, verify};

fn meshes() -> Vec<(&'static str, SourceMesh)> {
    vec![
        ("icosphere", fixtures::icosphere(5)),
        ("rock", fixtures::rock(5, 1)),
        ("shells", fixtures::shells(3, 4)),
        ("torus knot", fixtures::torus_knot(300, 24)),
        ("plane", fixtures::plane(64)),
        ("height field", fixtures::height_field(100)),
        ("islands", fixtures::islands(3_000)),
        (
            "flat-shaded rock",
            fixtures::flat_shaded(&fixtures::rock(4, 2)),
        ),
    ]
}

#[test]
fn denser_samples_never_exceed_the_deviation_by_more_than_5_percent() {
    let small = BakeConfig {
        cluster_triangles: 64,
        group_clusters: 8,
        ..BakeConfig::default()
    };
    let mut failures = 0;
    for (name, mesh) in meshes() {
        for config in [BakeConfig::default(), small.clone()] {
            let hierarchy = bake_mesh(&mesh, &config).unwrap();
            let verified = verify(&mesh, &hierarchy, &VerifySettings::default());
            println!("{name}: {verified:?}");
            failures += usize::from(verified.is_err());
        }
    }
    assert_eq!(failures, 0);
}
