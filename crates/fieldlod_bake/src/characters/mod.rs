//! Levels of skinned and morphed meshes.
//!
//! In: the primitives of an [`Import`] that have a rig. Out: for each, a chain of whole-mesh levels. Primitives with
//! the same skins are one character: they are simplified together and change their levels together. Levels use source
//! vertices alone, so a level has the joints, weights and morph targets of the source.

mod apart;
mod bound;
mod channels;
mod character;
mod deviation;
mod levels;
mod poses;
mod simplify;
mod verify;

use fieldlod_hierarchy::Hierarchy;
use rayon::prelude::*;

use crate::config::BakeConfig;
use crate::import::{Import, PrimitivePlace};
use crate::mesh::MeshError;
use crate::report::BakeReport;
use character::Character;
pub use verify::{RiggedVerified, verify_rigged};

/// For tests and measurements of levels.
#[cfg(any(test, feature = "test-support"))]
pub(crate) mod support {
    pub use super::character::{Character, Part};
    pub use super::deviation::deviations;
    pub use super::poses::{Pose, clip_poses};
    pub use super::simplify::plain_levels;
}

/// The levels of a rigged primitive, or why it has none.
pub type RiggedResult = Result<(Hierarchy, BakeReport), MeshError>;

/// Bakes all primitives of a file that have a skin or morph targets, in the order of the file.
///
/// Primitives with the same skins, and primitives without a skin of the same glTF mesh, have the same spheres, errors
/// and number of levels.
///
/// # Errors
/// A [`MeshError`] for each primitive if the configuration is out of range. Also for all primitives of a character if
/// one of them has more vertices than 16-bit indices allow; an import skips such primitives.
#[must_use]
pub fn bake_rigged(import: &Import, config: &BakeConfig) -> Vec<(PrimitivePlace, RiggedResult)> {
    let bake = |character: Character<'_>| -> Vec<(usize, RiggedResult)> {
        let baked = config
            .validate()
            .and_then(|()| levels::bake(&character, import, config));
        let results = match baked {
            Ok(baked) => baked.into_iter().map(Ok).collect(),
            Err(fault) => vec![Err(fault); character.parts.len()],
        };
        let indices = character.parts.iter().map(|part| part.index);
        indices.zip(results).collect()
    };
    let characters = Character::all_of(import).into_par_iter();
    let mut results: Vec<(usize, RiggedResult)> = characters.flat_map_iter(bake).collect();
    results.sort_by_key(|(index, _)| *index);
    let place = |index: usize| import.primitives[index].place.clone();
    let results = results.into_iter();
    results
        .map(|(index, result)| (place(index), result))
        .collect()
}
