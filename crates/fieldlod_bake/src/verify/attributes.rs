//! The errors of normals and texture coordinates, at all vertices instead of some.

use rayon::prelude::*;

use super::report::{Verified, VerifyError};
use super::subject::Subject;
use crate::attribute_errors::AttributeComparison;

/// Differences below this are rounding: of unit normals, and of texture coordinates as a share of
/// the largest.
const ROUNDING: f32 = 1e-4;

/// The median of fewer is chance: vertices that a file has moved may end up beside another triangle.
const FEWEST_VERTICES: usize = 32;

pub(super) fn check(subject: &Subject<'_>, verified: &mut Verified) -> Result<(), VerifyError> {
    let hierarchy = subject.hierarchy;
    if hierarchy.vertices.normals.is_empty() && hierarchy.vertices.uvs.is_empty() {
        return Ok(());
    }
    let uvs = hierarchy.vertices.uvs.iter();
    let largest_uv = uvs.map(|uv| uv.abs().max_element()).fold(1.0, f32::max);
    let comparison = AttributeComparison::new(hierarchy, subject.scaled_from_local);
    // Of each group, the share of removed vertices at which it is off by more than it states.
    let groups = hierarchy.groups.par_iter().enumerate();
    let shares = groups.map(|(index, group)| {
        let found = comparison.differences(index, usize::MAX);
        let normals = share_beyond(&found.normals, group.normal_error + ROUNDING);
        let uvs = share_beyond(&found.uvs, group.uv_error + ROUNDING * largest_uv);
        (index, normals.max(uvs))
    });
    let worst = shares.reduce(
        || (0, 0.0),
        |a, b| if (b.1, a.0) > (a.1, b.0) { b } else { a },
    );
    let (group, share) = worst;
    verified.attributes_beyond = share;
    if share > subject.settings.attributes_beyond {
        return Err(VerifyError::AttributesOff { group, share });
    }
    Ok(())
}

fn share_beyond(differences: &[f32], limit: f32) -> f32 {
    if differences.len() < FEWEST_VERTICES {
        return 0.0;
    }
    let beyond = differences.iter().filter(|&&difference| difference > limit);
    beyond.count() as f32 / differences.len() as f32
}
