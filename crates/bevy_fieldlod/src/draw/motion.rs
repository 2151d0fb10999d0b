//! Gives new units the motion of their object in their first frame.
//!
//! Motion vectors compare the transforms of two frames. Bevy has no previous transform for a new unit. The unit's
//! object has one, and it is the same.

use bevy::pbr::{
    MeshInputUniform, MeshUniform, RenderMeshInstances, collect_meshes_for_gpu_building,
};
use bevy::prelude::*;
use bevy::render::batching::gpu_preprocessing::BatchedInstanceBuffers;
use bevy::render::sync_world::MainEntity;
use bevy::render::{Extract, ExtractSchedule, Render, RenderApp, RenderSystems};

use crate::draw::units::LodUnit;

/// Units that were spawned in this frame, each with its object.
#[derive(Resource, Default)]
struct NewUnits(Vec<[MainEntity; 2]>);

/// Handles new units, if there is a renderer.
pub(crate) fn plugin(app: &mut App) {
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .init_resource::<NewUnits>()
        .add_systems(ExtractSchedule, extract_new_units)
        .add_systems(
            Render,
            share_previous_transforms
                .after(collect_meshes_for_gpu_building)
                .in_set(RenderSystems::PrepareMeshes),
        );
}

fn extract_new_units(
    mut new_units: ResMut<NewUnits>,
    units: Extract<Query<(Entity, &LodUnit), Added<LodUnit>>>,
) {
    let with_object = units.iter().map(|(entity, unit)| [entity, unit.object]);
    new_units.0.clear();
    new_units
        .0
        .extend(with_object.map(|pair| pair.map(MainEntity::from)));
}

/// Lets new units refer to the previous transform of their object, if uniforms are built on the GPU. Uniforms that are
/// built on the CPU read [`PreviousGlobalTransform`](bevy::pbr::PreviousGlobalTransform) of the unit.
fn share_previous_transforms(
    new_units: Res<NewUnits>,
    instances: Res<RenderMeshInstances>,
    buffers: Option<Res<BatchedInstanceBuffers<MeshUniform, MeshInputUniform>>>,
) {
    let (RenderMeshInstances::GpuBuilding(instances), Some(buffers)) = (&*instances, buffers)
    else {
        return;
    };
    let uniforms = &buffers.current_input_buffer;
    for pair in &new_units.0 {
        let index = pair.map(|entity| {
            let instance = instances.get(&entity)?;
            Some(instance.gpu_specific.current_uniform_index())
        });
        let [Some(unit_index), Some(object_index)] = index else {
            continue;
        };
        let (mut unit, object) = (
            uniforms.get_unchecked(unit_index),
            uniforms.get_unchecked(object_index),
        );
        // If the object did not move in this frame, its stored previous transform is outdated.
        if object.timestamp == unit.timestamp {
            unit.previous_input_index = object.previous_input_index;
            uniforms.set(unit_index, unit);
        }
    }
}
