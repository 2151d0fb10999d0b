//! Checks a hierarchy against the mesh that it was baked from, without trusting the bake.

mod cuts;
mod report;
mod samples;
mod subject;

use fieldlod_hierarchy::Hierarchy;

pub use report::{Verified, VerifyError, VerifySettings};

use crate::mesh::SourceMesh;
use subject::Subject;

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
    // What the other checks rely on.
    mesh.validate()?;
    hierarchy.validate()?;
    if hierarchy.source != mesh.source_hash() {
        return Err(VerifyError::OtherSource);
    }
    // What the hierarchy states, and what its cuts look like.
    let subject = Subject::new(mesh, hierarchy, settings);
    let mut verified = Verified::default();
    samples::check(&subject, &mut verified)?;
    cuts::check(&subject, &mut verified)?;
    Ok(verified)
}
