//! Errors of the import, and the parts of a file that they are about.

use std::fmt;

use thiserror::Error;

use super::meshopt_views::PackedViewFault;
use super::rig_fault::RigFault;
use crate::mesh::MeshError;

/// The place of a primitive in a file.
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
    /// The primitive is made of points or lines.
    #[error("it is made of points or lines")]
    NotTriangles,
    /// Neither glTF nor `KHR_mesh_quantization` allows the format of the positions.
    #[error("its positions are in a format that glTF does not allow")]
    PositionFormat,
    /// The primitive has no triangles.
    #[error("it has no triangles")]
    NoTriangles,
    /// The primitive is faulty.
    #[error("{0}")]
    Faulty(PrimitiveFault),
}

/// A fault of a primitive.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum PrimitiveFault {
    /// An accessor could not be read.
    #[error("{attribute}: {fault}")]
    Accessor {
        attribute: &'static str,
        fault: AccessorFault,
    },
    /// The vertices or triangles are faulty.
    #[error("{0}")]
    Mesh(#[from] MeshError),
    /// The skin or the morph targets are faulty.
    #[error("{0}")]
    Rig(#[from] RigFault),
}

impl PrimitiveFault {
    /// Adds the attribute to the fault of its accessor.
    pub(super) fn accessor(attribute: &'static str) -> impl FnOnce(AccessorFault) -> Self {
        move |fault| Self::Accessor { attribute, fault }
    }
}

/// Why a file cannot be imported or baked. The message does not repeat the file's name.
#[derive(Debug, Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum ImportError {
    /// The file could not be read.
    #[error("could not be read: {0}")]
    Read(#[source] std::io::Error),
    /// The file has no bytes.
    #[error("the file is empty")]
    Empty,
    /// Neither a binary glTF nor a JSON object.
    #[error("not a glTF file")]
    NotGltf,
    /// A GLB is shorter than its header states.
    #[error("truncated: {what} ends after {available} of {needed} bytes")]
    Truncated {
        what: &'static str,
        needed: u64,
        available: u64,
    },
    /// The glTF version is not 2.
    #[error("glTF version {found}, but only version 2 can be read")]
    Version { found: String },
    /// The JSON is broken, or breaks the glTF schema.
    #[error("not valid glTF: {0}")]
    Invalid(String),
    /// The file requires an unsupported extension.
    #[error("it needs the glTF extension {name}, which is not supported{remedy}", name = .0, remedy = remedy(.0))]
    Extension(String),
    /// The bytes of a buffer could not be read.
    #[error("buffer {buffer}: {fault}")]
    Buffer { buffer: usize, fault: BufferFault },
    /// A compressed buffer view could not be decoded.
    #[error("buffer view {view}: {fault}")]
    PackedView { view: usize, fault: PackedViewFault },
    /// A primitive is faulty.
    #[error("{place}: {fault}")]
    Primitive {
        place: PrimitivePlace,
        fault: PrimitiveFault,
    },
    /// The file would exceed the 32-bit lengths of a GLB.
    #[error(
        "as one .glb file it would have {bytes} bytes, but at most 4 GiB are possible: split it"
    )]
    TooLargeForGlb { bytes: u64 },
    /// The file has no meshes.
    #[error("it has no meshes")]
    NoMeshes,
    /// All primitives were skipped.
    #[error("nothing to bake in {count} primitives; the first, {place}: {reason}")]
    AllSkipped {
        count: usize,
        place: PrimitivePlace,
        reason: SkipReason,
    },
}

/// A command that converts a file with an unsupported extension.
fn remedy(extension: &str) -> &'static str {
    match extension {
        "KHR_draco_mesh_compression" => {
            ": unpack it with `gltf-transform optimize IN OUT --compress false`"
        }
        _ => "",
    }
}

/// Why the bytes of a buffer could not be read.
#[derive(Debug, Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum BufferFault {
    /// The file beside the glTF could not be read.
    #[error("{uri:?} could not be read: {error}")]
    Read { uri: String, error: std::io::Error },
    /// The URI has a scheme, or is not valid UTF-8.
    #[error("{uri:?} is not a file beside the glTF")]
    Elsewhere { uri: String },
    /// The data URI is invalid.
    #[error("its data URI could not be decoded: {0}")]
    DataUri(String),
    /// The buffer has no URI, and the file has no binary chunk.
    #[error("it has no URI, and the file has no binary chunk")]
    NoBinaryChunk,
    /// There are fewer bytes than the JSON states.
    #[error("truncated: {available} of {needed} bytes")]
    Truncated { needed: u64, available: u64 },
}

/// Why an accessor could not be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum AccessorFault {
    /// The accessor ends outside its buffer view, or the view outside its buffer.
    #[error("accessor {accessor} reads outside its buffer")]
    OutOfBounds { accessor: usize },
    /// Elements would overlap.
    #[error("accessor {accessor} has a stride of {stride} for elements of {element} bytes")]
    Stride {
        accessor: usize,
        stride: usize,
        element: usize,
    },
    /// There are more elements than a mesh may have.
    #[error("accessor {accessor} has too many elements: {count}")]
    TooMany { accessor: usize, count: usize },
    /// Indices are not unsigned scalars.
    #[error("accessor {accessor} does not hold indices")]
    NotIndices { accessor: usize },
}
