//! Throughput of decoding and validating a file on one core, in decoded bytes per second. Copying and
//! validation alone are measured for comparison.
//!
//! `cargo bench -p fieldlod_hierarchy`. The result is asserted before it is timed.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Group, Hierarchy, Precision, Unit, fixtures};

/// Hills of 524,288 triangles with positions, normals and texture coordinates.
fn hills() -> Hierarchy {
    let mut hierarchy = fixtures::grid_pyramid(5);
    hierarchy.vertices.tangents.clear();
    hierarchy.vertices.uvs_1.clear();
    hierarchy.vertices.colors.clear();
    hierarchy
}

fn decoded_bytes(hierarchy: &Hierarchy) -> usize {
    hierarchy.vertices.positions.len() * (12 + 12 + 8)
        + size_of_val::<[Group]>(&hierarchy.groups)
        + size_of_val::<[Unit]>(&hierarchy.units)
        + (hierarchy.finer.len() + hierarchy.unit_vertices.len()) * 4
        + hierarchy.indices.len() * 2
}

fn read(criterion: &mut Criterion) {
    let hierarchy = hills();
    let mut group = criterion.benchmark_group("files");
    group.throughput(Throughput::Bytes(decoded_bytes(&hierarchy) as u64));
    group.bench_function("copy", |b| b.iter(|| black_box(&hierarchy).clone()));
    group.bench_function("validate", |b| b.iter(|| black_box(&hierarchy).validate()));
    let primitives = vec![BakedPrimitive::new(0, 0, "hills", hierarchy)];
    let file = BakedFile { primitives };
    for precision in [Precision::Lossless, Precision::Quantized16] {
        let bytes = file.to_bytes_with(precision.into());
        let read = BakedFile::from_bytes(&bytes).unwrap();
        assert!(precision == Precision::Quantized16 || read == file);
        group.bench_function(format!("read {precision:?}"), |b| {
            b.iter(|| BakedFile::from_bytes(black_box(&bytes)));
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = read
}
criterion_main!(benches);
