//! Memory budgets.

use std::time::Duration;

/// Memory budgets of pages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamSettings {
    /// Bytes of meshes on the GPU. The coarsest levels of all meshes may exceed it, nothing else.
    pub gpu_bytes: u64,
    /// Bytes of main memory of pages that are being loaded. One page at a time is always loaded.
    pub loading_bytes: u64,
    /// Pages that were unused for longer are evicted even if there is room.
    pub keep_unused: Duration,
}

impl Default for StreamSettings {
    /// 512 MiB on the GPU, 64 MiB of loading pages, five seconds.
    fn default() -> Self {
        Self {
            gpu_bytes: 512 << 20,
            loading_bytes: 64 << 20,
            keep_unused: Duration::from_secs(5),
        }
    }
}
