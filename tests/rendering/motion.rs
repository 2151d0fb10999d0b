//! Motion vectors of units that come while their object moves.

use bevy::color::palettes::css;
use bevy::core_pipeline::prepass::MotionVectorPrepass;
use bevy::pbr::{MeshInputUniform, MeshUniform, RenderMeshInstances};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::batching::gpu_preprocessing::BatchedInstanceBuffers;
use bevy::render::sync_world::MainEntity;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::Stage;

/// What the GPU is told of a mesh.
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
    Stage::with_each_culling().for_each(check_units_that_come);
}

fn check_units_that_come(mut stage: Stage) {
    let rock = stage.add(bevy_mesh(&fieldlod_tests::rock(6, 5)));
    let stone = stage.add(StandardMaterial::default());
    let object = stage.spawn((Mesh3d(rock), MeshMaterial3d(stone), AutoLod::default()));
    let pose = Transform::from_xyz(0.0, 0.0, 40.0);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), FieldLodCamera::default());
    stage.insert(eye.entity, MotionVectorPrepass);
    stage.run_until_ready();
    let mut come = 0;
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
            come += 1;
        }
    }
    assert!(come > 10, "{come} units came");
}
