//! Why a file or a part of it is not imported, and which part that is.

use std::fmt;

use thiserror::Error;

use super::meshopt_views::PackedViewFault;
use super::rig_fault::RigFault;
use crate::mesh::MeshError;

/// Which primitive of a file it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PrimitivePlace {
    /// Index of the mesh in the file.
    pub mesh_index: u32,
    /// Index of the primitive in that mesh.
    pub primitive_index: u32,
    /// The mesh's name, or an empty string.
    pub name: String,
}

impl fmt::Display for PrimitivePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "mesh {}", self.mesh_index)?;
        if !self.name.is_empty() {
            write!(f, " ({:?})", self.name)?;
        }
        write!(f, ", primitive {}", self.primitive_index)
    }
}

/// Why a primitive has no levels of detail.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SkipReason {
    /// It is made of points or lines.
    #[error("it is made of points or lines")]
    NotTriangles,
    /// Positions are neither 32-bit floating-point numbers nor what `KHR_mesh_quantization` allows.
    #[error("its positions are in a format that glTF does not know")]
    PositionFormat,
    /// There are no triangles in it.
    #[error("it has no triangles")]
    NoTriangles,
    /// It is faulty.
    #[error("{0}")]
    Faulty(PrimitiveFault),
}

/// What is wrong with a primitive.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum PrimitiveFault {
    /// An accessor points outside its buffer or has an unusable type.
    #[error("{attribute}: {fault}")]
    Accessor {
        attribute: &'static str,
        fault: AccessorFault,
    },
    /// The triangles themselves are faulty.
    #[error("{0}")]
    Mesh(#[from] MeshError),
    /// Its skin or its morph targets are faulty.
    #[error("{0}")]
    Rig(#[from] RigFault),
}

impl PrimitiveFault {
    /// The error of a file without other primitives.
    pub(crate) fn of(self, place: PrimitivePlace) -> ImportError {
        match self {
            Self::Accessor { attribute, fault } => ImportError::Accessor {
                place,
                attribute,
                fault,
            },
            Self::Mesh(fault) => ImportError::Mesh { place, fault },
            Self::Rig(fault) => ImportError::Rig { place, fault },
        }
    }
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
    #[error("could not be read: {0}")]
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
    #[error("it needs the glTF extension {name}, which is not supported{remedy}", name = .0, remedy = remedy(.0))]
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
    /// A skin or morph targets are faulty.
    #[error("{place}: {fault}")]
    Rig {
        place: PrimitivePlace,
        fault: RigFault,
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

/// A tool that writes the same file without an extension.
fn remedy(extension: &str) -> &'static str {
    match extension {
        "KHR_draco_mesh_compression" => {
            ": unpack it with `gltf-transform optimize IN OUT --compress false`"
        }
        _ => "",
    }
}

/// Why the bytes of a buffer cannot be had.
#[derive(Debug, Error)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum BufferFault {
    /// The file beside the glTF is missing or unreadable.
    #[error("{uri:?} could not be read: {error}")]
    Read { uri: String, error: std::io::Error },
    /// A link to somewhere else.
    #[error("{uri:?} is not a file beside the glTF")]
    Elsewhere { uri: String },
    /// Bytes inside the JSON, but garbled.
    #[error("its data URI could not be decoded: {0}")]
    DataUri(String),
    /// It should be the binary chunk, but there is none.
    #[error("the GLB has no binary chunk")]
    NoBinaryChunk,
    /// Fewer bytes than announced.
    #[error("truncated: {available} of {needed} bytes")]
    Truncated { needed: u64, available: u64 },
}

/// Why an accessor cannot be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum AccessorFault {
    /// It ends outside its buffer view, or the view outside its buffer.
    #[error("accessor {accessor} reads outside its buffer")]
    OutOfBounds { accessor: usize },
    /// Elements overlap.
    #[error("accessor {accessor} has a stride of {stride} for elements of {element} bytes")]
    Stride {
        accessor: usize,
        stride: usize,
        element: usize,
    },
    /// More elements than can be counted.
    #[error("accessor {accessor} has too many elements: {count}")]
    TooMany { accessor: usize, count: usize },
    /// Indices that are not unsigned scalars.
    #[error("accessor {accessor} does not hold indices")]
    NotIndices { accessor: usize },
}
