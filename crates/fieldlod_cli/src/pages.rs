//! The numbers that `inspect` prints about a `.fieldpages` file.

use std::fmt::Write;

use fieldlod_cli::output::{bytes_text, thousands};
use fieldlod_hierarchy::{FORMAT_VERSION, FileError, PagedFile, PagedMesh};
use serde::Serialize;

/// Numbers of a file. Every page was read and checked.
#[derive(Debug, Serialize)]
pub(crate) struct PagesReport {
    file: String,
    format_version: u32,
    bytes: u64,
    /// Bytes before the first page.
    contents_bytes: u64,
    meshes: Vec<MeshReport>,
}

#[derive(Debug, Serialize)]
struct MeshReport {
    mesh: u32,
    primitive: u32,
    name: String,
    groups: usize,
    units: usize,
    /// Triangles of the source.
    source_triangles: u64,
    pages: usize,
    /// Bytes in the file of the first page, and of the largest page.
    first_page_bytes: u64,
    largest_page_bytes: u64,
    /// Bytes on the GPU of the first page, and of all pages.
    first_page_gpu_bytes: u64,
    gpu_bytes: u64,
}

impl PagesReport {
    /// Reads the table of contents and every page.
    pub(crate) fn of(file: String, bytes: &[u8]) -> Result<Self, FileError> {
        let paged = PagedFile::from_contents(bytes)?;
        for mesh in &paged.meshes {
            for number in 0..mesh.pages.len() {
                mesh.read_page_of(number, bytes)?;
            }
        }
        Ok(Self {
            file,
            format_version: FORMAT_VERSION,
            bytes: bytes.len() as u64,
            contents_bytes: PagedFile::contents_end(bytes)?,
            meshes: paged.meshes.iter().map(MeshReport::of).collect(),
        })
    }

    pub(crate) fn text(&self) -> String {
        let mut text = format!(
            "{}: {}, table of contents {}, format {}",
            self.file,
            bytes_text(self.bytes),
            bytes_text(self.contents_bytes),
            self.format_version
        );
        for mesh in &self.meshes {
            let _ = write!(
                text,
                "\nmesh {} ({:?}), primitive {}: {} triangles in {} pages of up to {}; on the GPU {} at \
                 start, {} in all",
                mesh.mesh,
                mesh.name,
                mesh.primitive,
                thousands(mesh.source_triangles),
                mesh.pages,
                bytes_text(mesh.largest_page_bytes),
                bytes_text(mesh.first_page_gpu_bytes),
                bytes_text(mesh.gpu_bytes),
            );
        }
        text
    }
}

impl MeshReport {
    fn of(mesh: &PagedMesh) -> Self {
        let pages = || mesh.pages.iter();
        let bytes = || pages().map(|page| page.bytes.end - page.bytes.start);
        let gpu_bytes = || pages().map(|page| u64::from(page.mesh_bytes));
        Self {
            mesh: mesh.mesh_index,
            primitive: mesh.primitive_index,
            name: mesh.name.clone(),
            groups: mesh.graph.groups.len(),
            units: mesh.graph.units.len(),
            source_triangles: mesh.graph.source_triangle_count(),
            pages: mesh.pages.len(),
            first_page_bytes: bytes().next().unwrap_or(0),
            largest_page_bytes: bytes().max().unwrap_or(0),
            first_page_gpu_bytes: gpu_bytes().next().unwrap_or(0),
            gpu_bytes: gpu_bytes().sum(),
        }
    }
}
