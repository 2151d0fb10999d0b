//! How fast a baked file is read on one core, in bytes of decoded arrays a second, checksums and
//! validation included; beside it meshoptimizer's bare decoders on the same vertices and triangles,
//! and a copy of the arrays.
//!
//! `cargo bench -p fieldlod_bake --bench load`, for a generated mesh; with the folder of some glTF
//! files in `FIELDLOD_MODELS`, instead for the largest primitive of each, with the bytes that its
//! file takes per source triangle. Results are asserted before they are timed.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, fixtures, import_gltf};
use fieldlod_hierarchy::{
    BakedFile, BakedPrimitive, Cluster, Group, Hierarchy, Precision, Unit, Vertices,
};
use glam::{Vec2, Vec3};

const PRECISIONS: [Precision; 2] = [Precision::Lossless, Precision::Quantized16];

fn load(criterion: &mut Criterion) {
    for (name, mesh) in meshes() {
        let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).expect("the mesh is sound");
        let mut group = criterion.benchmark_group(&name);
        group.throughput(Throughput::Bytes(decoded_bytes(&hierarchy) as u64));
        group.bench_function("copy", |b| b.iter(|| black_box(&hierarchy).clone()));
        let packed = Packed::of(&hierarchy);
        group.throughput(Throughput::Bytes(packed.decoded_bytes() as u64));
        group.bench_function("meshopt", |b| b.iter(|| black_box(&packed).decoded()));
        group.throughput(Throughput::Bytes(decoded_bytes(&hierarchy) as u64));
        let file = file_of(hierarchy);
        for precision in PRECISIONS {
            let bytes = file.to_bytes_with(precision);
            let read = BakedFile::from_bytes(&bytes).expect("it was just written");
            assert!(precision == Precision::Quantized16 || read == file);
            let triangles = file.primitives[0].hierarchy.source_triangle_count();
            let vertices = &read.primitives[0].hierarchy.vertices;
            println!(
                "{name} {precision:?}: {triangles} triangles, {:.2} vertices and {:.2} bytes each{}{}",
                vertices.positions.len() as f64 / triangles as f64,
                bytes.len() as f64 / triangles as f64,
                if vertices.normals.is_empty() {
                    ", no normals"
                } else {
                    ""
                },
                if vertices.uvs.is_empty() {
                    ", no texture coordinates"
                } else {
                    ""
                },
            );
            group.bench_function(format!("{precision:?}"), |b| {
                b.iter(|| BakedFile::from_bytes(black_box(&bytes)));
            });
        }
        group.finish();
    }
}

fn meshes() -> Vec<(String, SourceMesh)> {
    match std::env::var_os("FIELDLOD_MODELS") {
        Some(folder) => models(Path::new(&folder)),
        None => vec![("rock".into(), fixtures::rock(7, 1))],
    }
}

/// The largest primitive of each glTF file in `folder`.
fn models(folder: &Path) -> Vec<(String, SourceMesh)> {
    let entries = std::fs::read_dir(folder).expect("FIELDLOD_MODELS names a folder");
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let largest = |path: &Path| {
        let primitives = import_gltf(path).ok()?.primitives.into_iter();
        let largest = primitives.max_by_key(|p| p.mesh.triangle_count())?;
        let name = path.file_stem()?.to_string_lossy().into_owned();
        Some((name, largest.mesh))
    };
    paths.iter().filter_map(|path| largest(path)).collect()
}

fn file_of(hierarchy: Hierarchy) -> BakedFile {
    let primitives = vec![BakedPrimitive::new(0, 0, "mesh", hierarchy)];
    BakedFile { primitives }
}

fn decoded_bytes(hierarchy: &Hierarchy) -> usize {
    let vertices = &hierarchy.vertices;
    size_of_val::<[Vec3]>(&vertices.positions)
        + size_of_val::<[Vec3]>(&vertices.normals)
        + size_of_val::<[Vec2]>(&vertices.uvs)
        + size_of_val::<[Group]>(&hierarchy.groups)
        + size_of_val::<[Unit]>(&hierarchy.units)
        + size_of_val::<[Cluster]>(&hierarchy.clusters)
        + size_of_val::<[u32]>(&hierarchy.finer)
        + size_of_val::<[u32]>(&hierarchy.unit_vertices)
        + size_of_val::<[u16]>(&hierarchy.indices)
}

/// Vertices and triangles of a hierarchy as meshoptimizer codes them: no links, no bounds, nothing
/// checked, and as large as they are before the general compressor that is to follow.
struct Packed {
    vertex_count: usize,
    vertices: Vec<u8>,
    index_count: usize,
    indices: Vec<u8>,
}

impl Packed {
    fn of(hierarchy: &Hierarchy) -> Self {
        let rows = rows(&hierarchy.vertices);
        let units = hierarchy.units.iter();
        let triangles = units.flat_map(|unit| hierarchy.source_triangles_of(unit));
        let corners: Vec<u32> = triangles.flatten().collect();
        let vertices = meshopt::encode_vertex_buffer(&rows).expect("rows can be coded");
        let indices = meshopt::encode_index_buffer(&corners, rows.len());
        let packed = Self {
            vertex_count: rows.len(),
            vertices,
            index_count: corners.len(),
            indices: indices.expect("triangles can be coded"),
        };
        assert!(packed.decoded().0 == rows);
        packed
    }

    fn decoded(&self) -> (Vec<[f32; 8]>, Vec<u32>) {
        let vertices = meshopt::decode_vertex_buffer(&self.vertices, self.vertex_count);
        let indices = meshopt::decode_index_buffer(&self.indices, self.index_count);
        (
            vertices.expect("coded above"),
            indices.expect("coded above"),
        )
    }

    fn decoded_bytes(&self) -> usize {
        self.vertex_count * size_of::<[f32; 8]>() + self.index_count * size_of::<u32>()
    }
}

/// Position, normal and texture coordinates of each vertex; zeros where it has none.
fn rows(vertices: &Vertices) -> Vec<[f32; 8]> {
    let row = |vertex: usize| {
        let p = vertices.positions[vertex];
        let n = vertices.normals.get(vertex).copied().unwrap_or_default();
        let uv = vertices.uvs.get(vertex).copied().unwrap_or_default();
        [p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y]
    };
    (0..vertices.positions.len()).map(row).collect()
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(std::time::Duration::from_millis(500))
        .measurement_time(std::time::Duration::from_secs(2));
    targets = load
}
criterion_main!(benches);
