//! Levels of detail: the part of the game that uses the plugin.

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use crate::controls::{CONTROLS, Counting, Numbers};
use crate::scene::Orbit;

pub(crate) fn plugin(app: &mut App) {
    app.add_plugins(FieldLodPlugin)
        // All files are shipped, natively too.
        .insert_resource(FieldLodAppConfig {
            bake_at_run_time: false,
            ..default()
        })
        .add_observer(mark_scene)
        .add_systems(Update, set_quality)
        .add_systems(Last, count.in_set(Counting));
}

fn mark_scene(scene: On<Add, WorldAssetRoot>, mut commands: Commands) {
    commands.entity(scene.entity).insert(AutoLod::default());
}

/// Sets the quality of the page on the player's camera. A minimap is small, so that it needs less.
fn set_quality(
    mut commands: Commands,
    cameras: Query<(Entity, Has<Orbit>, Option<&FieldLodCamera>), With<Camera3d>>,
) {
    let (error_px, is_full) = {
        let controls = CONTROLS.lock().expect("no panic");
        (controls.error_px, controls.is_full_detail)
    };
    for (camera, is_player, old) in &cameras {
        let error_px = if is_player { error_px } else { 4.0 };
        let new = if is_full {
            FieldLodCamera::at_level(0)
        } else {
            FieldLodCamera::with_error_px(error_px)
        };
        if old != Some(&new) {
            commands.entity(camera).insert(new);
        }
    }
}

fn count(
    progress: Res<FieldLodProgress>,
    views: Query<&FieldLodViewStats>,
    mut numbers: ResMut<Numbers>,
) {
    numbers.loaded = progress.share_done();
    numbers.entities = progress.ready;
    numbers.triangles = views.iter().map(|view| view.triangles_drawn).sum();
    numbers.triangles_full = views.iter().map(|view| view.triangles_full).sum();
    let selection: f32 = views
        .iter()
        .map(|view| view.selection_time.as_secs_f32())
        .sum();
    numbers.selection_ms += 1e3 * selection;
}
