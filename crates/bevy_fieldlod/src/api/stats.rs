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
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
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
}

impl FieldLodProgress {
    /// The share of entities that are ready or plain, from 0 to 1. It is 0 while there are no entities: a scene that is
    /// being loaded has none yet.
    #[must_use]
    pub fn share_done(&self) -> f32 {
        let done = self.ready + self.plain;
        let all = done + self.waiting;
        done as f32 / all.max(1) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn share_done_counts_waiting_entities() {
        let mut progress = FieldLodProgress::default();
        assert_eq!(progress.share_done(), 0.0);
        progress.waiting = 3;
        assert_eq!(progress.share_done(), 0.0);
        progress.plain = 1;
        assert_eq!(progress.share_done(), 0.25);
        (progress.waiting, progress.ready) = (0, 3);
        assert_eq!(progress.share_done(), 1.0);
    }
}
