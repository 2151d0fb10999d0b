//! Seeing what the selection does: colours and heat-maps on the surfaces, boxes, numbers.

mod overlay;
mod paint;
mod surface;

use bevy::asset::embedded_asset;
use bevy::pbr::MaterialPlugin;
use bevy::prelude::*;

use crate::units::LodUnit;
use crate::world::LodWorld;
use crate::{FieldLodDebug, FieldLodSystems};
pub use surface::LodSurfaceMaterial;

/// Shows what the selection does, as [`FieldLodDebug`] says. Add it after
/// [`FieldLodPlugin`](crate::FieldLodPlugin).
///
/// ```no_run
/// use bevy::prelude::*;
/// use bevy_fieldlod::{FieldLodDebugPlugin, FieldLodHeatMap, prelude::*};
///
/// App::new()
///     .add_plugins((DefaultPlugins, FieldLodPlugin, FieldLodDebugPlugin))
///     .insert_resource(FieldLodDebug {
///         heat_map: Some(FieldLodHeatMap::SamplingDensity),
///         overlay: true,
///         ..default()
///     })
///     .run();
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodDebugPlugin;

/// The gizmos of [`FieldLodDebug::bounds`].
#[derive(Debug, Default, Reflect, GizmoConfigGroup)]
pub struct FieldLodGizmos;

impl Plugin for FieldLodDebugPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "surface.wgsl");
        app.add_plugins(MaterialPlugin::<LodSurfaceMaterial>::default())
            .init_gizmo_group::<FieldLodGizmos>()
            .init_resource::<surface::Surfaces>()
            .add_systems(
                PostUpdate,
                (
                    paint::paint
                        .run_if(paint::is_wanted)
                        .in_set(FieldLodSystems::Prepare)
                        .after(crate::inherit::renew_units),
                    // Units that come are painted before they are first drawn.
                    paint::paint
                        .run_if(paint::is_wanted.and_then(crate::units::any_born))
                        .in_set(FieldLodSystems::Select)
                        .after(crate::units::spawn_units),
                ),
            )
            .add_systems(
                Update,
                (
                    draw_bounds.run_if(|debug: Res<FieldLodDebug>| debug.bounds),
                    overlay::show,
                ),
            );
    }
}

/// Boxes of the units and whole meshes that any view draws, in the colours of their levels.
fn draw_bounds(
    mut gizmos: Gizmos<FieldLodGizmos>,
    world: Res<LodWorld>,
    drawn: Query<(
        &bevy::camera::primitives::Aabb,
        &GlobalTransform,
        &ViewVisibility,
        Option<&LodUnit>,
    )>,
) {
    for (entity, level) in world.drawn_levels() {
        let Ok((aabb, place, visibility, _)) = drawn.get(entity) else {
            continue;
        };
        if visibility.get() {
            let aabb = bevy::math::bounding::Aabb3d {
                min: aabb.min(),
                max: aabb.max(),
            };
            gizmos.aabb_3d(aabb, place.compute_transform(), surface::level_color(level));
        }
    }
}
