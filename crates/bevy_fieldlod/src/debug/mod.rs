//! The debug view: colours and heat maps on surfaces, boxes, and text.
//!
//! In: [`FieldLodDebug`] and the scene. Out: materials of drawn entities, gizmos, text, and frozen views.

mod material;
mod options;
mod overlay;
mod paint;

use bevy::pbr::MaterialPlugin;
use bevy::prelude::*;

use crate::api::systems::FieldLodSystems;
use crate::compat::Aabb3d;
use crate::draw::cpu_lists::is_drawn;
use crate::draw::inherit::RenewUnits;
use crate::draw::units::LodUnit;
use crate::scene::lod_scene::LodScene;
use crate::scene::view_cut::ViewCut;
use crate::select::views::SelectSteps;
use material::{DebugMaterials, LodDebugMaterial, level_color};
pub use options::{FieldLodDebug, FieldLodHeatMap};

/// Shows the selected levels and the field on screen, as configured by [`FieldLodDebug`]. Add it after
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
        material::add_shader(app);
        let paint_units = || paint::paint_units.run_if(paint::is_wanted);
        let any_spawned = any_match_filter::<Added<LodUnit>>;
        let bounds_wanted = |debug: Res<FieldLodDebug>| debug.bounds;
        let is_frozen = |debug: Res<FieldLodDebug>| debug.freeze;
        app.add_plugins(MaterialPlugin::<LodDebugMaterial>::default())
            .init_gizmo_group::<FieldLodGizmos>()
            .init_resource::<FieldLodDebug>()
            .init_resource::<DebugMaterials>()
            .add_systems(
                PostUpdate,
                (
                    paint_units()
                        .after(RenewUnits)
                        .in_set(FieldLodSystems::Inherit),
                    // New units are painted before they are first drawn.
                    paint_units()
                        .run_if(any_spawned)
                        .after(crate::draw::units::spawn_units)
                        .in_set(FieldLodSystems::Spawn),
                    freeze_views.run_if(is_frozen).in_set(SelectSteps::Adjust),
                ),
            )
            .add_systems(
                Update,
                (draw_bounds.run_if(bounds_wanted), overlay::update_overlay),
            );
    }
}

/// Selects again for the camera pose and projection of the last selection.
fn freeze_views(mut views: Query<&mut ViewCut>) {
    for mut cut in &mut views {
        let last = cut.view;
        if let (Some((view, _)), Some(last)) = (&mut cut.wanted, last) {
            *view = last;
        }
    }
}

/// Draws boxes around the units and whole meshes that any view draws, in the colours of their levels.
fn draw_bounds(
    mut gizmos: Gizmos<FieldLodGizmos>,
    scene: Res<LodScene>,
    views: Query<&ViewCut>,
    drawn: Query<(
        &bevy::camera::primitives::Aabb,
        &GlobalTransform,
        &ViewVisibility,
    )>,
) {
    for (entity, piece) in scene.drawn_pieces() {
        let Ok((aabb, transform, visibility)) = drawn.get(entity) else {
            continue;
        };
        // `ViewVisibility` alone is not enough: with GPU culling, all entities that are not hidden count as visible.
        let record = scene.records.find(entity);
        let is_drawn = record
            .is_some_and(|(index, record)| views.iter().any(|cut| is_drawn(cut, index, record)));
        if is_drawn && visibility.get() {
            let aabb = Aabb3d {
                min: aabb.min(),
                max: aabb.max(),
            };
            gizmos.aabb_3d(
                aabb,
                transform.compute_transform(),
                level_color(piece.level),
            );
        }
    }
}
