//! Units and levels look right in their first frame.

use bevy::color::palettes::css;
use bevy::core_pipeline::prepass::MotionVectorPrepass;
use bevy::pbr::{MeshInputUniform, MeshUniform, RenderMeshInstances};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::batching::gpu_preprocessing::BatchedInstanceBuffers;
use bevy::render::sync_world::MainEntity;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{FieldLodSystems, LodUnit};
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::frame_times::drop_commands;
use fieldlod_tests::stage::Stage;
use image::RgbaImage;

use crate::picture::{count, difference};

#[test]
fn units_replace_source_without_blink() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    let boulder = stage.add(bevy_mesh(&fieldlod_tests::rock(6, 5)));
    let stone = stage.add(StandardMaterial::from(Color::srgb(0.6, 0.5, 0.4)));
    stage.spawn((
        DirectionalLight::default(),
        Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y),
    ));
    let pose = Transform::from_xyz(0.0, 0.5, 4.0).looking_at(Vec3::ZERO, Vec3::Y);
    let view = FieldLodCamera::with_error_px(1.0);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), view);
    let object = stage.spawn((Mesh3d(boulder), MeshMaterial3d(stone)));
    stage.run_until_ready();
    let [before] = stage.shoot([&eye]);

    stage.insert(object, AutoLod::default());
    let mut frames = Vec::new();
    let mut frames_after = 0;
    while frames_after < 4 {
        frames.push(stage.draw(&eye));
        frames_after += usize::from(stage.progress().ready == 1);
    }
    let stats = stage.stats(&eye);
    assert!(stats.units_drawn > 0, "no unit is drawn");
    assert!(stats.triangles_drawn < stats.triangles_full, "{stats:?}");
    let frames: Vec<RgbaImage> = frames.iter().map(|frame| stage.wait(frame)).collect();
    let [after] = stage.shoot([&eye]);
    assert!(
        count(&difference(&before, &after)) > 0,
        "the cut looks like the source"
    );
    let kinds: Vec<(bool, bool)> = frames
        .iter()
        .map(|frame| [&before, &after].map(|one| count(&difference(one, frame)) == 0))
        .map(|[is_before, is_after]| (is_before, is_after))
        .collect();
    let exactly_one = |&(is_before, is_after): &(bool, bool)| is_before != is_after;
    assert!(
        kinds.iter().all(exactly_one),
        "a frame is neither the source nor the cut: {kinds:?}"
    );
    assert!(
        kinds.is_sorted_by_key(|(is_before, _)| !is_before),
        "{kinds:?}"
    );
}

#[test]
fn jumping_camera_swaps_props_at_once() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    // A slow selection must not delay the swap.
    let slow = || std::thread::sleep(std::time::Duration::from_millis(30));
    let selection = FieldLodSystems::Select;
    stage.app.add_systems(PostUpdate, slow.in_set(selection));
    let rock = stage.add(bevy_mesh(&fieldlod_tests::rock(4, 5)));
    let stone = stage.add(StandardMaterial::from(Color::srgb(0.6, 0.5, 0.4)));
    stage.spawn((
        DirectionalLight::default(),
        Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y),
    ));
    // Seen from far away, all rocks have the same level. Seen from near, their levels differ.
    for (x, z) in [
        (-1.2, 0.0),
        (1.2, 0.0),
        (2.0, -10.0),
        (-4.0, -25.0),
        (8.0, -60.0),
    ] {
        let place = Transform::from_xyz(x, 0.0, z);
        let material = MeshMaterial3d(stone.clone());
        stage.spawn((Mesh3d(rock.clone()), material, place, AutoLod::default()));
    }
    let at = |z: f32| Transform::from_xyz(0.0, 0.0, z);
    let eye = stage.add_eye(at(500.0), css::SKY_BLUE.into(), FieldLodCamera::default());
    stage.run_until_ready();
    for distance in [3.0, 500.0, 4.0, 40.0, 3.5] {
        stage.insert(eye.entity, at(distance));
        let frames = [(); 2].map(|()| stage.draw(&eye));
        let [first, next] = frames.map(|frame| stage.wait(&frame));
        assert_eq!(count(&difference(&first, &next)), 0, "at {distance}");
    }
}

/// The uniform of a mesh on the GPU.
pub(crate) fn uniform(stage: &Stage, entity: Entity) -> Option<MeshInputUniform> {
    let world = stage.app.sub_app(RenderApp).world();
    let instances = world.resource::<RenderMeshInstances>();
    let RenderMeshInstances::GpuBuilding(instances) = instances else {
        return None;
    };
    let instance = instances.get(&MainEntity::from(entity))?;
    let buffers = world.resource::<BatchedInstanceBuffers<MeshUniform, MeshInputUniform>>();
    let index = instance.gpu_specific.current_uniform_index();
    buffers.current_input_buffer.get(index)
}

#[test]
fn new_units_have_motion_of_object() {
    Stage::with_each_culling().for_each(check_new_units);
}

fn check_new_units(mut stage: Stage) {
    let rock = stage.add(bevy_mesh(&fieldlod_tests::rock(6, 5)));
    let stone = stage.add(StandardMaterial::default());
    let object = stage.spawn((Mesh3d(rock), MeshMaterial3d(stone), AutoLod::default()));
    let pose = Transform::from_xyz(0.0, 0.0, 40.0);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), FieldLodCamera::default());
    stage.insert(eye.entity, MotionVectorPrepass);
    stage.run_until_ready();
    drop_commands(&mut stage.app);
    let mut new_units = 0;
    for step in 0..20u8 {
        let place = Transform::from_xyz(f32::from(step) * 0.05, 0.0, f32::from(step) * 1.8);
        stage.insert(object, place);
        let world = stage.app.world_mut();
        let mut units = world.query_filtered::<Entity, With<LodUnit>>();
        let before: Vec<Entity> = units.iter(world).collect();
        stage.app.update();
        let after: Vec<Entity> = units.iter(stage.app.world()).collect();
        let Some(of_object) = uniform(&stage, object) else {
            return;
        };
        for unit in after.iter().filter(|unit| !before.contains(unit)) {
            let Some(of_unit) = uniform(&stage, *unit) else {
                continue;
            };
            assert_ne!(of_unit.previous_input_index, u32::MAX);
            assert_eq!(of_unit.previous_input_index, of_object.previous_input_index);
            new_units += 1;
        }
    }
    assert!(new_units > 10, "{new_units} units");
}
