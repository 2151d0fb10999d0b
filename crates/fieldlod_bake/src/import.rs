//! Reads the static triangle meshes of a glTF 2.0 file.
//!
//! Positions and triangles come out as Bevy's own loader makes them, bit for bit and in the same
//! order, so that a hierarchy baked from a file fits the mesh that Bevy draws:
//!
//! - a triangle list without normals gets three vertices and a flat normal for each triangle;
//! - a primitive without indices gets the indices 0, 1, 2, …;
//! - attributes in formats that Bevy drops are dropped.
//!
//! Quantized positions (`KHR_mesh_quantization`) are no mesh to Bevy 0.19, so that there is nothing
//! to agree with: they become floating-point numbers as the extension says, still in the mesh's own
//! quantized units, which the node's transform undoes; and so do the attributes beside them. Buffer
//! views packed by `EXT_meshopt_compression` or `KHR_meshopt_compression`, which Bevy 0.19 does not
//! read either, are unpacked. Draco-compressed geometry is refused by name.
//!
//! Strips and fans are unrolled to lists, wound as the glTF specification says. Nothing in a file
//! is trusted: every range is checked before it is read, and no file makes this panic.

mod accessor;
mod buffers;
mod document;
mod format;
mod meshopt_views;
mod primitive;

use std::path::Path;

use thiserror::Error;

pub use accessor::AccessorFault;
pub use buffers::BufferFault;
pub use meshopt_views::PackedViewFault;

use crate::{ExtraAttributes, MeshError, SourceMesh};
use buffers::Buffers;
use document::MeshIndices;

/// What a file holds for a bake.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// The primitives that can have levels of detail, in the order of the file.
    pub primitives: Vec<ImportedPrimitive>,
    /// Those that cannot, and why.
    pub skipped: Vec<Skipped>,
}

/// One primitive of a glTF mesh, in its local space.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedPrimitive {
    /// Index of the mesh in the file.
    pub mesh_index: u32,
    /// Index of the primitive in that mesh.
    pub primitive_index: u32,
    /// The mesh's name, or an empty string.
    pub name: String,
    /// Its triangles. Not yet checked: see [`SourceMesh::validate`].
    pub mesh: SourceMesh,
    /// The attributes of its vertices that simplification does not look at.
    pub extra: ExtraAttributes,
}

/// A primitive that is drawn, but without levels of detail.
#[derive(Clone, Debug, PartialEq)]
pub struct Skipped {
    /// Index of the mesh in the file.
    pub mesh_index: u32,
    /// Index of the primitive in that mesh.
    pub primitive_index: u32,
    /// The mesh's name, or an empty string.
    pub name: String,
    /// Why.
    pub reason: SkipReason,
}

/// Why a primitive has no levels of detail.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum SkipReason {
    /// A skin moves its vertices.
    #[error("it is skinned")]
    Skinned,
    /// Morph targets move its vertices.
    #[error("it has morph targets")]
    Morphed,
    /// Points or lines.
    #[error("it is made of points or lines")]
    NotTriangles,
    /// Positions are neither 32-bit floating-point numbers nor what `KHR_mesh_quantization` allows.
    #[error("its positions are in a format that glTF does not know")]
    PositionFormat,
    /// Triangles, but none of them.
    #[error("it has no triangles")]
    NoTriangles,
}

/// Why a file cannot be imported or baked. The message does not repeat the file's name.
#[derive(Debug, Error)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum ImportError {
    /// No such file, a folder, no permission.
    #[error("cannot be read: {0}")]
    Read(#[source] std::io::Error),
    /// Nothing in it.
    #[error("the file is empty")]
    Empty,
    /// Neither a binary glTF nor a JSON object.
    #[error("not a glTF file")]
    NotGltf,
    /// A GLB that announces more than it holds.
    #[error("truncated: {what} ends after {available} of {needed} bytes")]
    Truncated {
        what: &'static str,
        needed: u64,
        available: u64,
    },
    /// Not glTF 2.
    #[error("glTF version {found}, but only version 2 can be read")]
    Version { found: String },
    /// Broken JSON, or JSON that breaks the glTF schema.
    #[error("not valid glTF: {0}")]
    Invalid(String),
    /// Geometry that only an extension can read.
    #[error("it needs the glTF extension {0}, which is not supported")]
    Extension(String),
    /// A buffer's bytes cannot be had.
    #[error("buffer {buffer}: {fault}")]
    Buffer { buffer: usize, fault: BufferFault },
    /// A buffer view cannot be unpacked.
    #[error("buffer view {view}: {fault}")]
    PackedView { view: usize, fault: PackedViewFault },
    /// An accessor points outside its buffer or has an unusable type.
    #[error("{place}: {attribute}: {fault}")]
    Accessor {
        place: PrimitivePlace,
        attribute: &'static str,
        fault: AccessorFault,
    },
    /// The triangles themselves are faulty.
    #[error("{place}: {fault}")]
    Mesh {
        place: PrimitivePlace,
        fault: MeshError,
    },
    /// The file has no mesh at all.
    #[error("it has no meshes")]
    NoMeshes,
    /// Everything in it was skipped.
    #[error("nothing to bake in {count} primitives; the first, {place}: {reason}")]
    AllSkipped {
        count: usize,
        place: PrimitivePlace,
        reason: SkipReason,
    },
}

