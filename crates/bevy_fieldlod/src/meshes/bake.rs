//! Bakes meshes, unless they are in the cache.

use std::path::Path;

use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh};
use fieldlod_hierarchy::{FORMAT_VERSION, Hierarchy};
use xxhash_rust::xxh3::Xxh3;

use super::cache;
use super::source_arrays::SourceArrays;
use super::threads::BakeThreads;
use crate::events::{LodError, LodOrigin};

/// Takes the hierarchy of `source` from the cache, else bakes it on `threads` and puts it there.
pub(super) fn bake_unless_cached(
    source: SourceArrays,
    cache_folder: Option<&Path>,
    config: &BakeConfig,
    threads: Option<&BakeThreads>,
) -> Result<(Hierarchy, LodOrigin), LodError> {
    let entry = cache_folder.map(|folder| folder.join(entry_name(&source, config)));
    if let Some(found) = entry.as_ref().and_then(|path| cache::read(path, &source)) {
        return Ok((found, LodOrigin::Cache));
    }
    let threads = threads.ok_or(LodError::BakeDisabled)?;
    let baked = threads.run(|| bake_mesh(&source_mesh(source), config))?;
    if let Some(path) = &entry {
        cache::write(path, &baked);
    }
    Ok((baked, LodOrigin::Baked))
}

fn source_mesh(source: SourceArrays) -> SourceMesh {
    SourceMesh {
        positions: source.vertices.positions,
        normals: source.vertices.normals,
        uvs: source.vertices.uvs,
        tangents: source.vertices.tangents,
        uvs_1: source.vertices.uvs_1,
        colors: source.vertices.colors,
        has_other_attributes: source.has_other_attributes,
        surface: None,
        indices: source.indices,
    }
}

/// The name of the cache entry: a hash of all that baking looks at.
fn entry_name(source: &SourceArrays, config: &BakeConfig) -> String {
    let mut hasher = Xxh3::new();
    // Another version may bake differently, or write another format.
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(&FORMAT_VERSION.to_le_bytes());
    hasher.update(&fieldlod_bake::REVISION.to_le_bytes());
    hasher.update(format!("{config:?}").as_bytes());
    let mesh = source.vertices.source_hash(&source.indices);
    hasher.update(&mesh.0.to_le_bytes());
    hasher.update(&[source.has_other_attributes.into()]);
    format!("{:032x}.fieldlod", hasher.digest128())
}
