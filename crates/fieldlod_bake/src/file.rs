//! Whole files: one way from a glTF file to the contents of a `.fieldlod` file.

use std::path::Path;

use fieldlod_hierarchy::{BakedFile, BakedPrimitive};
use rayon::prelude::*;

use crate::bake::bake_mesh_with_progress;
use crate::config::BakeConfig;
use crate::import::{
    Import, ImportError, ImportedPrimitive, Skipped, UnreadImage, import_gltf, import_gltf_bytes,
};
use crate::progress::{BakeProgress, Tracker};
use crate::report::BakeReport;

/// The levels of detail of all primitives of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOutcome {
    /// The hierarchies, ready to be written.
    pub file: BakedFile,
    /// Reports of the bake of each primitive of `file`, in the same order.
    pub reports: Vec<BakeReport>,
    /// The primitives that have no levels of detail, and why.
    pub skipped: Vec<Skipped>,
    /// The images that could not be read: what has them was baked as if nothing were known of its surface.
    pub unread_images: Vec<UnreadImage>,
}

/// Imports a `.gltf` or `.glb` file and bakes all its primitives, several at a time.
///
/// `progress` hears of every group, from several threads.
///
/// # Errors
/// Whatever [`import_gltf`] refuses, a mesh that [`bake_mesh`](crate::bake_mesh) refuses, and a
/// file without anything to bake.
pub fn bake_file(
    path: &Path,
    config: &BakeConfig,
    progress: &(dyn Fn(BakeProgress) + Sync),
) -> Result<BakeOutcome, ImportError> {
    bake_import(import_gltf(path)?, config, progress)
}

/// [`bake_file`] for the bytes of a file. Buffers and images beside it are looked for in `folder`.
///
/// # Errors
/// As [`bake_file`].
pub fn bake_file_bytes(
    bytes: &[u8],
    folder: &Path,
    config: &BakeConfig,
    progress: &(dyn Fn(BakeProgress) + Sync),
) -> Result<BakeOutcome, ImportError> {
    bake_import(import_gltf_bytes(bytes, folder)?, config, progress)
}

fn bake_import(
    import: Import,
    config: &BakeConfig,
    progress: &(dyn Fn(BakeProgress) + Sync),
) -> Result<BakeOutcome, ImportError> {
    if import.primitives.is_empty() {
        return Err(nothing_to_bake(&import.skipped));
    }
    let triangles = import.primitives.iter().map(|p| p.mesh.triangle_count());
    let tracker = Tracker::new(triangles, progress);
    let primitives = import.primitives.par_iter();
    let in_parallel = primitives.map(|primitive| bake_primitive(primitive, config, &tracker));
    let baked = in_parallel.collect::<Result<Vec<_>, ImportError>>()?;
    let (primitives, reports) = baked.into_iter().unzip();
    Ok(BakeOutcome {
        file: BakedFile { primitives },
        reports,
        skipped: import.skipped,
        unread_images: import.unread_images,
    })
}

fn bake_primitive(
    primitive: &ImportedPrimitive,
    config: &BakeConfig,
    tracker: &Tracker<'_>,
) -> Result<(BakedPrimitive, BakeReport), ImportError> {
    let share = tracker.share_of(primitive.mesh.triangle_count());
    let baked = bake_mesh_with_progress(&primitive.mesh, config, &|count| share.add(count));
    share.finish();
    let (hierarchy, report) = baked.map_err(|fault| ImportError::Mesh {
        place: primitive.place.clone(),
        fault,
    })?;
    let place = &primitive.place;
    let (mesh, index) = (place.mesh_index, place.primitive_index);
    let baked = BakedPrimitive::new(mesh, index, &*place.name, hierarchy);
    Ok((baked, report))
}

fn nothing_to_bake(skipped: &[Skipped]) -> ImportError {
    match skipped.first() {
        Some(first) => ImportError::AllSkipped {
            count: skipped.len(),
            place: first.place.clone(),
            reason: first.reason,
        },
        None => ImportError::NoMeshes,
    }
}
