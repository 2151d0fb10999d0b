//! Bakes meshes, unless they are in the cache.

use std::path::PathBuf;
use std::sync::Arc;

use fieldlod_bake::{BakeConfig, Surface, bake_mesh};
use fieldlod_hierarchy::{FORMAT_VERSION, Hierarchy};
use xxhash_rust::xxh3::Xxh3;

use super::cache;
use super::source_arrays::SourceArrays;
use super::threads::BakeThreads;
use super::together::Member;
use crate::events::{LodError, LodOrigin};

/// What a bake goes by, beside the source.
pub(super) struct BakeJob {
    pub(super) cache_folder: Option<PathBuf>,
    pub(super) config: BakeConfig,
    /// What it runs on; `None` if there is to be none.
    pub(super) threads: Option<BakeThreads>,
    /// What the mesh looks like, if that is known.
    pub(super) surface: Option<Arc<Surface>>,
    /// What it is baked with, if it is not alone.
    pub(super) member: Option<Member>,
}

impl BakeJob {
    /// Takes the hierarchy of `source` from the cache, else bakes it and puts it there.
    pub(super) fn run(&self, source: SourceArrays) -> Result<(Hierarchy, LodOrigin), LodError> {
        let source = SourceArrays {
            surface: self.surface.clone(),
            ..source
        };
        // The mesh may have changed since it was found to be one of several.
        let is_same = |found: &SourceArrays| found.has_same_mesh_as(&source);
        let all = self.member.as_ref();
        let all = all.and_then(|member| Some((member, member.sources()?)));
        let all = all.filter(|(member, sources)| is_same(&sources[member.index()]));
        let together = all
            .as_ref()
            .map(|(member, sources)| (member.index(), &**sources));
        let name = entry_name(&source, &self.config, together);
        let entry = self.cache_folder.as_ref().map(|folder| folder.join(name));
        if let Some(found) = entry.as_ref().and_then(|path| cache::read(path, &source)) {
            return Ok((found, LodOrigin::Cache));
        }
        let threads = self.threads.as_ref().ok_or(LodError::BakeDisabled)?;
        let baked = match all {
            Some((member, sources)) => member.bake(sources, threads)?,
            None => threads.run(|| bake_mesh(&source.into_mesh(), &self.config))?,
        };
        if let Some(path) = &entry {
            cache::write(path, &baked);
        }
        Ok((baked, LodOrigin::Baked))
    }
}

/// The name of the cache entry: a hash of all that baking looks at. `together` are the meshes of which this one, by
/// its index, is baked with the others.
fn entry_name(
    source: &SourceArrays,
    config: &BakeConfig,
    together: Option<(usize, &[SourceArrays])>,
) -> String {
    let mut hasher = Xxh3::new();
    // Another version may bake differently, or write another format.
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(&FORMAT_VERSION.to_le_bytes());
    hasher.update(&fieldlod_bake::REVISION.to_le_bytes());
    hasher.update(format!("{config:?}").as_bytes());
    let mut add = |source: &SourceArrays| {
        let mesh = source.vertices.source_hash(&source.indices);
        hasher.update(&mesh.0.to_le_bytes());
        hasher.update(&[source.has_other_attributes.into()]);
        if let Some(surface) = &source.surface {
            hasher.update(&surface.to_bytes());
        }
    };
    add(source);
    if let Some((index, all)) = together {
        all.iter().for_each(add);
        hasher.update(&index.to_le_bytes());
    }
    format!("{:032x}.fieldlod", hasher.digest128())
}
