//! Bakes whole files: from a glTF file to the contents of a `.fieldlod` file.

use std::path::Path;

use fieldlod_hierarchy::{BakedFile, BakedPrimitive};
use rayon::prelude::*;

use crate::config::BakeConfig;
use crate::import::{
    Import, ImportError, ImportedPrimitive, ReadBeside, Skipped, UnreadImage, import_gltf,
    import_gltf_bytes,
};
use crate::mesh::SourceMesh;
use crate::plants::together::bake_together_with_progress;
use crate::progress::{BakeProgress, Share, Tracker};
use crate::report::BakeReport;

/// Primitives with at least this many triangles are drawn in units by default.
const IN_PIECES_FROM: usize = 20_000;

/// The levels of detail of all primitives of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOutcome {
    /// The hierarchies, ready to be written.
    pub file: BakedFile,
    /// Reports of the bake of each primitive of `file`, in the same order.
    pub reports: Vec<BakeReport>,
    /// Primitives that were skipped, and why.
    pub skipped: Vec<Skipped>,
    /// Images that could not be read. Surfaces with them count as unknown.
    pub unread_images: Vec<UnreadImage>,
}

/// Imports a `.gltf` or `.glb` file and bakes all its primitives, several at a time.
///
/// `progress` is called for every group, from several threads.
///
/// # Errors
/// The errors of [`import_gltf`] and [`bake_mesh`](crate::bake_mesh), and a file without primitives to bake.
pub fn bake_file(
    path: &Path,
    config: &BakeConfig,
    progress: &(dyn Fn(BakeProgress) + Sync),
) -> Result<BakeOutcome, ImportError> {
    bake_import(import_gltf(path)?, config, progress)
}

/// [`bake_file`] for the bytes of a file. `beside` reads external buffers and images by name.
///
/// # Errors
/// As [`bake_file`].
pub fn bake_file_bytes(
    bytes: &[u8],
    beside: &ReadBeside<'_>,
    config: &BakeConfig,
    progress: &(dyn Fn(BakeProgress) + Sync),
) -> Result<BakeOutcome, ImportError> {
    bake_import(import_gltf_bytes(bytes, beside)?, config, progress)
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
    // The primitives of one glTF mesh may be one plant.
    let meshes: Vec<&[ImportedPrimitive]> = import
        .primitives
        .chunk_by(|a, b| a.place.mesh_index == b.place.mesh_index)
        .collect();
    let in_parallel = meshes
        .par_iter()
        .map(|mesh| bake_primitives(mesh, config, &tracker));
    let baked = in_parallel.collect::<Result<Vec<_>, ImportError>>()?;
    let baked = baked.into_iter().flatten();
    let (primitives, reports) = baked.unzip();
    Ok(BakeOutcome {
        file: BakedFile { primitives },
        reports,
        skipped: import.skipped,
        unread_images: import.unread_images,
    })
}

/// The primitives of one glTF mesh.
fn bake_primitives(
    primitives: &[ImportedPrimitive],
    config: &BakeConfig,
    tracker: &Tracker<'_>,
) -> Result<Vec<(BakedPrimitive, BakeReport)>, ImportError> {
    let meshes: Vec<&SourceMesh> = primitives.iter().map(|primitive| &primitive.mesh).collect();
    let shares = meshes
        .iter()
        .map(|mesh| tracker.share_of(mesh.triangle_count()));
    let shares: Vec<Share<'_>> = shares.collect();
    // Primitives that are drawn in units are baked separately.
    let is_large = |mesh: &&SourceMesh| mesh.triangle_count() >= IN_PIECES_FROM;
    let config = &BakeConfig {
        together_below_triangles: if meshes.iter().any(is_large) {
            0
        } else {
            config.together_below_triangles
        },
        ..config.clone()
    };
    let baked =
        bake_together_with_progress(&meshes, config, &|mesh, count| shares[mesh].add(count));
    shares.iter().for_each(Share::finish);
    let finished = primitives.iter().zip(baked).map(|(primitive, baked)| {
        let place = &primitive.place;
        let (hierarchy, report) = baked.map_err(|fault| ImportError::Mesh {
            place: place.clone(),
            fault,
        })?;
        let (mesh, index) = (place.mesh_index, place.primitive_index);
        let baked = BakedPrimitive::new(mesh, index, &*place.name, hierarchy);
        Ok((baked, report))
    });
    finished.collect()
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
