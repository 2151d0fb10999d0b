//! Each camera draws its own cut, and its shadows with it.

use bevy::color::palettes::css;
use bevy::light::{CascadeShadowConfigBuilder, DirectionalLight, NotShadowCaster};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::frame_times::drop_commands;
use fieldlod_tests::stage::{Eye, Stage};

use crate::picture::{count, difference};

const FINE_PX: f32 = 1.0;
const COARSE_PX: f32 = 400.0;

/// Adds a boulder over a plane, under a low sun. Returns the boulder.
fn add_scene(stage: &mut Stage) -> Entity {
    stage.shrink_shadow_maps();
    let boulder = stage.add(bevy_mesh(&fieldlod_tests::rock(5, 7)));
    let ground = stage.add(Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(20.0))));
    let stone = stage.add(StandardMaterial::from(Color::srgb(0.6, 0.5, 0.4)));
    let sand = stage.add(StandardMaterial::from(Color::srgb(0.8, 0.8, 0.7)));
    let boulder = stage.spawn((
        Mesh3d(boulder),
        MeshMaterial3d(stone),
        Transform::from_xyz(0.0, 1.5, 0.0),
        AutoLod::default(),
    ));
    stage.spawn((Mesh3d(ground), MeshMaterial3d(sand)));
    stage.spawn((
        DirectionalLight {
            illuminance: 5_000.0,
            shadow_maps_enabled: true,
            ..default()
        },
        CascadeShadowConfigBuilder {
            maximum_distance: 20.0,
            ..default()
        }
        .build(),
        Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y),
    ));
    boulder
}

fn add_eye(stage: &mut Stage, error_px: f32) -> Eye {
    let pose = Transform::from_xyz(-1.5, 4.0, 6.0).looking_at(Vec3::new(-1.0, 0.7, 0.0), Vec3::Y);
    stage.add_eye(
        pose,
        css::SKY_BLUE.into(),
        FieldLodCamera::with_error_px(error_px),
    )
}

#[test]
fn two_cameras_draw_own_cuts_and_shadows() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    let boulder = add_scene(&mut stage);
    let fine_eye = add_eye(&mut stage, FINE_PX);
    let coarse_eye = add_eye(&mut stage, COARSE_PX);
    stage.run_until_ready();
    let [fine, coarse] = stage.shoot([&fine_eye, &coarse_eye]);
    let [fine_stats, coarse_stats] = [&fine_eye, &coarse_eye].map(|eye| stage.stats(eye));
    assert!(
        fine_stats.triangles_drawn > 8 * coarse_stats.triangles_drawn,
        "{fine_stats:?} {coarse_stats:?}"
    );

    // Side by side, each draws the same object and shadow as alone.
    for (eye, other, beside) in [
        (&fine_eye, &coarse_eye, &fine),
        (&coarse_eye, &fine_eye, &coarse),
    ] {
        stage.set_active(other, false);
        stage.app.update();
        let [alone] = stage.shoot([eye]);
        assert_eq!(count(&difference(beside, &alone)), 0);
        stage.set_active(other, true);
    }

    // The shadows differ too, at pixels that show no object.
    stage.insert(boulder, NotShadowCaster);
    stage.app.update();
    let [without_shadow, coarse_without_shadow] = stage.shoot([&fine_eye, &coarse_eye]);
    let shadow = difference(&fine, &without_shadow);
    assert!(count(&shadow) > 500, "the scene shows no shadow");
    let coarse_shadow = difference(&coarse, &coarse_without_shadow);
    let object = difference(&without_shadow, &coarse_without_shadow);
    let shadow_moved = shadow
        .iter()
        .zip(&coarse_shadow)
        .zip(&object)
        .filter(|((fine, coarse), on_object)| fine != coarse && !**on_object)
        .count();
    assert!(
        shadow_moved > 30,
        "shadows differ in {shadow_moved} pixels only"
    );
}

#[test]
fn despawned_camera_is_ignored() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    add_scene(&mut stage);
    let fine_eye = add_eye(&mut stage, 0.1);
    let coarse_eye = add_eye(&mut stage, COARSE_PX);
    stage.run_until_ready();
    drop_commands(&mut stage.app);
    stage.app.world_mut().despawn(fine_eye.entity);
    // Unused units are despawned after 60 frames.
    (0..64).for_each(|_| stage.app.update());
    let world = stage.app.world_mut();
    let units = world.query::<&bevy_fieldlod::LodUnit>().iter(world).len();
    assert_eq!(units as u32, stage.stats(&coarse_eye).units_drawn);
}
