//! Levels of skinned and morphed meshes.
//!
//! In: the primitives of an [`Import`] that have a rig. Out: for each, a chain of whole-mesh levels. Primitives with one
//! skin are one character: they are simplified together and change their levels together. Levels use source vertices
//! alone, so joints, weights and morph targets of a level are those of the source.

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
pub use character::{Character, Part};
pub use deviation::{Distances, distances};
pub use poses::{Pose, clip_poses};
#[cfg(any(test, feature = "test-support"))]
pub use simplify::plain_levels;
pub use verify::{RiggedVerified, verify_rigged};

/// The levels of a rigged primitive, or why it has none.
pub type RiggedResult = Result<(Hierarchy, BakeReport), MeshError>;

/// Bakes all primitives of a file that have a skin or morph targets, in the order of the file.
///
/// Primitives with the same skin, and primitives without a skin of the same glTF mesh, have the same spheres, errors and
/// number of levels.
///
/// # Errors
/// For each primitive, a [`MeshError`] if the configuration is out of range or a level needs 32-bit indices.
#[must_use]
pub fn bake_rigged(import: &Import, config: &BakeConfig) -> Vec<(PrimitivePlace, RiggedResult)> {
    let characters = Character::all_of(import);
    let bake = |character: &Character<'_>| {
        config.validate()?;
        levels::bake(character, import, config)
    };
    let baked: Vec<(Character<'_>, Result<Vec<_>, MeshError>)> = characters
        .into_par_iter()
        .map(|character| {
            let baked = bake(&character);
            (character, baked)
        })
        .collect();
    let mut results: Vec<(usize, PrimitivePlace, RiggedResult)> = Vec::new();
    for (character, baked) in baked {
        let mut of_parts = baked.map(Vec::into_iter);
        for part in &character.parts {
            let result = match &mut of_parts {
                Ok(baked) => baked.next().ok_or(MeshError::NoTriangles),
                Err(fault) => Err(fault.clone()),
            };
            let place = part.primitive.place.clone();
            results.push((part.index, place, result));
        }
    }
    results.sort_by_key(|(index, ..)| *index);
    results
        .into_iter()
        .map(|(_, place, result)| (place, result))
        .collect()
}
