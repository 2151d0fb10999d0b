//! Debug views: heat maps of the field, and bounds.

use bevy::color::palettes::css;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{FieldLodDebugPlugin, FieldLodGizmos, FieldLodHeatMap};
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::{SIZE_PX, Stage};
use image::{Rgba, RgbaImage};

use crate::picture::{count, difference};

/// A wall across the whole picture, seen with a wide field of view.
fn wall(heat_map: FieldLodHeatMap) -> Option<RgbaImage> {
    let mut stage = Stage::unfinished()?;
    stage.app.add_plugins(FieldLodDebugPlugin);
    stage.finish();
    let wall = stage.add(bevy_mesh(&fieldlod_tests::height_field(24)));
    let grey = stage.add(StandardMaterial::from(Color::WHITE));
    let turned = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let place = Transform::from_rotation(turned).with_scale(Vec3::splat(8.0));
    stage.spawn((
        Mesh3d(wall),
        MeshMaterial3d(grey),
        AutoLod::default(),
        place,
    ));
    let pose = Transform::from_xyz(0.0, 0.0, 3.0).looking_at(Vec3::ZERO, Vec3::Y);
    let eye = stage.add_eye(pose, css::BLACK.into(), FieldLodCamera::default());
    let wide = PerspectiveProjection {
        fov: 2.0,
        ..default()
    };
    let wide = Projection::Perspective(wide);
    stage.insert(eye.entity, wide);
    stage
        .app
        .world_mut()
        .resource_mut::<FieldLodDebug>()
        .heat_map = Some(heat_map);
    stage.run_until_ready();
    let [picture] = stage.shoot([&eye]);
    Some(picture)
}

/// Red minus blue of a pixel. It grows with the heat.
fn heat(pixel: &Rgba<u8>) -> i32 {
    i32::from(pixel[0]) - i32::from(pixel[2])
}

fn middle_and_corner(picture: &RgbaImage) -> (i32, i32) {
    let middle = picture.get_pixel(SIZE_PX / 2, SIZE_PX / 2);
    let corner = picture.get_pixel(SIZE_PX / 10, SIZE_PX / 10);
    (heat(middle), heat(corner))
}

#[test]
fn heat_maps_are_hotter_in_corners() {
    for heat_map in [FieldLodHeatMap::AspectRatio, FieldLodHeatMap::Curl] {
        let Some(picture) = wall(heat_map) else {
            return;
        };
        let (middle, corner) = middle_and_corner(&picture);
        assert!(corner > middle + 50, "{heat_map:?}: {middle} {corner}");
        // The sampling pattern is not stretched in the middle.
        assert!(
            middle < -50 || heat_map == FieldLodHeatMap::Curl,
            "{middle}"
        );
    }
}

/// A rock with the debug plugin, and the pose of a camera in front of it.
fn stage_with_a_rock() -> Option<(Stage, Transform)> {
    let mut stage = Stage::unfinished()?;
    stage.app.add_plugins(FieldLodDebugPlugin);
    stage.finish();
    let rock = stage.add(bevy_mesh(&fieldlod_tests::rock(5, 1)));
    let grey = stage.add(StandardMaterial::from(Color::WHITE));
    stage.spawn((Mesh3d(rock), MeshMaterial3d(grey), AutoLod::default()));
    let pose = Transform::from_xyz(0.0, 0.0, 5.0).looking_at(Vec3::ZERO, Vec3::Y);
    Some((stage, pose))
}

#[test]
fn bounds_use_own_gizmo_group() {
    let Some((mut stage, pose)) = stage_with_a_rock() else {
        return;
    };
    let eye = stage.add_eye(pose, css::BLACK.into(), FieldLodCamera::default());
    stage.run_until_ready();
    let [without] = stage.shoot([&eye]);
    stage.app.world_mut().resource_mut::<FieldLodDebug>().bounds = true;
    stage.app.update();
    let [with] = stage.shoot([&eye]);
    let boxes = count(&difference(&without, &with));
    assert!(boxes > 200, "{boxes} pixels of boxes");
    let mut groups = stage.app.world_mut().resource_mut::<GizmoConfigStore>();
    groups.config_mut::<FieldLodGizmos>().0.enabled = false;
    stage.app.update();
    let [hidden] = stage.shoot([&eye]);
    assert_eq!(count(&difference(&without, &hidden)), 0);
}
