//! What users can know of memory.

use bevy::prelude::*;
use fieldlod_stream::Residency;

/// How much of the meshes of `.fieldpages` files is in memory, under the budgets of
/// [`FieldLodConfig::memory`](crate::FieldLodConfig::memory). The plugin keeps it up to date.
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
    /// Bytes on the GPU that what is being loaded will take; room is kept for them.
    pub coming_bytes: u64,
    /// Bytes of main memory that what is being loaded takes.
    pub loading_bytes: u64,
    /// Bytes on the GPU of all that views drew or wanted in the last frame.
    pub wanted_bytes: u64,
    /// Pages that views wanted in the last frame and that are not there; what they hold is drawn coarser.
    pub missing_pages: u32,
    /// Pages loaded since the beginning.
    pub loaded_pages: u64,
    /// Bytes of these in their files. Readers may read more, beside them.
    pub loaded_file_bytes: u64,
    /// Pages evicted since the beginning.
    pub evicted_pages: u64,
    /// How often a page could not be read since the beginning.
    pub failures: u64,
    /// By what the errors that views allow are multiplied, so that what they want fits: 1 if all does.
    pub coarsening: f32,
}

impl Default for FieldLodMemory {
    /// Nothing, and no need to be coarser.
    fn default() -> Self {
        Self {
            resident_bytes: 0,
            coming_bytes: 0,
            loading_bytes: 0,
            wanted_bytes: 0,
            missing_pages: 0,
            loaded_pages: 0,
            loaded_file_bytes: 0,
            evicted_pages: 0,
            failures: 0,
            coarsening: 1.0,
        }
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
            loaded_file_bytes: statistics.loaded_file_bytes,
            evicted_pages: statistics.evicted,
            failures: statistics.failed,
            coarsening: residency.coarsening(),
        }
    }
}
