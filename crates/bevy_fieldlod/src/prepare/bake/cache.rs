//! A folder that caches baked hierarchies between runs.

use std::fmt::Display;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use bevy::log::warn;
use fieldlod_bake::BakeConfig;
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, FORMAT_VERSION, Hierarchy};
use xxhash_rust::xxh3::Xxh3;

use crate::prepare::source_arrays::SourceArrays;

/// The beginning of the hash that names an entry: the versions of plugin, format and baker, and the configuration.
pub(super) fn hasher(config: &BakeConfig) -> Xxh3 {
    let mut hasher = Xxh3::new();
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(&FORMAT_VERSION.to_le_bytes());
    hasher.update(fieldlod_bake::SOURCE_HASH.as_bytes());
    hasher.update(format!("{config:?}").as_bytes());
    hasher
}

/// The file name of an entry.
pub(super) fn entry_name(hasher: &Xxh3) -> String {
    format!("{:032x}.fieldlod", hasher.digest128())
}

/// Reads the entry of `source` at `path`, if it exists. Logs why an entry is unusable.
pub(super) fn read(path: &Path, source: &SourceArrays) -> Option<Hierarchy> {
    let unusable = |reason: &dyn Display| {
        let path = path.display();
        warn!("could not read the cache entry {path}: {reason}; baking the mesh again");
    };
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        // A folder that cannot be created is reported by `write`.
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return None;
        }
        Err(error) => {
            unusable(&error);
            return None;
        }
    };
    let file = BakedFile::from_bytes(&bytes);
    let file = file.inspect_err(|error| unusable(error)).ok()?;
    let found = source.find_hierarchy(&file, None, "the entry");
    let found = found.inspect_err(|_| unusable(&"it does not fit the mesh"));
    found.ok()
}

/// Writes the entry at `path` atomically. Returns whether it succeeded, and logs a
/// failure; the next run then bakes again.
pub(super) fn write(path: &Path, hierarchy: &Hierarchy) -> bool {
    let primitive = BakedPrimitive::new(0, 0, "", hierarchy.clone());
    let file = BakedFile {
        primitives: vec![primitive],
    };
    let written = write_atomically(path, &file.to_bytes());
    if let Err(error) = &written {
        warn!(
            "could not write the cache entry {}: {error}; the next run bakes the mesh again",
            path.display()
        );
    }
    written.is_ok()
}

fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // Two apps, or two tasks of one, may write the same entry at once.
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    // Renaming is atomic, so that a reader never finds half an entry.
    let unfinished = path.with_extension(format!("{}-{count}.part", std::process::id()));
    let written =
        std::fs::write(&unfinished, bytes).and_then(|()| std::fs::rename(&unfinished, path));
    if written.is_err() {
        // A failure leaves a file that no reader opens.
        let _ = std::fs::remove_file(&unfinished);
    }
    written
}
