//! The memory of streamed meshes.

use bevy::prelude::*;
use fieldlod_stream::Residency;

/// The memory of the meshes of `.fieldpages` files, which have the budgets of
/// [`FieldLodAppConfig::memory`](crate::FieldLodAppConfig::memory). The plugin keeps it up to date.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::FieldLodMemory;
/// fn show(memory: Res<FieldLodMemory>) {
///     if memory.is_changed() && memory.missing_pages > 0 {
///         println!("{} pages are missing", memory.missing_pages);
///     }
/// }
/// # bevy::ecs::system::assert_is_system(show);
/// ```
#[derive(Resource, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Resource, Clone, Default, PartialEq)]
pub struct FieldLodMemory {
    /// Bytes of meshes on the GPU.
    pub resident_bytes: u64,
    /// Bytes on the GPU that are reserved for pages that are being loaded.
    pub coming_bytes: u64,
    /// Bytes of main memory of pages that are being loaded.
    pub loading_bytes: u64,
    /// Bytes on the GPU of all pages that views needed in the last frame.
    pub wanted_bytes: u64,
    /// Pages that views needed in the last frame and that are not loaded. Coarser geometry is drawn instead.
    pub missing_pages: u32,
    /// Total number of loaded pages.
    pub loaded_pages: u64,
    /// Total number of evicted pages.
    pub evicted_pages: u64,
    /// Total number of failed reads.
    pub failures: u64,
    /// Factor of the error thresholds of views. It grows until the needed pages fit the GPU budget; 1 if all fit.
    pub coarsening: f32,
}

impl Default for FieldLodMemory {
    /// Nothing is loaded; the coarsening is 1.
    fn default() -> Self {
        Self::of(&Residency::default())
    }
}

impl FieldLodMemory {
    pub(super) fn of(residency: &Residency) -> Self {
        let statistics = residency.statistics();
        Self {
            resident_bytes: statistics.resident_bytes,
            coming_bytes: statistics.loading_gpu_bytes,
            loading_bytes: statistics.loading_bytes,
            wanted_bytes: statistics.wanted_bytes,
            missing_pages: statistics.missing_pages,
            loaded_pages: statistics.loaded,
            evicted_pages: statistics.evicted,
            failures: statistics.failed,
            coarsening: residency.coarsening(),
        }
    }
}
