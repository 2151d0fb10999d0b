//! The errors of normals and texture coordinates, at all vertices instead of some.

use fieldlod_hierarchy::Hierarchy;
use rayon::prelude::*;

use super::{Verified, VerifyError, VerifySettings};
use crate::attribute_errors::AttributeRuler;

/// Differences below this are rounding: of unit normals, and of texture coordinates as a share of
/// the largest.
const ROUNDING: f32 = 1e-4;

/// The median of fewer is chance: vertices that a file has moved may end up beside another triangle.
const FEWEST_VERTICES: usize = 32;

pub(super) fn check(
    hierarchy: &Hierarchy,
    settings: &VerifySettings,
    verified: &mut Verified,
) -> Result<(), VerifyError> {
    if hierarchy.vertices.normals.is_empty() && hierarchy.vertices.uvs.is_empty() {
        return Ok(());
    }
    let positions = &hierarchy.vertices.positions;
    let scaled_from_local = crate::input::power_of_two_above(positions).recip();
    let uvs = hierarchy.vertices.uvs.iter();
    let largest_uv = uvs.map(|uv| uv.abs().max_element()).fold(1.0, f32::max);
    let ruler = AttributeRuler::new(hierarchy, scaled_from_local);
    let groups = hierarchy.groups.par_iter().enumerate();
    let shares = groups.map(|(index, group)| {
        let found = ruler.differences(index, usize::MAX);
        let normals = share_beyond(&found.normals, group.normal_error + ROUNDING);
        let uvs = share_beyond(&found.uvs, group.uv_error + ROUNDING * largest_uv);
        normals.max(uvs)
    });
    let shares: Vec<f32> = shares.collect();
    let shares = shares.into_iter().enumerate();
    let worst = shares.reduce(|a, b| if b.1 > a.1 { b } else { a });
    let (group, share) = worst.unwrap_or_default();
    verified.attributes_beyond = share;
    if share > settings.attributes_beyond {
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
