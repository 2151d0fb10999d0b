//! Cameras that draw the cut of another.

use bevy::ecs::entity::MapEntities;
use bevy::prelude::*;

/// Lets a camera draw the cut of another instead of one of its own: for the second eye of a stereo pair, which
/// then draws the very same units, selected once. Put it on the camera beside that which it names.
///
/// The cut is selected for the other camera, whose [`FieldLodSettings`](crate::FieldLodSettings) and layers
/// count; its [`offscreen_margin`](crate::FieldLodSettings::offscreen_margin) covers what only this one sees.
/// While the other is not active or draws full detail, this one has a cut of its own.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn spawn_eyes(mut commands: Commands) {
///     let left = commands.spawn((Camera3d::default(), FieldLodSettings::with_error_px(1.5))).id();
///     let beside = Transform::from_xyz(0.065, 0.0, 0.0);
///     commands.spawn((Camera3d::default(), beside, FieldLodCutOf(left)));
/// }
/// # bevy::ecs::system::assert_is_system(spawn_eyes);
/// ```
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, MapEntities, Reflect)]
#[component(map_entities)]
#[reflect(Component, Clone, PartialEq)]
pub struct FieldLodCutOf(#[entities] pub Entity);
