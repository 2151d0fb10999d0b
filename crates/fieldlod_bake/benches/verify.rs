//! What takes too long for a test: large degenerate meshes, which must pass `verify`, and how far
//! the meshes on which deviations are hardest to measure go beyond what is stated.
//!
//! `cargo bench -p fieldlod_bake --bench verify`: minutes. Seconds elapsed.

use std::time::Instant;

use fieldlod_bake::{
    BakeConfig, SourceMesh, Verified, VerifyError, VerifySettings, bake_mesh, fixtures, verify,
};
use fieldlod_hierarchy::fixtures::Random;
use glam::Vec3;

/// Meshes in steps.
const STEPPED: u32 = 240;

fn main() {
    for (name, mesh) in large_degenerate() {
        let started = Instant::now();
        let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).expect("the mesh is sound");
        let baked = started.elapsed().as_secs_f32();
        let verified = verify(&mesh, &hierarchy, &VerifySettings::default());
        let whole = started.elapsed().as_secs_f32();
        assert!(verified.is_ok(), "{name}: {verified:?}");
        println!(
            "{name:<20} bake {baked:>5.1} s, verify {:>5.1} s",
            whole - baked
        );
    }
    let presets = [
        ("default", BakeConfig::default()),
        ("fine_grained", BakeConfig::fine_grained()),
        ("32 triangles by 6", tiny_groups()),
    ];
    for (first, (name, config)) in (0..).zip(&presets) {
        let shares = (first..STEPPED).step_by(presets.len());
        let shares: Vec<f32> = shares.filter_map(|seed| share(seed, config)).collect();
        let beyond = shares.iter().filter(|&&share| share > 1.05).count();
        let worst = shares.iter().copied().fold(0.0, f32::max);
        let count = shares.len();
        println!("steps, {name:<18} {beyond} of {count} beyond 5 %, the furthest {worst:.3}");
    }
}

fn large_degenerate() -> [(&'static str, SourceMesh); 5] {
    [
        ("coincident points", fixtures::coincident_points(100_000)),
        ("fan", fixtures::non_manifold_fan(100_000)),
        ("plane", fixtures::plane(224)),
        ("islands", fixtures::islands(100_000)),
        ("doubled", fixtures::doubled(fixtures::rock(6, 4))),
    ]
}

fn tiny_groups() -> BakeConfig {
    BakeConfig {
        cluster_triangles: 32,
        group_clusters: 6,
        ..BakeConfig::default()
    }
}

/// The largest distance found, as a share of what is stated. `None` where the steps are so high
/// that cuts turn over.
fn share(seed: u32, config: &BakeConfig) -> Option<f32> {
    let mesh = stepped(seed);
    let hierarchy = bake_mesh(&mesh, config).expect("the mesh is sound");
    let settings = VerifySettings {
        cuts: 3,
        samples_per_triangle: 20,
        tolerance: 10.0,
        ..VerifySettings::default()
    };
    match verify(&mesh, &hierarchy, &settings) {
        Ok(Verified {
            source_to_simplified,
            simplified_to_source,
            ..
        }) => Some(source_to_simplified.max(simplified_to_source)),
        Err(VerifyError::Flipped { .. }) => None,
        Err(fault) => panic!("{seed}: {fault}"),
    }
}

/// A mesh whose vertices are moved in and out by up to 8 %, in stripes or at random.
fn stepped(seed: u32) -> SourceMesh {
    let mut random = Random::new(u64::from(seed));
    let mut mesh = match seed / 3 % 6 {
        0 => fixtures::rock(4, seed),
        1 => fixtures::height_field(40 + seed % 40),
        2 => fixtures::torus_knot(200 + 13 * (seed % 20), 12),
        3 => fixtures::shells(3, 3),
        4 => fixtures::joined(&[fixtures::rock(4, seed), fixtures::torus_knot(150, 10)]),
        _ => fixtures::rock(5, seed),
    };
    let (stripes, strength) = (3.0 + 40.0 * random.unit(), 0.08 * random.unit());
    let axis = random.vector().normalize_or(Vec3::X);
    let is_random = seed.is_multiple_of(4);
    for position in &mut mesh.positions {
        let step = if is_random {
            random.signed()
        } else {
            (position.dot(axis) * stripes).sin().signum()
        };
        *position *= 1.0 + strength * step;
    }
    fixtures::with_smooth_normals(mesh)
}
