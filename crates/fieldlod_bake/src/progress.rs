//! Progress of a bake, summed over all threads.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Progress of a bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeProgress {
    /// Simplified triangles of all levels.
    pub triangles_done: u64,
    /// Estimated number of triangles to simplify. It may grow, and is never less than `triangles_done`.
    pub triangles_total: u64,
}

/// Sums the work of all threads. The default reports nothing.
#[derive(Default)]
pub(crate) struct Progress<'a> {
    done: AtomicU64,
    /// Expected triangles that are not yet simplified.
    left: AtomicU64,
    report: Option<&'a (dyn Fn(BakeProgress) + Sync)>,
}

impl<'a> Progress<'a> {
    /// Progress of primitives with these triangles in all. Each level has about half the triangles of the finer one.
    pub(crate) fn new(triangles: usize, report: &'a (dyn Fn(BakeProgress) + Sync)) -> Self {
        Self {
            done: AtomicU64::new(0),
            left: AtomicU64::new(triangles as u64 * 2),
            report: Some(report),
        }
    }

    /// Adds simplified triangles. If there are more than expected, the total grows.
    pub(crate) fn add(&self, triangle_count: usize) {
        let Some(report) = self.report else {
            return;
        };
        let count = triangle_count as u64;
        // `left` shrinks first, so that no sum of both is too large. Relaxed: the numbers are for display.
        let less = |left: u64| Some(left.saturating_sub(count));
        let _ = self.left.fetch_update(Relaxed, Relaxed, less);
        let triangles_done = self.done.fetch_add(count, Relaxed) + count;
        report(BakeProgress {
            triangles_done,
            triangles_total: triangles_done + self.left.load(Relaxed),
        });
    }

    /// Adds the remaining expected triangles.
    pub(crate) fn finish(&self) {
        self.add(self.left.load(Relaxed) as usize);
    }
}
