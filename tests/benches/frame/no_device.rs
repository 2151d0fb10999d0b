//! A renderer on a device that does nothing, to time the render world with any number of props.

use std::sync::Arc;

use bevy::app::PluginGroupBuilder;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::renderer::{
    RenderAdapter, RenderAdapterInfo, RenderDevice, RenderInstance, RenderQueue, WgpuWrapper,
};
use bevy::render::settings::{RenderCreation, RenderResources};
use bevy::tasks::block_on;
use fieldlod_tests::apps::windowless;

/// Bevy's default plugins on a device that does nothing.
pub(crate) fn plugins() -> PluginGroupBuilder {
    windowless()
        .disable::<PipelinedRenderingPlugin>()
        .set(RenderPlugin {
            render_creation: RenderCreation::Manual(resources()),
            synchronous_pipeline_compilation: true,
            ..default()
        })
}

fn resources() -> RenderResources {
    let mut instance = wgpu::InstanceDescriptor::new_without_display_handle();
    instance.backends = wgpu::Backends::NOOP;
    instance.backend_options.noop.enable = true;
    let instance = wgpu::Instance::new(instance);
    let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
        .expect("wgpu has its noop backend: use `--features no_device`");
    let (device, queue) = block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        // Bevy needs these to cull on the GPU.
        required_features: wgpu::Features::INDIRECT_FIRST_INSTANCE
            | wgpu::Features::IMMEDIATES
            | wgpu::Features::MULTI_DRAW_INDIRECT_COUNT,
        required_limits: wgpu::Limits {
            max_immediate_size: 128,
            max_storage_textures_per_shader_stage: 12,
            max_storage_buffers_per_shader_stage: 16,
            max_buffer_size: 1 << 30,
            max_storage_buffer_binding_size: 1 << 30,
            ..default()
        },
        ..default()
    }))
    .expect("the noop adapter always has a device");
    RenderResources(
        RenderDevice::from(device),
        RenderQueue(Arc::new(WgpuWrapper::new(queue))),
        RenderAdapterInfo(WgpuWrapper::new(adapter.get_info())),
        RenderAdapter(Arc::new(WgpuWrapper::new(adapter))),
        RenderInstance(Arc::new(WgpuWrapper::new(instance))),
    )
}
