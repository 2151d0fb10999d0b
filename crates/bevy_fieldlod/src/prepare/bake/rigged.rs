//! Bakes skinned and morphed meshes from their glTF file.
//!
//! A bake needs more than the mesh: joints, inverse bind matrices, clips and the other primitives of the character are
//! in the file. The file is read again, and one bake makes the levels of all its skinned and morphed primitives.

use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock};

use bevy::asset::{AssetPath, AssetServer};
use bevy::tasks::block_on;
use fieldlod_bake::{
    BakeConfig, Import, MeshError, PrimitivePlace, bake_rigged, import_gltf_bytes,
};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive};
use xxhash_rust::xxh3::Xxh3;

use super::cache;
use crate::api::events::{LodError, LodOrigin};
use crate::lock;
use crate::prepare::job::FoundLevels;
use crate::prepare::sidecar::read;
use crate::prepare::source_arrays::SourceArrays;
use crate::prepare::threads::BakeThreads;

/// Caches glTF files and their bakes while meshes are being prepared.
#[derive(Default)]
pub(in crate::prepare) struct RiggedFiles(Vec<Arc<RiggedFile>>);

/// A glTF file and the bake of its skinned and morphed primitives.
pub(in crate::prepare) struct RiggedFile {
    path: AssetPath<'static>,
    config: BakeConfig,
    imported: OnceLock<Result<Imported, LodError>>,
    baked: OnceLock<Baked>,
}

/// The contents of a glTF file.
struct Imported {
    import: Import,
    /// Hash of the file and of the files beside it that it uses.
    hash: u128,
}

/// The hierarchies of a file, and why primitives have none.
type Baked = (BakedFile, Vec<(PrimitivePlace, MeshError)>);

impl RiggedFiles {
    /// The file at `path`.
    pub(in crate::prepare) fn find(
        &mut self,
        path: AssetPath<'static>,
        config: &BakeConfig,
    ) -> Arc<RiggedFile> {
        let mut files = self.0.iter();
        if let Some(found) = files.find(|file| file.path == path && file.config == *config) {
            return found.clone();
        }
        let file = Arc::new(RiggedFile {
            path,
            config: config.clone(),
            imported: OnceLock::new(),
            baked: OnceLock::new(),
        });
        self.0.push(file.clone());
        file
    }
}

/// The bake of a skinned or morphed primitive.
pub(in crate::prepare) struct RiggedBake {
    pub(in crate::prepare) assets: AssetServer,
    pub(in crate::prepare) file: Arc<RiggedFile>,
    pub(in crate::prepare) place: [u32; 2],
    pub(in crate::prepare) cache_folder: Option<PathBuf>,
    /// The threads to bake on; `None` if baking is disabled and only the cache is read.
    pub(in crate::prepare) threads: Option<BakeThreads>,
}

impl RiggedBake {
    /// Reads the hierarchy of `mesh` from the cache. Otherwise bakes the file, unless the task of another primitive has
    /// baked it.
    pub(in crate::prepare) fn run(&self, mesh: &SourceArrays) -> Result<FoundLevels, LodError> {
        // The first task reads the file; the tasks of its other primitives wait.
        let imported = self.file.imported.get_or_init(|| self.import());
        let imported = imported.as_ref().map_err(Clone::clone)?;
        let entry = self.entry(imported);
        if let Some(found) = entry.as_ref().and_then(|entry| cache::read(entry, mesh)) {
            return Ok(FoundLevels::stored(found, LodOrigin::Cache));
        }
        let threads = self.threads.as_ref().ok_or(LodError::BakeDisabled)?;
        let bake = || threads.run(|| bake(&imported.import, &self.file.config));
        let (file, faults) = self.file.baked.get_or_init(bake);
        let is_own =
            |place: &PrimitivePlace| self.place == [place.mesh_index, place.primitive_index];
        if let Some((_, fault)) = faults.iter().find(|(place, _)| is_own(place)) {
            return Err(fault.clone().into());
        }
        let found = mesh.find_hierarchy(file, Some(self.place), &self.name());
        // The program or the settings of the loader have changed the mesh.
        let found = found.map_err(|_| LodError::Rigged)?;
        Ok(FoundLevels {
            is_stored: entry.is_some_and(|entry| cache::write(&entry, &found)),
            hierarchy: found,
            origin: LodOrigin::Baked,
        })
    }

    fn name(&self) -> String {
        self.file.path.to_string()
    }

    fn import(&self) -> Result<Imported, LodError> {
        let path = &self.file.path;
        let bytes = block_on(read(&self.assets, path, path.path()));
        let bytes = bytes.ok_or_else(|| LodError::FileNotLoaded { file: self.name() })?;
        // Names are sorted, because files beside the glTF file are read in any order.
        let hashes: Mutex<BTreeMap<String, u128>> = Mutex::default();
        let beside = |name: &str| {
            let beside = path.path().with_file_name(name);
            let bytes = block_on(read(&self.assets, path, &beside));
            let bytes = bytes.ok_or(io::ErrorKind::NotFound)?;
            lock(&hashes).insert(name.into(), hash_of(&bytes));
            Ok(bytes)
        };
        let import = import_gltf_bytes(&bytes, &beside).map_err(|fault| LodError::InvalidGltf {
            file: self.name(),
            fault: fault.to_string(),
        })?;
        let mut hasher = Xxh3::new();
        hasher.update(&hash_of(&bytes).to_le_bytes());
        for hash in lock(&hashes).values() {
            hasher.update(&hash.to_le_bytes());
        }
        Ok(Imported {
            import,
            hash: hasher.digest128(),
        })
    }

    /// The path of the cache entry.
    fn entry(&self, imported: &Imported) -> Option<PathBuf> {
        let mut hasher = cache::hasher(&self.file.config);
        hasher.update(&imported.hash.to_le_bytes());
        for index in self.place {
            hasher.update(&index.to_le_bytes());
        }
        let name = cache::entry_name(&hasher);
        self.cache_folder.as_ref().map(|folder| folder.join(name))
    }
}

fn hash_of(bytes: &[u8]) -> u128 {
    xxhash_rust::xxh3::xxh3_128(bytes)
}

/// Bakes all skinned and morphed primitives of a file.
fn bake(import: &Import, config: &BakeConfig) -> Baked {
    let (mut primitives, mut faults) = (Vec::new(), Vec::new());
    for (place, result) in bake_rigged(import, config) {
        match result {
            Ok((hierarchy, _)) => primitives.push(BakedPrimitive::new(
                place.mesh_index,
                place.primitive_index,
                &place.name,
                hierarchy,
            )),
            Err(fault) => faults.push((place, fault)),
        }
    }
    (BakedFile { primitives }, faults)
}
