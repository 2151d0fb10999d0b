//! Seeing what the selection does: colours and heat-maps on the surfaces, boxes, numbers.

mod overlay;
mod paint;
mod surface;

use bevy::asset::embedded_asset;
use bevy::pbr::MaterialPlugin;
use bevy::prelude::*;

use crate::units::LodUnit;
use crate::world::LodWorld;
use crate::{FieldLodSystems, LodDebug};
pub use surface::LodSurfaceMaterial;

/// Shows what the selection does, as [`LodDebug`] says. Add it after
/// [`FieldLodPlugin`](crate::FieldLodPlugin).
///
/// ```no_run
/// use bevy::prelude::*;
/// use bevy_fieldlod::{FieldLodDebugPlugin, HeatMap, prelude::*};
///
/// App::new()
///     .add_plugins((DefaultPlugins, FieldLodPlugin, FieldLodDebugPlugin))
///     .insert_resource(LodDebug {
///         heat_map: Some(HeatMap::SamplingDensity),
///         overlay: true,
///         ..default()
///     })
///     .run();
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodDebugPlugin;

/// The gizmos of [`LodDebug::bounds`].
#[derive(Debug, Default, Reflect, GizmoConfigGroup)]
pub struct LodGizmos;

impl Plugin for FieldLodDebugPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "surface.wgsl");
        app.add_plugins(MaterialPlugin::<LodSurfaceMaterial>::default())
            .init_gizmo_group::<LodGizmos>()
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
                    draw_bounds.run_if(|debug: Res<LodDebug>| debug.bounds),
                    overlay::show,
                ),
            );
    }
}

/// Boxes of the units and whole meshes that any view draws, in the colours of their levels.
fn draw_bounds(
    mut gizmos: Gizmos<LodGizmos>,
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
