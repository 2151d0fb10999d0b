//! Shared helpers of the benches.

use std::path::Path;

use fieldlod_bake::{SourceMesh, import_gltf};

/// Largest primitive of each glTF file in the folder `FIELDLOD_MODELS`; empty if the variable is not set.
pub(crate) fn models() -> Vec<(String, SourceMesh)> {
    let Some(folder) = std::env::var_os("FIELDLOD_MODELS") else {
        return Vec::new();
    };
    let entries = std::fs::read_dir(folder).expect("could not read the folder FIELDLOD_MODELS");
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let largest = |path: &Path| {
        let primitives = import_gltf(path).ok()?.primitives.into_iter();
        let largest = primitives.max_by_key(|p| p.mesh.triangle_count())?;
        let name = path.file_stem()?.to_string_lossy().into_owned();
        Some((name, largest.mesh))
    };
    paths.iter().filter_map(|path| largest(path)).collect()
}

/// Time that this thread has run on a core; `None` outside of Linux.
pub(crate) fn seconds_on_core() -> Option<f64> {
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(times.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
}
