//! Bakes meshes that are not in the cache.

use std::path::PathBuf;
use std::slice;
use std::sync::Arc;

use fieldlod_bake::{BakeConfig, Surface, bake_mesh_with_report};
use fieldlod_hierarchy::{BakedFile, FORMAT_VERSION, Hierarchy};
use xxhash_rust::xxh3::Xxh3;

use super::cache;
use super::together::Member;
use crate::api::events::{LodError, LodOrigin};
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
        let member = self.member.as_ref().filter(|_| self.threads.is_some());
        let all = member.and_then(Member::sources).unwrap_or_default();
        let mut found = all.iter().map(|one| one.find_hierarchy(baked, None, file));
        found.try_for_each(|found| found.map(drop))
    }

    /// Reads the hierarchy of `source` from the cache, or else bakes and caches it.
    pub(in crate::prepare) fn run(
        &self,
        source: SourceArrays,
    ) -> Result<(Hierarchy, LodOrigin), LodError> {
        let source = SourceArrays {
            surface: self.surface.clone(),
            ..source
        };
        // The mesh may have changed since its group was collected.
        let is_same = |found: &SourceArrays| found.has_same_mesh_as(&source);
        let all = self.member.as_ref();
        let all = all.and_then(|member| Some((member, member.sources()?)));
        let all = all.filter(|(member, sources)| is_same(&sources[member.index()]));
        let together = all
            .as_ref()
            .map(|(member, sources)| (member.index(), &**sources));
        let names = EntryNames::of(&source, &self.config, together);
        let folder = self.cache_folder.as_ref();
        let path = |name: &String| folder.map(|folder| folder.join(name));
        let mut paths = [&names.of_any_surface, &names.of_surfaces]
            .into_iter()
            .filter_map(path);
        if let Some(found) = paths.find_map(|path| cache::read(&path, &source)) {
            return Ok((found, LodOrigin::Cache));
        }
        let threads = self.threads.as_ref().ok_or(LodError::BakeDisabled)?;
        let (baked, report) = match all {
            Some((member, sources)) => member.bake(sources, threads)?,
            None => threads.run(|| bake_mesh_with_report(&source.into_mesh(), &self.config))?,
        };
        // Only bakes of aggregates, such as leaves, depend on surfaces.
        let name = if report.has_aggregates {
            &names.of_surfaces
        } else {
            &names.of_any_surface
        };
        if let Some(path) = path(name) {
            cache::write(&path, &baked);
        }
        Ok((baked, LodOrigin::Baked))
    }
}

/// The names of cache entries: hashes of the inputs of a bake.
struct EntryNames {
    /// For bakes that do not depend on surfaces: tinted copies of a rock share it.
    of_any_surface: String,
    of_surfaces: String,
}

impl EntryNames {
    /// `together` is the index of the mesh in its group, and the meshes of the group.
    fn of(
        source: &SourceArrays,
        config: &BakeConfig,
        together: Option<(usize, &[SourceArrays])>,
    ) -> Self {
        let mut hasher = Xxh3::new();
        // Another version may bake differently or write another format.
        hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
        hasher.update(&FORMAT_VERSION.to_le_bytes());
        hasher.update(&fieldlod_bake::REVISION.to_le_bytes());
        hasher.update(format!("{config:?}").as_bytes());
        let (index, all) = together.unwrap_or((0, slice::from_ref(source)));
        hasher.update(&index.to_le_bytes());
        hasher.update(&all.len().to_le_bytes());
        for source in all {
            let mesh = source.vertices.source_hash(&source.indices);
            hasher.update(&mesh.0.to_le_bytes());
            hasher.update(&[source.has_other_attributes.into()]);
        }
        let name = |hasher: &Xxh3| format!("{:032x}.fieldlod", hasher.digest128());
        let of_any_surface = name(&hasher);
        for source in all {
            let surface = source.surface.as_ref().map(|surface| surface.to_bytes());
            hasher.update(&[surface.is_some().into()]);
            hasher.update(&surface.unwrap_or_default());
        }
        Self {
            of_any_surface,
            of_surfaces: name(&hasher),
        }
    }
}
