//! Budgets.

use std::time::Duration;

/// How much memory pages may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamSettings {
    /// Bytes of meshes on the GPU. The coarsest levels of all meshes may exceed it, nothing else.
    pub gpu_bytes: u64,
    /// Bytes of main memory of pages that are being read and sent to the GPU, where they do not stay. One
    /// page at a time is always read.
    pub loading_bytes: u64,
    /// Pages that were not in use for longer are evicted though there is room for them.
    pub keep_unused: Duration,
}

impl Default for StreamSettings {
    /// 512 MiB on the GPU, 64 MiB on their way there; five seconds.
    fn default() -> Self {
        Self {
            gpu_bytes: 512 << 20,
            loading_bytes: 64 << 20,
            keep_unused: Duration::from_secs(5),
        }
    }
}
