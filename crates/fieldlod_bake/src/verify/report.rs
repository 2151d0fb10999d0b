//! Settings, results and faults of verification.

use fieldlod_hierarchy::InvalidHierarchy;
use thiserror::Error;

use crate::mesh::MeshError;

/// Settings of [`verify`](crate::verify()).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerifySettings {
    /// Number of random cuts that are checked for holes, overlaps and flipped triangles.
    pub cuts: u32,
    /// Points per source triangle and level. Simplified triangles get four times as many. Points are pseudorandom with
    /// a fixed seed.
    pub samples_per_triangle: u32,
    /// Largest number of points on the source per level, and on all simplified triangles. Large meshes get fewer points
    /// per triangle, but at least one.
    pub most_samples: u32,
    /// Share by which a distance may exceed the stated deviation.
    pub tolerance: f32,
}

impl Default for VerifySettings {
    fn default() -> Self {
        Self {
            cuts: 200,
            samples_per_triangle: 10,
            most_samples: 2_000_000,
            tolerance: 0.05,
        }
    }
}

/// Results of [`verify`](crate::verify()) for a hierarchy that passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Verified {
    /// Points at which distances were measured.
    pub samples: u64,
    /// The largest distance from the source to a cut, as a share of the deviation stated there.
    pub source_to_simplified: f32,
    /// The largest distance from a simplified triangle to the source, as a share of the deviation
    /// stated there.
    pub simplified_to_source: f32,
    /// Number of cuts that were checked.
    pub cuts: u32,
    /// The largest share of the area of a cut that faces away from the source.
    pub flipped_area: f32,
    /// The largest share of a level's pixels that are missing or show a back face.
    pub wrong_pixels: f32,
}

/// Why a hierarchy fails.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum VerifyError {
    /// The source is faulty.
    #[error("the source cannot be baked: {0}")]
    Mesh(#[from] MeshError),
    /// The hierarchy breaks an invariant.
    #[error("{0}")]
    Invalid(#[from] InvalidHierarchy),
    /// The hierarchy was baked from another mesh.
    #[error("it was baked from another mesh")]
    OtherSource,
    /// Primitives of a character are missing or do not match.
    #[error(
        "the primitives of its character are missing, or have different levels or another carrier joint"
    )]
    PartsDiffer,
    /// The finest cut differs from the source.
    #[error("the finest cut has {found} triangles that are not those of the source")]
    FinestCut { found: usize },
    /// A point of the source is farther from a cut than stated.
    #[error(
        "at level {level}, a point of the source is {share:.3} times the stated deviation away from \
         the cut"
    )]
    SourceTooFar { level: u32, share: f32 },
    /// A point of a simplified surface is farther from the source than stated.
    #[error("the surface of group {group} lies {share:.3} times as far from the source as stated")]
    SimplifiedTooFar { group: usize, share: f32 },
    /// A cut has open edges that the source lacks.
    #[error(
        "cut {cut} of {triangles} triangles has {edges} open edges that are closed in the source"
    )]
    Hole {
        cut: u32,
        triangles: usize,
        edges: usize,
    },
    /// Too many triangles of a cut face away from the source.
    #[error(
        "{share:.4} of the area of cut {cut} ({triangles} triangles) faces away from the source"
    )]
    Flipped {
        cut: u32,
        triangles: usize,
        share: f32,
    },
    /// A level differs from the source in pictures where its error is one pixel.
    #[error(
        "at level {level}, {share:.3} of the pixels are missing or show a back face where its error is one pixel"
    )]
    Pictures { level: u32, share: f32 },
    /// The surface behind a thin layer shows through it.
    #[error(
        "where it is {side} pixels large, {share:.3} of the pixels of a thin layer show the surface behind it"
    )]
    Layer { side: usize, share: f32 },
}
