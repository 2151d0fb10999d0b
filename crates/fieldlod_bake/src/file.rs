//! Whole files.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use fieldlod_hierarchy::{BakedFile, BakedPrimitive};
use rayon::prelude::*;

use crate::bake::bake_mesh_with_progress;
use crate::config::BakeConfig;
use crate::import::{
    Import, ImportError, ImportedPrimitive, Skipped, import_gltf, import_gltf_bytes,
};
use crate::report::BakeReport;

/// How far a bake has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeProgress {
    /// Triangles of all levels worked off so far.
    pub triangles_done: u64,
    /// How many there will be, each counted once for simplifying and once for measuring: an
    /// estimate, never less than `triangles_done`. It grows when a mesh must be built again.
    pub triangles_total: u64,
}

/// The levels of detail of all primitives of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOutcome {
    /// The hierarchies, ready to be written.
    pub file: BakedFile,
    /// How the bake of each primitive of `file` went, in the same order.
    pub reports: Vec<BakeReport>,
    /// The primitives that have none, and why.
    pub skipped: Vec<Skipped>,
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

/// [`bake_file`] for the bytes of a file. Buffers beside it are looked for in `folder`.
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
    let tracker = Tracker::new(&import.primitives, progress);
    let baked = import.primitives.par_iter();
    let baked = baked.map(|primitive| bake_primitive(primitive, config, &tracker));
    let baked = baked.collect::<Result<Vec<_>, ImportError>>()?;
    let (primitives, reports) = baked.into_iter().unzip();
    Ok(BakeOutcome {
        file: BakedFile { primitives },
        reports,
        skipped: import.skipped,
    })
}

fn bake_primitive(
    primitive: &ImportedPrimitive,
    config: &BakeConfig,
    tracker: &Tracker<'_>,
) -> Result<(BakedPrimitive, BakeReport), ImportError> {
    let share = tracker.share_of(primitive);
    let baked = bake_mesh_with_progress(&primitive.mesh, config, &|count| share.add(count));
    share.finish();
    let (mut hierarchy, report) = baked.map_err(|fault| ImportError::Mesh {
        place: primitive.place(),
        fault,
    })?;
    primitive.extra.give_to(&mut hierarchy.vertices);
    let (mesh, index) = (primitive.mesh_index, primitive.primitive_index);
    let baked = BakedPrimitive::new(mesh, index, &*primitive.name, hierarchy);
    Ok((baked, report))
}

fn nothing_to_bake(skipped: &[Skipped]) -> ImportError {
    match skipped.first() {
        Some(first) => ImportError::AllSkipped {
            count: skipped.len(),
            place: first.place(),
            reason: first.reason,
        },
        None => ImportError::NoMeshes,
    }
}

/// Adds up the work of all threads.
struct Tracker<'a> {
    done: AtomicU64,
    total: AtomicU64,
    report: &'a (dyn Fn(BakeProgress) + Sync),
}

impl<'a> Tracker<'a> {
    fn new(primitives: &[ImportedPrimitive], report: &'a (dyn Fn(BakeProgress) + Sync)) -> Self {
        let expected = primitives.iter().map(expected_triangles);
        Self {
            done: AtomicU64::new(0),
            total: AtomicU64::new(expected.sum()),
            report,
        }
    }

    fn share_of(&self, primitive: &ImportedPrimitive) -> Share<'_> {
        let expected = expected_triangles(primitive);
        Share {
            tracker: self,
            build: expected / PASSES,
            left_in_build: AtomicU64::new(expected / PASSES),
            left: AtomicU64::new(expected),
        }
    }

    fn add(&self, count: u64) {
        let before = self.done.fetch_add(count, Ordering::Relaxed);
        (self.report)(BakeProgress {
            triangles_done: before + count,
            triangles_total: self.total.load(Ordering::Relaxed),
        });
    }
}

/// Triangles are simplified, and then measured.
const PASSES: u64 = 2;

/// Each level has half the triangles of the one before.
fn expected_triangles(primitive: &ImportedPrimitive) -> u64 {
    primitive.mesh.triangle_count() as u64 * 2 * PASSES
}

/// What one primitive adds: in the end as much as was expected of it.
struct Share<'a> {
    tracker: &'a Tracker<'a>,
    /// What a build is expected to add.
    build: u64,
    left_in_build: AtomicU64,
    left: AtomicU64,
}

impl Share<'_> {
    /// More triangles than a build has: the mesh is being built once more, and there is more to
    /// do than was expected.
    fn add(&self, count: usize) {
        let count = count as u64;
        let mut left_in_build = self.left_in_build.load(Ordering::Relaxed);
        if left_in_build < count {
            let more = self.build.max(count);
            self.tracker.total.fetch_add(more, Ordering::Relaxed);
            self.left.fetch_add(more, Ordering::Relaxed);
            left_in_build += more;
        }
        self.left_in_build
            .store(left_in_build - count, Ordering::Relaxed);
        self.left.fetch_sub(count, Ordering::Relaxed);
        self.tracker.add(count);
    }

    fn finish(&self) {
        self.tracker.add(self.left.swap(0, Ordering::Relaxed));
    }
}
