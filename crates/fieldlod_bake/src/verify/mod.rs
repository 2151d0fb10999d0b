//! Checks a hierarchy against the mesh that it was baked from, without trusting the bake.

mod cuts;
mod layers;
mod pictures;
mod report;
mod samples;
mod subject;

use fieldlod_hierarchy::Hierarchy;

pub(crate) use cuts::differing_triangles;
#[cfg(any(test, feature = "test-support"))]
pub use layers::swallowed_share;
pub use layers::verify_layers;
pub use report::{Verified, VerifyError, VerifySettings};

use crate::mesh::SourceMesh;
use crate::mesh::used_vertices::Compact;
use subject::Subject;

/// Checks a hierarchy against its source: every invariant, deviations at independent samples, random cuts, and pictures
/// of each level from six sides. [`verify_layers`] checks layers between several meshes.
///
/// # Errors
/// The first fault found.
pub fn verify(
    mesh: &SourceMesh,
    hierarchy: &Hierarchy,
    settings: &VerifySettings,
) -> Result<Verified, VerifyError> {
    // The other checks rely on the invariants.
    let compact = Compact::of(mesh)?;
    hierarchy.validate()?;
    if hierarchy.source != mesh.source_hash() {
        return Err(VerifyError::OtherSource);
    }
    let subject = Subject::new(mesh, &compact, hierarchy, settings);
    let mut verified = Verified::default();
    samples::check(&subject, &mut verified)?;
    cuts::check(&subject, &mut verified)?;
    pictures::check(&subject, &mut verified)?;
    verify_layers(&[(mesh, hierarchy)])?;
    Ok(verified)
}
