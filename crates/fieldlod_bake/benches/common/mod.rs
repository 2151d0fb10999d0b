//! What several benches need.

use std::path::Path;

use fieldlod_bake::{SourceMesh, import_gltf};

/// The largest primitive of each glTF file in the folder that `FIELDLOD_MODELS` names; none if it
/// names none.
pub(crate) fn models() -> Vec<(String, SourceMesh)> {
    let Some(folder) = std::env::var_os("FIELDLOD_MODELS") else {
        return Vec::new();
    };
    let entries = std::fs::read_dir(folder).expect("FIELDLOD_MODELS names a folder");
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

/// How long this thread has run on a core, as Linux counts it: the time of others is left out.
pub(crate) fn seconds_on_core() -> Option<f64> {
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(times.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
}
