//! Memory budgets.

use std::time::Duration;

/// Memory budgets for pages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamSettings {
    /// Budget of meshes on the GPU, in bytes. First pages may exceed it, and so may pages in use after the budget is
    /// reduced.
    pub gpu_bytes: u64,
    /// Budget of main memory for pages that are being loaded, in bytes. A single page may exceed it.
    pub loading_bytes: u64,
    /// Pages that are unused for longer than this are evicted even if there is room. Short times load pages again after
    /// the camera looks away for a moment; long times hold memory that nothing uses.
    pub keep_unused: Duration,
}

impl Default for StreamSettings {
    /// 512 MiB on the GPU, 64 MiB for loading, five seconds.
    fn default() -> Self {
        Self {
            gpu_bytes: 512 << 20,
            loading_bytes: 64 << 20,
            keep_unused: Duration::from_secs(5),
        }
    }
}
