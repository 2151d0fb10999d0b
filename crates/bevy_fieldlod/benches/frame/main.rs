//! What a frame costs on the main thread, without a renderer: the scene as Bevy draws it, with three
//! levels by hand, and with the plugin.
//!
//! Run with `cargo bench -p bevy_fieldlod`; figures are in `benches/RECORD.md`.

mod app;

use app::{Field, Way};
use bevy_fieldlod::LodKind;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use fieldlod_bake::{SourceMesh, fixtures};

/// A rock of 5 120 triangles and what someone would draw of it further off.
fn rocks() -> [SourceMesh; 3] {
    [4, 3, 2].map(|subdivisions| fixtures::rock(subdivisions, 1))
}

fn frames(criterion: &mut Criterion) {
    for count in [1_000, 10_000, 100_000] {
        for sun in [false, true] {
            let light = if sun { "sun" } else { "dark" };
            let mut group = criterion.benchmark_group(format!("{count}_props_{light}"));
            group.sample_size(20);
            let ways = [Way::Full, Way::Ranges, Way::Ours(LodKind::Auto)];
            for (name, way) in ["full", "ranges", "ours"].into_iter().zip(ways) {
                let mut field = Field::new(way, &rocks(), count, sun);
                assert_draws_less(&mut field, way);
                group.bench_function(BenchmarkId::new(name, "still"), |bencher| {
                    bencher.iter(|| field.still());
                });
                group.bench_function(BenchmarkId::new(name, "walking"), |bencher| {
                    bencher.iter(|| field.walk());
                });
            }
        }
    }
}

/// What is timed does its work.
fn assert_draws_less(field: &mut Field, way: Way) {
    if let Way::Ours(_) = way {
        let stats = field.stats();
        assert!(
            stats.triangles_drawn * 4 < stats.triangles_full,
            "{stats:?}"
        );
    }
}

/// The measurement behind the thresholds between whole meshes and units.
fn kinds(criterion: &mut Criterion) {
    for count in [1_000, 10_000] {
        for subdivisions in [3, 4, 5, 6] {
            let rock = [fixtures::rock(subdivisions, 1)];
            let triangles = rock[0].triangle_count();
            let mut group = criterion.benchmark_group(format!("{count}_of_{triangles}_triangles"));
            group.sample_size(20);
            for kind in [LodKind::Chain, LodKind::Clusters] {
                let mut field = Field::new(Way::Ours(kind), &rock, count, true);
                (0..100).for_each(|_| field.walk());
                let stats = field.stats();
                assert!(stats.triangles_drawn < stats.triangles_full, "{stats:?}");
                eprintln!(
                    "{kind:?}: {} triangles drawn of {}, {} meshes of {} entities, {} bytes of mesh \
                     to a source triangle",
                    stats.triangles_drawn,
                    stats.triangles_full,
                    stats.units_drawn,
                    field.entities(),
                    field.mesh_bytes() / triangles,
                );
                group.bench_function(format!("{kind:?}"), |bencher| {
                    bencher.iter(|| field.walk());
                });
            }
        }
    }
}

criterion_group!(benches, frames, kinds);
criterion_main!(benches);
