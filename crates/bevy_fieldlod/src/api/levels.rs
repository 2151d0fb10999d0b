//! The levels at which cameras draw entities.

use std::fmt::{self, Debug, Formatter};
use std::ops::RangeInclusive;

use bevy::ecs::system::SystemParam;
use bevy::prelude::*;

use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::{ViewCut, ViewState};

/// Reads the levels at which cameras draw entities; 0 is the finest, the source.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn show(levels: LodLevels, camera: Single<Entity, With<Camera3d>>, statue: Single<Entity, With<Mesh3d>>) {
///     if let Some(drawn) = levels.in_view(*statue, *camera) {
///         println!("levels {} to {}", drawn.start(), drawn.end());
///     }
/// }
/// # bevy::ecs::system::assert_is_system(show);
/// ```
#[derive(SystemParam)]
pub struct LodLevels<'w, 's> {
    scene: Res<'w, LodScene>,
    views: Query<'w, 's, &'static ViewCut>,
}

impl LodLevels<'_, '_> {
    /// The finest and the coarsest level of `entity` in the last cut of `camera`, inside the image or outside. For a
    /// prop, both are its level in all views. `None` if the entity has no levels of detail, is hidden or is on another
    /// layer, or if the camera draws nothing.
    #[must_use]
    pub fn in_view(&self, entity: Entity, camera: Entity) -> Option<RangeInclusive<u32>> {
        let instance = self.scene.instance_of(entity)?;
        let cut = self.views.get(camera).ok()?;
        if cut.state == ViewState::Inactive || cut.layers & instance.layers == 0 {
            return None;
        }
        let units = cut.selector.units(&self.scene.scene, instance.id);
        let pieces = &instance.mesh.pieces;
        match instance.level {
            // The object is newer than the last cut.
            _ if cut.state == ViewState::Cut && units.is_empty() => None,
            Some(level) => Some(level..=level),
            None if cut.state == ViewState::FullDetail => Some(0..=0),
            None => {
                let levels = units.iter().map(|&unit| pieces[unit as usize].level);
                Some(levels.clone().min()?..=levels.max()?)
            }
        }
    }
}

impl Debug for LodLevels<'_, '_> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        f.debug_struct("LodLevels").finish_non_exhaustive()
    }
}
