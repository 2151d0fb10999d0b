//! Faults of skins, morph targets and clips.

use thiserror::Error;

/// Why a skin or morph targets cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum RigFault {
    /// Some nodes draw the mesh with a skin, and others without.
    #[error("some nodes draw it with a skin and others without")]
    PartlySkinned,
    /// Attributes are missing, or in a format that Bevy does not read.
    #[error("its {0} are missing or in an unknown format")]
    Format(&'static str),
    /// There are more joints than Bevy draws.
    #[error("its skin has {joints} joints, but at most 256 can be drawn")]
    TooManyJoints { joints: usize },
    /// No vertex has joints in range with finite matrices, and finite weights with a sum near 1.
    #[error(
        "no vertex has usable joint weights: joints are out of range, or weights do not sum to 1"
    )]
    BadWeights,
    /// There are more morph targets than Bevy draws.
    #[error("it has {count} morph targets, but at most 256 can be drawn")]
    TooManyTargets { count: usize },
    /// A position delta is not finite.
    #[error("a morph target moves vertex {vertex} by a vector that is not finite")]
    BadDelta { vertex: usize },
    /// Bevy splits the vertices of a mesh without normals, but not the deltas of its morph targets.
    #[error("it has morph targets and indices, but no normals")]
    MorphedWithoutNormals,
}

/// Why the clips of another file are not added.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ClipFault {
    /// No clip moves a node of the baked file.
    #[error("no animation moves a node of the baked file")]
    NoNode,
    /// Several nodes of one of the files have the name of an animated node.
    #[error("an animation moves the node {0:?}, but several nodes have this name")]
    AmbiguousNode(String),
}
