//! Decodes arbitrary bytes as a `.fieldlod` file: unchanged, and with matching checksums.
//!
//! Run `cargo +nightly fuzz run read_file -- -max_total_time=600` in `crates/fieldlod_hierarchy`. A stable
//! compiler needs `RUSTC_BOOTSTRAP=1 cargo fuzz run read_file -s none -- -max_total_time=600`. Files of
//! `fieldlod bake` in `fuzz/corpus/read_file` are good seeds.

#![no_main]

use fieldlod_hierarchy::{BakedFile, Hierarchy, Vertices};
use glam::{Vec2, Vec3, Vec4};
use libfuzzer_sys::fuzz_target;

#[path = "../../tests/suite/common.rs"]
mod common;

fuzz_target!(|bytes: &[u8]| {
    read(bytes);
    read(&common::sealed(bytes.to_vec()));
});

fn read(bytes: &[u8]) {
    if let Ok(file) = BakedFile::from_bytes(bytes) {
        let again = BakedFile::from_bytes(&file.to_bytes());
        assert_eq!(again.unwrap().primitives.len(), file.primitives.len());
    }
    if let Ok(file) = BakedFile::from_bytes_beside_source(bytes) {
        for primitive in file.primitives {
            let source = zeros_like(&primitive.hierarchy);
            let _ = primitive.hierarchy.with_source_vertices(&source);
        }
    }
}

/// Source vertices with the number and the attributes of `hierarchy`. All values are zero.
fn zeros_like(hierarchy: &Hierarchy) -> Vertices {
    let count = |length: usize| length.min(hierarchy.source_vertex_count as usize);
    let vertices = &hierarchy.vertices;
    Vertices {
        positions: vec![Vec3::ZERO; count(vertices.positions.len())],
        normals: vec![Vec3::ZERO; count(vertices.normals.len())],
        uvs: vec![Vec2::ZERO; count(vertices.uvs.len())],
        tangents: vec![Vec4::ZERO; count(vertices.tangents.len())],
        uvs_1: vec![Vec2::ZERO; count(vertices.uvs_1.len())],
        colors: vec![Vec4::ZERO; count(vertices.colors.len())],
    }
}
