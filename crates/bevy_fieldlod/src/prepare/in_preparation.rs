//! How much work is in the background tasks.

/// The work of all running tasks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InPreparation {
    pub(super) meshes: u32,
    triangles: u32,
}

/// Largest number of meshes in tasks, running or queued. With more, more copies of source meshes are in memory; with
/// fewer than there are threads, threads are idle.
const MOST_IN_PREPARATION: u32 = 64;
/// Largest number of triangles in tasks. A bake needs some hundred bytes per triangle, so all bakes need about a
/// gigabyte at most. With fewer, large meshes wait for each other. A larger mesh is prepared alone.
const MOST_TRIANGLES_IN_PREPARATION: u32 = 4_000_000;

impl InPreparation {
    /// Adds a task with this many triangles.
    pub(super) fn with(self, triangles: u32) -> Self {
        Self {
            meshes: self.meshes + 1,
            triangles: self.triangles.saturating_add(triangles),
        }
    }

    /// Whether a mesh with this many triangles may be started.
    pub(super) fn has_room(self, triangles: u32) -> bool {
        let with = self.with(triangles);
        self.meshes == 0
            || with.meshes <= MOST_IN_PREPARATION && with.triangles <= MOST_TRIANGLES_IN_PREPARATION
    }
}
