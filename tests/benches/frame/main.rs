//! What a frame costs on the main thread, without a renderer: the scene as Bevy draws it, with three
//! levels by hand, and with the plugin.
//!
//! Run with `cargo bench -p fieldlod_tests --bench frame`; figures are in `benches/RECORD.md`.

mod field;

use std::cell::{LazyCell, RefCell};
use std::collections::HashSet;
use std::time::Duration;

use bevy_fieldlod::LodKind;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use field::{Field, Method};
use fieldlod_bake::SourceMesh;
use fieldlod_tests::rock;

/// A rock of 5 120 triangles and what someone would draw of it further off.
fn rocks() -> [SourceMesh; 3] {
    [4, 3, 2].map(|subdivisions| rock(subdivisions, 1))
}

/// Frames of the walk on which levels must change.
const WALK: u32 = 60;

fn frames(criterion: &mut Criterion) {
    for count in [1_000, 10_000, 100_000] {
        for sun in [false, true] {
            let light = if sun { "sun" } else { "dark" };
            let mut group = criterion.benchmark_group(format!("{count}_props_{light}"));
            group
                .sample_size(20)
                .warm_up_time(Duration::from_secs(1))
                .measurement_time(Duration::from_secs(2));
            let methods = [Method::Full, Method::Ranges, Method::AutoLod(LodKind::Auto)];
            for (name, method) in ["full", "ranges", "auto_lod"].into_iter().zip(methods) {
                // Not made where a filter leaves it out.
                let field = LazyCell::new(|| RefCell::new(checked_field(method, count, sun)));
                group.bench_function(BenchmarkId::new(name, "still"), |bencher| {
                    let mut field = field.borrow_mut();
                    bencher.iter(|| field.still());
                });
                group.bench_function(BenchmarkId::new(name, "walking"), |bencher| {
                    let mut field = field.borrow_mut();
                    bencher.iter(|| field.walk());
                });
            }
        }
    }
}

/// A field that does what it is timed for.
fn checked_field(method: Method, count: u32, sun: bool) -> Field {
    let mut field = Field::new(method, &rocks(), count, sun);
    let visible = field.visible();
    assert!(!visible.is_empty() && visible.len() < count as usize);
    match method {
        Method::Full => {}
        Method::Ranges => {
            let meshes: HashSet<_> = visible.iter().map(|(_, mesh)| mesh).collect();
            assert!(meshes.len() > 1, "all is drawn at one level");
        }
        Method::AutoLod(_) => {
            let stats = field.stats();
            assert_eq!(stats.units_drawn as usize, visible.len());
            assert!(
                stats.triangles_drawn * 2 < stats.triangles_full,
                "{stats:?}"
            );
            let before = field.levels();
            let mut selection_time = Duration::ZERO;
            for _ in 0..WALK {
                field.walk();
                selection_time += field.stats().selection_time;
            }
            let after = field.levels();
            let changed = before
                .iter()
                .filter(|(e, mesh)| after.get(*e) != Some(*mesh));
            let changed = changed.count();
            assert!(changed > 0, "a walk changes no level");
            eprintln!(
                "{changed} entities change their mesh in {WALK} frames, which take {:?} to select",
                selection_time / WALK
            );
            field.rewind();
        }
    }
    field
}

/// The measurement behind the thresholds between meshes left alone, whole meshes and units.
fn kinds(criterion: &mut Criterion) {
    for count in [1_000, 10_000] {
        for subdivisions in [2, 3, 4, 5, 6] {
            let triangles = 20 * 4usize.pow(subdivisions);
            let mut group = criterion.benchmark_group(format!("{count}_of_{triangles}_triangles"));
            group
                .sample_size(20)
                .warm_up_time(Duration::from_secs(1))
                .measurement_time(Duration::from_secs(2));
            for kind in [LodKind::Plain, LodKind::WholeMesh, LodKind::Clusters] {
                let field = LazyCell::new(|| RefCell::new(walked_field(kind, count, subdivisions)));
                group.bench_function(format!("{kind:?}"), |bencher| {
                    let mut field = field.borrow_mut();
                    bencher.iter(|| field.walk());
                });
            }
        }
    }
}

/// A field of rocks that has been walked through, with what it draws written out.
fn walked_field(kind: LodKind, count: u32, subdivisions: u32) -> Field {
    let rocks = [rock(subdivisions, 1)];
    let mut field = Field::new(Method::AutoLod(kind), &rocks, count, true);
    (0..100).for_each(|_| field.walk());
    let stats = field.stats();
    let has_levels = kind != LodKind::Plain;
    assert_eq!(stats.triangles_drawn < stats.triangles_full, has_levels);
    let visible = field.visible().len();
    let full = visible * rocks[0].triangle_count();
    eprintln!(
        "{kind:?}: {} triangles, {visible} of {} entities drawn",
        if has_levels {
            stats.triangles_drawn as usize
        } else {
            full
        },
        field.levels().len(),
    );
    field
}

criterion_group!(benches, frames, kinds);
criterion_main!(benches);
