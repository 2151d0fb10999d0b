//! Texture detail.

use bevy::prelude::*;
use bevy_fieldlod::{FieldLodTextureDemand, FieldLodTexturePlugin, TextureDetail};

use crate::headless::{app_with, insert, move_camera, ready, spawn_camera, spawn_object};

#[test]
fn texture_demand_follows_distance() {
    let mut app = app_with(FieldLodTexturePlugin);
    let camera = spawn_camera(&mut app, 100.0);
    let sphere = Sphere::new(1.0).mesh().uv(64, 32);
    let object = spawn_object(&mut app, sphere);
    ready(&mut app, 1);
    app.update();
    let detail = only_detail(&app).unwrap();
    // 4π of area per unit of texture coordinates, at 720 / (2 tan 22.5°) / 100 pixels per unit of length.
    let expected = 720.0 / (2.0 * (std::f32::consts::FRAC_PI_8).tan()) / 100.0 * 12.57f32.sqrt();
    let ratio = detail.pixels_per_uv / expected;
    // The detail is that at the nearest point of the bounding sphere, so it is larger.
    assert!((0.98..1.1).contains(&ratio), "{detail:?} {expected}");

    move_camera(&mut app, camera, 50.0);
    let nearer = only_detail(&app).unwrap();
    let finer = detail.mip_level(1024.0) - nearer.mip_level(1024.0);
    assert!((finer - 1.0).abs() < 0.1, "{finer}");

    // Behind the camera, no view sees it.
    insert(&mut app, object, Transform::from_xyz(0.0, 0.0, 500.0));
    app.update();
    assert_eq!(only_detail(&app), None);
}

/// The detail of the only material; `None` if no view sees it.
fn only_detail(app: &App) -> Option<TextureDetail> {
    let demand = app.world().resource::<FieldLodTextureDemand>();
    assert!(demand.of_standard_materials.len() < 2);
    demand.of_standard_materials.values().next().copied()
}
