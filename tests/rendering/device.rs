//! What happens when the device is lost.

use bevy::color::palettes::css;
use bevy::prelude::*;
use bevy::render::{RenderApp, RenderStartup};
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::Stage;

#[test]
fn units_are_prepared_again_for_new_device() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    let rock = stage.add(bevy_mesh(&fieldlod_tests::rock(5, 5)));
    let stone = stage.add(StandardMaterial::default());
    stage.spawn((Mesh3d(rock), MeshMaterial3d(stone), AutoLod::default()));
    let pose = Transform::from_xyz(0.0, 0.0, 4.0);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), FieldLodCamera::default());
    stage.run_until_ready();
    let before = stage.stats(&eye);
    assert!(before.units_drawn > 0);
    // As Bevy does when it has made a new one.
    let render_app = stage.app.sub_app_mut(RenderApp);
    render_app.world_mut().run_schedule(RenderStartup);
    stage.app.update();
    stage.app.update();
    assert_eq!(stage.stats(&eye).units_drawn, 0);
    stage.run_until_ready();
    assert_eq!(stage.stats(&eye).triangles_drawn, before.triangles_drawn);
}
