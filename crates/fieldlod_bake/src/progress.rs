//! How far a bake has come, added up over all threads.

use std::sync::atomic::{AtomicU64, Ordering};

/// How far a bake has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeProgress {
    /// Triangles of all levels worked off so far.
    pub triangles_done: u64,
    /// How many there will be, each counted once for simplifying and once for measuring: an
    /// estimate, never less than `triangles_done`. It grows when a mesh must be built again.
    pub triangles_total: u64,
}

/// Adds up the work of all threads.
pub(crate) struct Tracker<'a> {
    done: AtomicU64,
    total: AtomicU64,
    report: &'a (dyn Fn(BakeProgress) + Sync),
}

impl<'a> Tracker<'a> {
    /// For primitives with so many `triangles` each.
    pub(crate) fn new(
        triangles: impl Iterator<Item = usize>,
        report: &'a (dyn Fn(BakeProgress) + Sync),
    ) -> Self {
        let expected = triangles.map(expected_triangles);
        Self {
            done: AtomicU64::new(0),
            total: AtomicU64::new(expected.sum()),
            report,
        }
    }

    /// The work on a primitive with so many triangles.
    pub(crate) fn share_of(&self, triangle_count: usize) -> Share<'_> {
        let expected = expected_triangles(triangle_count);
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
fn expected_triangles(triangle_count: usize) -> u64 {
    triangle_count as u64 * 2 * PASSES
}

/// What one primitive adds: in the end as much as was expected of it.
pub(crate) struct Share<'a> {
    tracker: &'a Tracker<'a>,
    /// What a build is expected to add.
    build: u64,
    left_in_build: AtomicU64,
    left: AtomicU64,
}

impl Share<'_> {
    /// Adds triangles that were worked off.
    pub(crate) fn add(&self, triangle_count: usize) {
        let count = triangle_count as u64;
        let mut left_in_build = self.left_in_build.load(Ordering::Relaxed);
        // More triangles than a build has: the mesh is being built once more, and there is more to
        // do than was expected.
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

    /// Adds all that was expected and is left.
    pub(crate) fn finish(&self) {
        self.tracker.add(self.left.swap(0, Ordering::Relaxed));
    }
}
