//! Statistics: what each camera draws, and how far the meshes of the world have come.

use std::time::Duration;

use bevy::prelude::*;

/// What a camera drew in the last frame of the meshes that have levels of detail, after frustum
/// culling. The plugin keeps it up to date on every camera.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct FieldLodViewStats {
    /// Triangles drawn by this camera.
    pub triangles_drawn: u64,
    /// Triangles that would have been drawn without levels of detail.
    pub triangles_full: u64,
    /// Units and whole meshes drawn by this camera.
    pub units_drawn: u32,
    /// The error that was selected for, in pixels: the one that keeps to the budget, if
    /// there is one.
    pub error_px: f32,
    /// Triangles drawn on the CPU to tell what is hidden
    /// ([`visible_flux`](crate::FieldLodSettings::visible_flux)); thirty-two points count as one.
    pub occluder_triangles: u32,
    /// Time that selecting this camera's cut took on the CPU, telling what is hidden included.
    pub selection_time: Duration,
    /// Pieces of `.fieldpages` files that this camera would refine and that are not in memory, and the most that
    /// what is drawn in their place errs by, in pixels. [`FieldLodSharp`](crate::FieldLodSharp) tells when
    /// there are none any more.
    pub missing_pieces: u32,
    /// See [`missing_pieces`](Self::missing_pieces).
    pub missing_px: f32,
}

/// How far the meshes of the world have come. Counts entities with a [`Mesh3d`] under an
/// [`AutoLod`](crate::AutoLod).
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
    /// Entities whose mesh is being loaded, baked or uploaded; they are drawn in full meanwhile.
    pub waiting: u32,
    /// Meshes, not entities, that background tasks are working on.
    pub baking: u32,
    /// Entities with levels of detail.
    pub ready: u32,
    /// Entities that are drawn as they are for good: their mesh is small, or cannot have levels of detail.
    pub plain: u32,
}

impl FieldLodProgress {
    /// The share of the entities that wait no longer, from 0 to 1; 1 if there are none.
    #[must_use]
    pub fn share_done(&self) -> f32 {
        let done = self.ready + self.plain;
        let all = done + self.waiting;
        if all == 0 {
            1.0
        } else {
            done as f32 / all as f32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_done_counts_what_waits() {
        let mut progress = FieldLodProgress::default();
        assert_eq!(progress.share_done(), 1.0);
        progress.waiting = 3;
        assert_eq!(progress.share_done(), 0.0);
        progress.plain = 1;
        assert_eq!(progress.share_done(), 0.25);
    }
}
