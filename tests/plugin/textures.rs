//! How finely textures are seen.

use bevy::prelude::*;
use bevy_fieldlod::{FieldLodTextureDemand, FieldLodTexturePlugin, TextureDetail};

use crate::headless::{app_with, insert, move_camera, ready, spawn_camera, spawn_object};

#[test]
fn texture_demand_follows_distance() {
    let mut app = app_with(FieldLodTexturePlugin);
    let camera = spawn_camera(&mut app, 100.0);
    // One unit of texture coordinates to a unit of length, give or take the ends.
    let sphere = Sphere::new(1.0).mesh().uv(64, 32);
    let object = spawn_object(&mut app, sphere);
    ready(&mut app, 1);
    app.update();
    let detail = *app.world().get::<TextureDetail>(object).unwrap();
    // 4π of area to 1 of texture coordinates, at 720 / (2 tan 22.5°) / 100 pixels a unit.
    let expected = 720.0 / (2.0 * (std::f32::consts::FRAC_PI_8).tan()) / 100.0 * 12.57f32.sqrt();
    let ratio = detail.pixels_per_uv / expected;
    // The bound looks at the nearest point of the sphere around the box.
    assert!((0.98..1.1).contains(&ratio), "{detail:?} {expected}");

    move_camera(&mut app, camera, 50.0);
    app.update();
    let nearer = *app.world().get::<TextureDetail>(object).unwrap();
    let finer = detail.mip_level(1024.0) - nearer.mip_level(1024.0);
    assert!((finer - 1.0).abs() < 0.1, "{finer}");
    let demand = app.world().resource::<FieldLodTextureDemand>();
    let of_materials: Vec<TextureDetail> = demand.of_standard_materials.values().copied().collect();
    assert_eq!(of_materials, [nearer]);

    // Behind the camera nobody sees it.
    let behind = Transform::from_xyz(0.0, 0.0, 500.0);
    insert(&mut app, object, behind);
    app.update();
    app.update();
    assert!(app.world().get::<TextureDetail>(object).is_none());
    let demand = app.world().resource::<FieldLodTextureDemand>();
    assert!(demand.of_standard_materials.is_empty());
}
