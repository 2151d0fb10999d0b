//! Checks the hierarchies of characters against their sources, in poses.

use fieldlod_hierarchy::Hierarchy;

use super::bound::bounds;
use super::character::Character;
use super::deviation::deviations;
use super::poses::{Pose, Training, clip_poses};
use crate::import::Import;
use crate::verify::{VerifyError, VerifySettings, differing_triangles};

/// Poses of clips that are checked. Every pose is measured at every level, and neighbouring keyframes hardly differ.
const MOST_POSES: usize = 256;

/// Results of [`verify_rigged`] for a primitive that passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RiggedVerified {
    /// Number of poses in which the primitive's character was measured.
    pub poses: usize,
    /// The largest distance in these poses, as a share of the deviation stated.
    pub share: f32,
    /// A bound of the distance at samples while joints bend by up to each of [`Self::BENT`], as a share of the
    /// deviation stated.
    pub bounds: [f32; 3],
}

impl RiggedVerified {
    /// Angles in degrees.
    pub const BENT: [f32; 3] = [15.0, 45.0, 90.0];
}

/// Checks the hierarchies of all primitives that have a skin or morph targets. Every invariant is checked. Deviations
/// are measured in poses of the clips, of morph targets, and of bent joints.
///
/// `baked` has one entry per primitive of the import. Entries of static primitives are ignored. The result is in the
/// order of the import.
#[must_use]
pub fn verify_rigged(
    import: &Import,
    baked: &[Option<Hierarchy>],
    settings: &VerifySettings,
) -> Vec<(usize, Result<RiggedVerified, VerifyError>)> {
    let mut results = Vec::new();
    for character in Character::all_of(import) {
        let verified = verify_character(&character, import, baked, settings);
        let parts = character.parts.iter();
        results.extend(parts.map(|part| (part.index, verified.clone())));
    }
    results.sort_by_key(|(index, _)| *index);
    results
}

fn verify_character(
    character: &Character<'_>,
    import: &Import,
    baked: &[Option<Hierarchy>],
    settings: &VerifySettings,
) -> Result<RiggedVerified, VerifyError> {
    let parts = character.parts.iter();
    let parts = parts.map(|part| baked.get(part.index)?.as_ref());
    let parts: Vec<&Hierarchy> = parts
        .collect::<Option<_>>()
        .ok_or(VerifyError::PartsDiffer)?;
    // All parts have equal groups from here on.
    check_parts(character, &parts)?;
    let stated = &parts[0].groups;
    let levels = (0..stated.len()).map(|level| character.triangles_at(&parts, level));
    let levels: Vec<Vec<[u32; 3]>> = levels.collect();
    let source = character.triangles().iter().copied();
    match differing_triangles(source, levels[0].iter().copied()) {
        0 => {}
        found => return Err(VerifyError::FinestCut { found }),
    }
    let poses = poses(character, import);
    let mut verified = RiggedVerified {
        poses: poses.len(),
        ..RiggedVerified::default()
    };
    let measured = deviations(character, &poses, &levels[1..]);
    for (level, deviation) in (1..).zip(measured) {
        // The deviation of a level is the deviation of the group that simplifies to it.
        let stated = stated[level - 1].deviation_in_local;
        if stated.is_infinite() {
            continue;
        }
        let share = share_of(deviation, stated);
        if share > 1.0 + settings.tolerance {
            let level = level as u32;
            return Err(VerifyError::SourceTooFar { level, share });
        }
        verified.share = verified.share.max(share);
        let bounds = bounds(character, import, &levels[level], RiggedVerified::BENT);
        for (most, bound) in verified.bounds.iter_mut().zip(bounds) {
            *most = most.max(share_of(bound, stated));
        }
    }
    Ok(verified)
}

/// Returns `distance / stated`. A distance of 0 gives 0, even if `stated` is 0.
fn share_of(distance: f32, stated: f32) -> f32 {
    if distance > 0.0 {
        distance / stated
    } else {
        0.0
    }
}

/// Checks the invariants of each part, and that all parts have equal levels.
fn check_parts(character: &Character<'_>, baked: &[&Hierarchy]) -> Result<(), VerifyError> {
    for (part, hierarchy) in character.parts.iter().zip(baked) {
        hierarchy.validate()?;
        if hierarchy.source != part.source_hash() {
            return Err(VerifyError::OtherSource);
        }
        let is_alike = !hierarchy.units.is_empty()
            && hierarchy.units.len() == hierarchy.groups.len()
            && hierarchy.vertices.positions.len() == part.vertices.len()
            && hierarchy.carrier_joint == character.carrier_joint()
            && stated(hierarchy).eq(stated(baked[0]));
        if !is_alike {
            return Err(VerifyError::PartsDiffer);
        }
    }
    Ok(())
}

fn poses(character: &Character<'_>, import: &Import) -> Vec<Pose> {
    let of_clips = clip_poses(character, import, &import.clips);
    let mut poses = Training::of(character, import, &of_clips).poses;
    let step = of_clips.len().div_ceil(MOST_POSES).max(1);
    poses.extend(of_clips.into_iter().step_by(step));
    poses
}

/// Bounds, errors and deviations of all groups, as bits.
fn stated(hierarchy: &Hierarchy) -> impl Iterator<Item = [u32; 7]> + '_ {
    hierarchy.groups.iter().map(|group| {
        let [x, y, z] = group.bounds.center.to_array();
        let (radius, error) = (group.bounds.radius, group.error_in_local);
        let (whole, deviation) = (group.whole_mesh_error_in_local, group.deviation_in_local);
        [x, y, z, radius, error, whole, deviation].map(f32::to_bits)
    })
}
