//! Hashes of meshes, which tell whether a mesh that was loaded again has changed.

use std::hash::{BuildHasher, Hash, Hasher};
use std::mem::discriminant;

use bevy::asset::AssetId;
use bevy::mesh::{Indices, Mesh, MeshAccessError};
use bevy::platform::collections::HashMap;
use bevy::platform::hash::FixedHasher;

/// The contents of the meshes whose levels were requested.
///
/// Bevy loads a glTF file again for each label that a game loads, and replaces all its meshes by equal ones.
#[derive(Default)]
pub(super) struct MeshContents(HashMap<AssetId<Mesh>, u64>);

impl MeshContents {
    /// Records what levels are prepared for.
    pub(super) fn note(&mut self, id: AssetId<Mesh>, mesh: &Mesh) {
        match hash_of(mesh) {
            Ok(hash) => self.0.insert(id, hash),
            Err(_) => self.0.remove(&id),
        };
    }

    /// Whether a mesh is what its levels were prepared for.
    pub(super) fn are_same(&self, id: AssetId<Mesh>, mesh: &Mesh) -> bool {
        let noted = self.0.get(&id);
        noted.is_some_and(|noted| hash_of(mesh).is_ok_and(|hash| hash == *noted))
    }

    /// Drops the data of a removed mesh.
    pub(super) fn remove(&mut self, id: AssetId<Mesh>) {
        self.0.remove(&id);
    }
}

/// The hash of everything that levels depend on. It is the same only within one run of a program.
fn hash_of(mesh: &Mesh) -> Result<u64, MeshAccessError> {
    let hasher = &mut FixedHasher.build_hasher();
    mesh.asset_usage.bits().hash(hasher);
    mesh.primitive_topology().hash(hasher);
    for (attribute, values) in mesh.try_attributes()? {
        attribute.id.hash(hasher);
        discriminant(values).hash(hasher);
        values.get_bytes().hash(hasher);
    }
    match mesh.try_indices_option()? {
        Some(Indices::U16(indices)) => indices.hash(hasher),
        Some(Indices::U32(indices)) => indices.hash(hasher),
        None => {}
    }
    if mesh.try_has_morph_targets()? {
        for at in mesh.try_morph_targets()? {
            let deltas = [at.position, at.normal, at.tangent];
            deltas
                .map(|delta| delta.to_array().map(f32::to_bits))
                .hash(hasher);
        }
    }
    Ok(hasher.finish())
}
