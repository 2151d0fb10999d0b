//! Checks the hierarchies of characters against their sources, in poses.

use fieldlod_hierarchy::Hierarchy;

use super::bound::bounds;
use super::character::{Character, Part};
use super::deviation::distances;
use super::poses::{Pose, Training, clip_poses};
use crate::import::Import;
use crate::verify::{VerifyError, VerifySettings};

/// Poses of clips that are checked.
const MOST_POSES: usize = 256;

/// Results of [`verify_rigged`] for a primitive that passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RiggedVerified {
    /// Number of poses in which its character was measured.
    pub poses: usize,
    /// The largest distance in these poses, as a share of the deviation stated.
    pub share: f32,
    /// A bound of the distance at samples while joints bend by up to each of [`Self::BENT`], as a share of the deviation
    /// stated.
    pub bounds: [f32; 3],
}

impl RiggedVerified {
    /// Angles in degrees.
    pub const BENT: [f32; 3] = [15.0, 45.0, 90.0];
}

/// Checks the hierarchies of all primitives that have a skin or morph targets: every invariant, and deviations in poses of
/// the clips, of bent joints if the clips have few keyframes, and of morph targets.
///
/// `baked` has a hierarchy for each primitive of the import. Others are ignored. The result is in the order of the import.
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
    let parts: Vec<(&Part<'_>, &Hierarchy)> = parts
        .map(|part| {
            let hierarchy = baked.get(part.index).and_then(Option::as_ref);
            hierarchy
                .map(|hierarchy| (part, hierarchy))
                .ok_or(VerifyError::PartsDiffer)
        })
        .collect::<Result<_, _>>()?;
    let Some(&(_, first)) = parts.first() else {
        return Ok(RiggedVerified::default());
    };
    for (part, hierarchy) in &parts {
        hierarchy.validate()?;
        if hierarchy.source != part.source_hash() {
            return Err(VerifyError::OtherSource);
        }
        let is_alike = !hierarchy.units.is_empty()
            && hierarchy.units.len() == hierarchy.groups.len()
            && hierarchy.vertices.positions.len() == part.vertices.len()
            && hierarchy.carrier_joint == character.carrier_joint
            && hierarchy.groups.len() == first.groups.len()
            && stated(hierarchy).eq(stated(first));
        if !is_alike {
            return Err(VerifyError::PartsDiffer);
        }
    }
    let levels: Vec<Vec<[u32; 3]>> = (0..first.groups.len())
        .map(|level| triangles_at(&parts, level))
        .collect();
    let found = missing(character.triangles(), &levels[0]);
    if found > 0 {
        return Err(VerifyError::FinestCut { found });
    }
    let mut poses = Training::of(character, import).poses;
    let of_clips = clip_poses(character, import, &import.clips);
    let step = of_clips.len().div_ceil(MOST_POSES).max(1);
    poses.extend(of_clips.into_iter().step_by(step));
    let mut verified = RiggedVerified {
        poses: poses.len(),
        ..RiggedVerified::default()
    };
    verified.check_levels(character, import, &poses, first, &levels, settings)?;
    Ok(verified)
}

impl RiggedVerified {
    fn check_levels(
        &mut self,
        character: &Character<'_>,
        import: &Import,
        poses: &[Pose],
        stated: &Hierarchy,
        levels: &[Vec<[u32; 3]>],
        settings: &VerifySettings,
    ) -> Result<(), VerifyError> {
        let measured = distances(character, poses, levels);
        for (level, distances) in measured.iter().enumerate().skip(1) {
            let stated = stated.groups[level - 1].deviation_in_local;
            if stated.is_infinite() {
                continue;
            }
            let share = |distance: f32| {
                if distance > 0.0 {
                    distance / stated
                } else {
                    0.0
                }
            };
            let own = share(distances.max());
            self.share = self.share.max(own);
            if own > 1.0 + settings.tolerance {
                let level = level as u32;
                return Err(VerifyError::SourceTooFar { level, share: own });
            }
            let bounds = bounds(character, import, &levels[level], Self::BENT);
            for (most, bound) in self.bounds.iter_mut().zip(bounds) {
                *most = most.max(share(bound));
            }
        }
        Ok(())
    }
}

/// Bounds and lengths of all groups, as bits.
fn stated(hierarchy: &Hierarchy) -> impl Iterator<Item = [u32; 7]> + '_ {
    let groups = hierarchy.groups.iter();
    groups.map(|group| {
        let [x, y, z] = group.bounds.center.to_array();
        [
            x,
            y,
            z,
            group.bounds.radius,
            group.error_in_local,
            group.whole_mesh_error_in_local,
            group.deviation_in_local,
        ]
        .map(f32::to_bits)
    })
}

fn triangles_at(parts: &[(&Part<'_>, &Hierarchy)], level: usize) -> Vec<[u32; 3]> {
    let own = parts.iter().flat_map(|(part, hierarchy)| {
        let triangles = hierarchy.triangles_of(&hierarchy.units[level]);
        triangles.map(|triangle| triangle.map(|vertex| vertex + part.vertices.start))
    });
    own.collect()
}

/// How many triangles of one list are not in the other, in any order.
fn missing(a: &[[u32; 3]], b: &[[u32; 3]]) -> usize {
    let sorted = |triangles: &[[u32; 3]]| {
        let mut sorted = triangles.to_vec();
        sorted.sort_unstable();
        sorted
    };
    let (a, b) = (sorted(a), sorted(b));
    let absent = a
        .iter()
        .filter(|triangle| b.binary_search(triangle).is_err());
    absent.count().max(a.len().abs_diff(b.len()))
}
