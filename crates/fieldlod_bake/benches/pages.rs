//! Cost of reading a mesh in pages: bytes per source triangle of `.fieldpages` files with several page sizes, compared
//! to a `.fieldlod` file. It also prints the size of the table of contents, and the speed of reading pages.
//!
//! `cargo bench -p fieldlod_bake --bench pages` measures generated meshes. If `FIELDLOD_MODELS` names a folder of glTF
//! files, it measures their largest primitives instead.

mod common;

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, fixtures};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, PageOptions, PagedFile, Precision};

use common::{models, seconds_on_core};

const PAGE_KIB: [u32; 4] = [32, 64, 128, 256];

fn main() {
    println!(
        "{:<18} {:>9} {:>9} {:>6} {:>6} {:>9} {:>9} {:>9} {:>9}",
        "mesh", "precision", "whole B/t", "KiB", "pages", "B/t", "table B/t", "page KiB", "MB/s"
    );
    for (name, mesh) in meshes() {
        let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).expect("the mesh is valid");
        let file = BakedFile {
            primitives: vec![BakedPrimitive::new(0, 0, "mesh", hierarchy)],
        };
        for precision in [Precision::Lossless, Precision::Quantized16] {
            for kib in PAGE_KIB {
                report(&name, &mesh, &file, precision, kib);
            }
        }
    }
}

fn meshes() -> Vec<(String, SourceMesh)> {
    match std::env::var_os("FIELDLOD_MODELS") {
        Some(_) => models(),
        None => vec![
            ("rock".into(), fixtures::rock(7, 1)),
            ("height field".into(), fixtures::height_field(400)),
        ],
    }
}

fn report(name: &str, mesh: &SourceMesh, file: &BakedFile, precision: Precision, kib: u32) {
    let options = PageOptions {
        precision,
        page_bytes: kib << 10,
    };
    let whole = file.to_bytes_with(precision).len();
    let bytes = PagedFile::to_bytes(file, options);
    let paged = PagedFile::from_contents(&bytes).expect("the file was just written");
    let (mesh_read, end) = (&paged.meshes[0], PagedFile::contents_end(&bytes).unwrap());
    let start = seconds_on_core();
    let mut decoded = 0;
    for (number, page) in mesh_read.pages.iter().enumerate() {
        let range = page.bytes.start as usize..page.bytes.end as usize;
        let read = mesh_read.read_page(number, &bytes[range]);
        assert!(read.is_ok(), "{:?}", read.err());
        decoded += u64::from(page.mesh_bytes);
    }
    let seconds = match (start, seconds_on_core()) {
        (Some(start), Some(end)) => end - start,
        _ => f64::NAN,
    };
    let each = |bytes: usize| bytes as f64 / mesh.triangle_count() as f64;
    println!(
        "{name:<18} {:>9} {:>9.2} {kib:>6} {:>6} {:>9.2} {:>9.2} {:>9.1} {:>9.0}",
        format!("{precision:?}").get(..8).unwrap_or_default(),
        each(whole),
        mesh_read.pages.len(),
        each(bytes.len()),
        each(end as usize),
        (bytes.len() - end as usize) as f64 / mesh_read.pages.len() as f64 / 1024.0,
        decoded as f64 * 1e-6 / seconds,
    );
}
