//! Statistics of cameras, and the progress of preparation.

use std::time::Duration;

use bevy::prelude::*;

/// Statistics of a camera's last selection, over all meshes with levels of detail on its layers. They count what
/// was selected, before frustum culling. The plugin keeps them up to date on every 3D camera. All are zero while the
/// camera is inactive or has no pixels, as in a minimised window.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct FieldLodViewStats {
    /// Triangles of the selected levels.
    pub triangles_drawn: u64,
    /// Triangles of the source meshes.
    pub triangles_full: u64,
    /// Units and whole meshes that were selected.
    pub units_drawn: u32,
    /// The error threshold of the selection, in pixels; with a triangle budget, the threshold that fits the budget.
    pub error_px: f32,
    /// Time that the selection took.
    pub selection_time: Duration,
    /// Pieces of `.fieldpages` files that this camera needs and that are not in memory.
    pub missing_pieces: u32,
    /// The largest error, in pixels, of the coarser pieces that are drawn in place of the missing ones.
    pub missing_px: f32,
}

/// The number of mesh entities under an [`AutoLod`](crate::AutoLod), by their state.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn show(progress: Res<FieldLodProgress>, mut bar: Single<&mut Node, With<Name>>) {
///     bar.width = percent(100.0 * progress.share_done());
/// }
/// # bevy::ecs::system::assert_is_system(show);
/// ```
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Resource, Clone, Default, PartialEq)]
pub struct FieldLodProgress {
    /// Entities whose mesh is being loaded, baked or uploaded. Their source mesh is drawn.
    pub waiting: u32,
    /// Meshes, not entities, in background tasks.
    pub baking: u32,
    /// Entities with levels of detail.
    pub ready: u32,
    /// Entities whose source mesh is drawn, because it is small or cannot have levels of detail.
    pub plain: u32,
    /// Scenes and files that are being loaded, whose mesh entities do not exist yet: entities under an `AutoLod` with a
    /// [`WorldAssetRoot`](bevy::world_serialization::WorldAssetRoot), and [`LodMesh3d`](crate::LodMesh3d)s.
    pub loading: u32,
    pub(crate) share_done: f32,
}

impl FieldLodProgress {
    /// The share of all requests that is ready or plain, from 0 to 1, for a progress bar. It never decreases until
    /// everything is done, although the number of entities in a scene is not known before the scene is loaded: a scene
    /// that is being loaded counts as much as the average of the others. After new requests, it starts again. It is 0
    /// while there are no entities.
    #[must_use]
    pub fn share_done(&self) -> f32 {
        self.share_done
    }

    /// Updates the counts; `scenes` is the number of scenes and files that are loaded or being loaded.
    pub(crate) fn update(&mut self, counts: Self, scenes: u32) {
        let done = counts.ready + counts.plain;
        let arrived = 1.0 - counts.loading as f32 / scenes.max(1) as f32;
        let share = arrived * done as f32 / (done + counts.waiting).max(1) as f32;
        // Scenes that arrive add entities that wait.
        let is_done = self.share_done == 1.0 || done == 0;
        *self = Self {
            share_done: if is_done {
                share
            } else {
                share.max(self.share_done)
            },
            ..counts
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn share_done_never_decreases_before_the_end() {
        let mut progress = FieldLodProgress::default();
        let mut share_after = |waiting, ready, loading, scenes| {
            let counts = FieldLodProgress {
                waiting,
                ready,
                loading,
                ..FieldLodProgress::default()
            };
            progress.update(counts, scenes);
            progress.share_done()
        };
        assert_eq!(share_after(0, 0, 0, 0), 0.0);
        assert_eq!(share_after(0, 0, 2, 2), 0.0);
        assert_eq!(share_after(100, 0, 1, 2), 0.0);
        assert_eq!(share_after(0, 100, 1, 2), 0.5);
        assert_eq!(share_after(300, 100, 0, 2), 0.5);
        assert_eq!(share_after(100, 300, 0, 2), 0.75);
        assert_eq!(share_after(0, 400, 0, 2), 1.0);
        // New requests.
        assert_eq!(share_after(100, 400, 0, 2), 0.8);
        assert_eq!(share_after(0, 0, 0, 0), 0.0);
    }
}