/// Names a primitive in messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PrimitivePlace {
    /// Index of the mesh in the file.
    pub mesh_index: u32,
    /// Index of the primitive in that mesh.
    pub primitive_index: u32,
    /// The mesh's name, or an empty string.
    pub name: String,
}

impl std::fmt::Display for PrimitivePlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "mesh {}", self.mesh_index)?;
        if !self.name.is_empty() {
            write!(f, " ({:?})", self.name)?;
        }
        write!(f, ", primitive {}", self.primitive_index)
    }
}

impl ImportedPrimitive {
    pub(crate) fn place(&self) -> PrimitivePlace {
        PrimitivePlace {
            mesh_index: self.mesh_index,
            primitive_index: self.primitive_index,
            name: self.name.clone(),
        }
    }
}

impl Skipped {
    pub(crate) fn place(&self) -> PrimitivePlace {
        PrimitivePlace {
            mesh_index: self.mesh_index,
            primitive_index: self.primitive_index,
            name: self.name.clone(),
        }
    }
}

/// Reads the triangle meshes of a `.gltf` or `.glb` file. Images are not looked at.
///
/// # Errors
/// An [`ImportError`] that says what is wrong; never a panic, whatever the bytes.
pub fn import_gltf(path: &Path) -> Result<Import, ImportError> {
    let bytes = std::fs::read(path).map_err(ImportError::Read)?;
    import_gltf_bytes(&bytes, path.parent().unwrap_or(Path::new("")))
}

/// Reads the triangle meshes of a `.gltf` or `.glb` file's bytes. Buffers beside it are looked for
/// in `folder`.
///
/// # Errors
/// An [`ImportError`] that says what is wrong; never a panic, whatever the bytes.
pub fn import_gltf_bytes(bytes: &[u8], folder: &Path) -> Result<Import, ImportError> {
    let (document, blob) = document::read(bytes)?;
    let buffers = Buffers::load(&document, blob, folder)?;
    let skinned = MeshIndices::on_skinned_nodes(&document);
    let mut import = Import::default();
    for mesh in document.meshes() {
        for primitive in mesh.primitives() {
            let place = PrimitivePlace {
                mesh_index: mesh.index() as u32,
                primitive_index: primitive.index() as u32,
                name: mesh.name().unwrap_or_default().to_owned(),
            };
            match primitive::skip_reason(&primitive, skinned.contains(mesh.index())) {
                Some(reason) => import.skip(place, reason),
                None => {
                    let (mesh, extra) = primitive::read(&primitive, &buffers, &place)?;
                    import.take(place, mesh, extra);
                }
            }
        }
    }
    Ok(import)
}

impl Import {
    fn take(&mut self, place: PrimitivePlace, mesh: SourceMesh, extra: ExtraAttributes) {
        if mesh.indices.is_empty() {
            return self.skip(place, SkipReason::NoTriangles);
        }
        self.primitives.push(ImportedPrimitive {
            mesh_index: place.mesh_index,
            primitive_index: place.primitive_index,
            name: place.name,
            mesh,
            extra,
        });
    }

    fn skip(&mut self, place: PrimitivePlace, reason: SkipReason) {
        self.skipped.push(Skipped {
            mesh_index: place.mesh_index,
            primitive_index: place.primitive_index,
            name: place.name,
            reason,
        });
    }
}
