//! Progress of a bake, summed over all threads.

use std::sync::atomic::{AtomicU64, Ordering};

/// Progress of a bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeProgress {
    /// Simplified triangles of all levels.
    pub triangles_done: u64,
    /// Estimated number of triangles to simplify. It may grow, and is never less than `triangles_done`.
    pub triangles_total: u64,
}

/// Sums the work of all threads.
pub(crate) struct Tracker<'a> {
    done: AtomicU64,
    total: AtomicU64,
    report: &'a (dyn Fn(BakeProgress) + Sync),
}

impl<'a> Tracker<'a> {
    /// Creates a tracker for primitives with these numbers of triangles.
    pub(crate) fn new(
        triangles: impl Iterator<Item = usize>,
        report: &'a (dyn Fn(BakeProgress) + Sync),
    ) -> Self {
        Self {
            done: AtomicU64::new(0),
            total: AtomicU64::new(triangles.map(expected_triangles).sum()),
            report,
        }
    }

    /// Progress of one primitive.
    pub(crate) fn share_of(&self, triangle_count: usize) -> Share<'_> {
        Share {
            tracker: Some(self),
            left: AtomicU64::new(expected_triangles(triangle_count)),
        }
    }

    fn add(&self, count: u64) {
        // Relaxed: the numbers are for display, and no other data depends on them.
        let before = self.done.fetch_add(count, Ordering::Relaxed);
        (self.report)(BakeProgress {
            triangles_done: before + count,
            triangles_total: self.total.load(Ordering::Relaxed),
        });
    }
}

/// Each level has about half the triangles of the next finer level.
fn expected_triangles(triangle_count: usize) -> u64 {
    triangle_count as u64 * 2
}

/// Progress of one primitive. The default reports nothing.
#[derive(Default)]
pub(crate) struct Share<'a> {
    tracker: Option<&'a Tracker<'a>>,
    /// Expected triangles that are not yet simplified.
    left: AtomicU64,
}

impl Share<'_> {
    /// Adds simplified triangles.
    pub(crate) fn add(&self, triangle_count: usize) {
        let Some(tracker) = self.tracker else {
            return;
        };
        let count = triangle_count as u64;
        let left = self.left.load(Ordering::Relaxed);
        // If there are more than expected, the total grows.
        let more = count.saturating_sub(left);
        tracker.total.fetch_add(more, Ordering::Relaxed);
        self.left.store(left + more - count, Ordering::Relaxed);
        tracker.add(count);
    }

    /// Adds the remaining expected triangles.
    pub(crate) fn finish(&self) {
        self.add(self.left.load(Ordering::Relaxed) as usize);
    }
}
