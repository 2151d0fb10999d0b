//! Whole files.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use fieldlod_hierarchy::{BakedFile, BakedPrimitive};
use rayon::prelude::*;

use crate::bake::bake_mesh_with_progress;
use crate::{BakeConfig, ImportError, ImportedPrimitive, Skipped, import_gltf};

/// How far a bake has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeProgress {
    /// Triangles of all levels worked off so far.
    pub triangles_done: u64,
    /// How many there will be: an estimate, never less than `triangles_done`.
    pub triangles_total: u64,
}

/// What came of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOutcome {
    /// The hierarchies, ready to be written.
    pub file: BakedFile,
    /// The primitives that have none, and why.
    pub skipped: Vec<Skipped>,
}

/// Imports a glTF file and bakes all its primitives, several at a time.
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
    let import = import_gltf(path)?;
    if import.primitives.is_empty() {
        return Err(nothing_to_bake(&import.skipped));
    }
    let tracker = Tracker::new(&import.primitives, progress);
    let primitives = import.primitives.par_iter().map(|primitive| {
        let share = tracker.share_of(primitive);
        let hierarchy = bake_mesh_with_progress(&primitive.mesh, config, &|count| share.add(count));
        share.finish();
        let (mut hierarchy, _report) = hierarchy.map_err(|fault| ImportError::Mesh {
            place: primitive.place(),
            fault,
        })?;
        primitive.extra.give_to(&mut hierarchy.vertices);
        let ImportedPrimitive {
            mesh_index,
            primitive_index,
            name,
            ..
        } = primitive;
        Ok(BakedPrimitive::new(
            *mesh_index,
            *primitive_index,
            name,
            hierarchy,
        ))
    });
    Ok(BakeOutcome {
        file: BakedFile {
            primitives: primitives.collect::<Result<_, ImportError>>()?,
        },
        skipped: import.skipped,
    })
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
    total: u64,
    report: &'a (dyn Fn(BakeProgress) + Sync),
}

impl<'a> Tracker<'a> {
    fn new(primitives: &[ImportedPrimitive], report: &'a (dyn Fn(BakeProgress) + Sync)) -> Self {
        Self {
            done: AtomicU64::new(0),
            total: primitives.iter().map(expected_triangles).sum(),
            report,
        }
    }

    fn share_of(&self, primitive: &ImportedPrimitive) -> Share<'_> {
        Share {
            tracker: self,
            left: AtomicU64::new(expected_triangles(primitive)),
        }
    }

    fn add(&self, count: u64) {
        let before = self.done.fetch_add(count, Ordering::Relaxed);
        (self.report)(BakeProgress {
            triangles_done: before + count,
            triangles_total: self.total,
        });
    }
}

/// Each level has half the triangles of the one before.
fn expected_triangles(primitive: &ImportedPrimitive) -> u64 {
    primitive.mesh.triangle_count() as u64 * 2
}

/// What one primitive may add: no more than expected, and in the end no less.
struct Share<'a> {
    tracker: &'a Tracker<'a>,
    left: AtomicU64,
}

impl Share<'_> {
    fn add(&self, count: usize) {
        let left = self.left.load(Ordering::Relaxed);
        let count = left.min(count as u64);
        self.left.store(left - count, Ordering::Relaxed);
        self.tracker.add(count);
    }

    fn finish(&self) {
        self.tracker.add(self.left.swap(0, Ordering::Relaxed));
    }
}
