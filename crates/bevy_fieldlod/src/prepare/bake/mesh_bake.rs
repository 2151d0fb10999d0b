//! Bakes meshes that are not in the cache.

use std::path::PathBuf;
use std::slice;
use std::sync::Arc;

use fieldlod_bake::{BakeConfig, Surface, bake_mesh_with_report};
use fieldlod_hierarchy::BakedFile;

use super::cache;
use super::primitives::Member;
use crate::api::events::{LodError, LodOrigin};
use crate::prepare::job::FoundLevels;
use crate::prepare::source_arrays::SourceArrays;
use crate::prepare::threads::BakeThreads;

/// The input of a bake, except the source mesh.
pub(in crate::prepare) struct BakeJob {
    pub(in crate::prepare) cache_folder: Option<PathBuf>,
    pub(in crate::prepare) config: BakeConfig,
    /// The threads to bake on; `None` if baking is disabled and only the cache is read.
    pub(in crate::prepare) threads: Option<BakeThreads>,
    /// The surface of the material, if it is known.
    pub(in crate::prepare) surface: Option<Arc<Surface>>,
    /// The group of primitives that it is baked with, if any.
    pub(in crate::prepare) member: Option<Member>,
}

impl BakeJob {
    /// Checks that a file has the levels of all meshes that would be baked together. Otherwise some of them would use
    /// levels of the file and others of a bake, and their levels would change at different distances.
    pub(in crate::prepare) fn check_others(
        &self,
        baked: &BakedFile,
        file: &str,
    ) -> Result<(), LodError> {
        match &self.member {
            Some(member) if self.threads.is_some() => member.check_file(baked, file),
            // Without bakes at run time, levels of the file are better than none.
            _ => Ok(()),
        }
    }

    /// Reads the hierarchy of `source` from the cache, or bakes and caches it.
    pub(in crate::prepare) fn run(&self, source: SourceArrays) -> Result<FoundLevels, LodError> {
        let source = SourceArrays {
            surface: self.surface.clone(),
            ..source
        };
        // The mesh may have changed since its group was collected.
        let is_same = |found: &SourceArrays| found.has_same_mesh_as(&source);
        let all = self.member.as_ref();
        let all = all.and_then(|member| Some((member, member.sources()?)));
        // A faulty mesh fails alone, not after a bake of its group.
        let is_valid = |source: &SourceArrays| source.clone().into_mesh().validate().is_ok();
        let all = all.filter(|(member, sources)| {
            is_same(&sources[member.index]) && is_valid(&sources[member.index])
        });
        let folder = self.cache_folder.as_ref();
        let path = |has_surfaces| {
            folder.map(|folder| folder.join(entry_name(&source, &self.config, all, has_surfaces)))
        };
        // Whether the bake depends on surfaces is known only after it.
        let mut entries = [false, true].into_iter().filter_map(path);
        if let Some(found) = entries.find_map(|entry| cache::read(&entry, &source)) {
            return Ok(FoundLevels::stored(found, LodOrigin::Cache));
        }
        let threads = self.threads.as_ref().ok_or(LodError::BakeDisabled)?;
        let entries = [false, true].map(path);
        let (baked, report) = match all {
            Some((member, sources)) => member.bake(sources, threads)?,
            None => threads.run(|| bake_mesh_with_report(&source.into_mesh(), &self.config))?,
        };
        let entry = entries[usize::from(report.depends_on_surfaces())].as_ref();
        Ok(FoundLevels {
            is_stored: entry.is_some_and(|entry| cache::write(entry, &baked)),
            hierarchy: baked,
            origin: LodOrigin::Baked,
        })
    }
}

/// Names a cache entry by the inputs of a bake, with or without surfaces. `together` is the group of the mesh, and the
/// meshes of the group.
///
/// Bakes of aggregates, for example of leaves, depend on surfaces. Others do not, so that tinted copies of a rock share
/// an entry.
fn entry_name(
    source: &SourceArrays,
    config: &BakeConfig,
    together: Option<(&Member, &[SourceArrays])>,
    has_surfaces: bool,
) -> String {
    let mut hasher = cache::hasher(config);
    let index = together.map_or(0, |(member, _)| member.index);
    let has_units = together.is_some_and(|(member, _)| member.all.has_units);
    let all = together.map_or(slice::from_ref(source), |(_, sources)| sources);
    hasher.update(&[has_units.into()]);
    hasher.update(&index.to_le_bytes());
    hasher.update(&all.len().to_le_bytes());
    for source in all {
        hasher.update(&source.mesh_hash().0.to_le_bytes());
        hasher.update(&[source.has_other_attributes.into()]);
    }
    for source in all.iter().filter(|_| has_surfaces) {
        let hash = source.surface_hash();
        hasher.update(&[hash.is_some().into()]);
        hasher.update(&hash.unwrap_or_default().to_le_bytes());
    }
    cache::entry_name(&hasher)
}
