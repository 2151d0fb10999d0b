//! Shared helpers of the benches.

use std::path::{Path, PathBuf};

use fieldlod_bake::{Import, SourceMesh, import_gltf};

/// The glTF files in the folder `FIELDLOD_MODELS`; none if the variable is not set.
pub(crate) fn files() -> Vec<(String, Import)> {
    let Some(folder) = std::env::var_os("FIELDLOD_MODELS") else {
        return Vec::new();
    };
    let entries = std::fs::read_dir(folder).expect("could not read the folder FIELDLOD_MODELS");
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let file = |path: &Path| {
        let name = path.file_stem()?.to_string_lossy().into_owned();
        Some((name, import_gltf(path).ok()?))
    };
    paths.iter().filter_map(|path| file(path)).collect()
}

/// The largest primitive of each of the [`files`].
#[allow(dead_code, reason = "some benches bake whole files")]
pub(crate) fn models() -> Vec<(String, SourceMesh)> {
    let largest = |(name, file): (String, Import)| {
        let primitives = file.primitives.into_iter();
        let largest = primitives.max_by_key(|p| p.mesh.triangle_count())?;
        Some((name, largest.mesh))
    };
    files().into_iter().filter_map(largest).collect()
}

/// Time that this thread has run on a core; `None` outside of Linux.
pub(crate) fn seconds_on_core() -> Option<f64> {
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(times.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
}
