//! Holds a hierarchy against the mesh it was baked from, without trusting the bake.

mod attributes;
mod cuts;
mod samples;

use fieldlod_hierarchy::{Hierarchy, InvalidHierarchy};
use thiserror::Error;

use crate::{MeshError, SourceMesh};

/// How much is checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerifySettings {
    /// How many random cuts are checked for holes, overlaps and flipped triangles.
    pub cuts: u32,
    /// Points per source triangle and level, and four times as many per simplified triangle: ten
    /// times as many as the bake measures at. At random, but the same each time.
    pub samples_per_triangle: u32,
    /// Most points per level and direction; large meshes get fewer per triangle.
    pub most_samples: u32,
    /// By which share a distance may exceed the deviation that the hierarchy states.
    pub tolerance: f32,
    /// Most area of a cut, as a share of the whole, that may face against the source.
    pub flipped_area: f32,
    /// Most vertices of those that a group's simplification removed, as a share, at which its
    /// normals or texture coordinates may be off by more than the median it states; that was
    /// measured at 64 of them.
    pub attributes_beyond: f32,
}

impl Default for VerifySettings {
    fn default() -> Self {
        Self {
            cuts: 200,
            samples_per_triangle: 10,
            most_samples: 2_000_000,
            tolerance: 0.05,
            flipped_area: 0.01,
            attributes_beyond: 0.75,
        }
    }
}

/// What was found of a hierarchy that passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Verified {
    /// Points at which distances were measured.
    pub samples: u64,
    /// The largest distance from the source to a cut, as a share of the deviation stated there.
    pub source_to_simplified: f32,
    /// The largest distance from a simplified triangle to the source, as a share of the deviation
    /// stated there.
    pub simplified_to_source: f32,
    /// How many cuts were checked.
    pub cuts: u32,
    /// The largest share of a cut's area that faces against the source.
    pub flipped_area: f32,
    /// The largest share of removed vertices at which a group's attributes are off by more than the
    /// median it states.
    pub attributes_beyond: f32,
}

/// What is wrong with a hierarchy.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum VerifyError {
    /// The mesh itself.
    #[error("the source cannot be baked: {0}")]
    Mesh(#[from] MeshError),
    /// An invariant that needs no source to check.
    #[error("{0}")]
    Invalid(#[from] InvalidHierarchy),
    /// Baked from something else.
    #[error("it was baked from another mesh")]
    OtherSource,
    /// The finest cut should be the source.
    #[error("the finest cut has {found} triangles that are not those of the source")]
    FinestCut { found: usize },
    /// A point of the source further from a cut than it says.
    #[error(
        "at level {level} a point of the source lies {share:.3} times as far from the cut as the \
         deviation stated"
    )]
    SourceTooFar { level: u32, share: f32 },
    /// A point of a simplified surface further from the source than it says.
    #[error("group {group}'s surface lies {share:.3} times as far from the source as it states")]
    SimplifiedTooFar { group: usize, share: f32 },
    /// Normals or texture coordinates further off than stated.
    #[error(
        "at {share:.3} of the vertices that group {group}'s simplification removed, normals or \
         texture coordinates are off by more than the median it states"
    )]
    AttributesOff { group: usize, share: f32 },
    /// An edge that the source does not have open.
    #[error("cut {cut} of {triangles} triangles has {edges} open edges that the source has not")]
    Hole {
        cut: u32,
        triangles: usize,
        edges: usize,
    },
    /// Triangles that face the wrong way.
    #[error("{share:.4} of the area of cut {cut} ({triangles} triangles) faces against the source")]
    Flipped {
        cut: u32,
        triangles: usize,
        share: f32,
    },
}

/// Checks that `hierarchy` is what a bake of `mesh` should give: every invariant, the deviations
/// by samples of its own, and random cuts.
///
/// # Errors
/// The first thing found wrong.
pub fn verify(
    mesh: &SourceMesh,
    hierarchy: &Hierarchy,
    settings: &VerifySettings,
) -> Result<Verified, VerifyError> {
    mesh.validate()?;
    hierarchy.validate()?;
    if hierarchy.source != mesh.source_hash() {
        return Err(VerifyError::OtherSource);
    }
    let mut verified = Verified::default();
    samples::check(mesh, hierarchy, settings, &mut verified)?;
    attributes::check(hierarchy, settings, &mut verified)?;
    cuts::check(mesh, hierarchy, settings, &mut verified)?;
    Ok(verified)
}

/// The triangles of the cut that refines the groups for which `criterion` holds, each with the
/// group that produced it.
fn cut(
    hierarchy: &Hierarchy,
    mut criterion: impl FnMut(usize) -> bool,
) -> Vec<(Option<u32>, [u32; 3])> {
    let mut refined = vec![false; hierarchy.groups.len()];
    hierarchy.refine_by(&mut refined, |group, _| criterion(group));
    let drawn = hierarchy
        .drawn_units(&refined)
        .map(|unit| &hierarchy.units[unit]);
    let triangles = drawn.flat_map(|unit| {
        let triangles = hierarchy.source_triangles_of(unit);
        triangles.map(|triangle| (unit.producer(), triangle))
    });
    triangles.collect()
}
