//! The device, its pipeline, and drawing.

use std::cell::RefCell;
use std::sync::LazyLock;

use fieldlod_bake::Surface;
use fieldlod_hierarchy::Hierarchy;
use glam::UVec2;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

use super::camera::{Uniform, WorldView};
use super::model::{DrawnModel, Vertex};
use super::picture::Picture;
use super::target::{DEPTH_BUFFER, Target};
use super::texture;
use super::{RenderError, SUPERSAMPLING};
use crate::eye::Eye;

const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// Draws cuts without a window.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: String,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    /// The targets of the last picture, which are reused because most pictures have the same size.
    targets: RefCell<Option<Targets>>,
}

#[derive(Debug)]
struct Targets {
    size: UVec2,
    color: Target,
    depth: Target,
}

impl Renderer {
    /// Opens the fastest adapter, or a software adapter if there is no other.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`], or [`RenderError::NoDevice`] from an adapter that fails.
    pub fn new() -> Result<Self, RenderError> {
        /// Kept until the process ends. If the last instance is dropped, the Vulkan loader is unloaded. NVIDIA's driver
        /// keeps addresses of the loader, and the next instance crashes.
        static INSTANCE: LazyLock<wgpu::Instance> = LazyLock::new(|| {
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle())
        });
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = pollster::block_on(INSTANCE.request_adapter(&options))
            .map_err(|_| RenderError::NoAdapter)?;
        let name = adapter.get_info().name;
        let descriptor = wgpu::DeviceDescriptor {
            // Large models need buffers beyond the default limits.
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let device = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = device.map_err(|source| RenderError::NoDevice {
            adapter: name.clone(),
            source,
        })?;
        let layout = layout(&device);
        Ok(Self {
            pipeline: pipeline(&device, &layout),
            device,
            queue,
            adapter: name,
            layout,
            targets: RefCell::new(None),
        })
    }

    /// The name of the adapter.
    #[must_use]
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    /// Uploads a hierarchy. It is drawn with the colour and the texture of `surface`, or with a pattern.
    #[must_use]
    pub fn upload(&self, hierarchy: &Hierarchy, surface: Option<&Surface>) -> DrawnModel {
        DrawnModel::new(&self.device, &self.queue, hierarchy, surface)
    }

    /// Draws some units of a model at the origin.
    ///
    /// # Errors
    /// [`RenderError::Orthographic`]; [`RenderError::Lost`] if the device is lost.
    pub fn draw(
        &self,
        model: &DrawnModel,
        eye: &Eye,
        units: &[u32],
    ) -> Result<Picture, RenderError> {
        self.draw_together(&[(model, units)], eye)
    }

    /// Draws units of several models at the origin.
    ///
    /// # Errors
    /// The errors of [`Renderer::draw`].
    pub fn draw_together(
        &self,
        models: &[(&DrawnModel, &[u32])],
        eye: &Eye,
    ) -> Result<Picture, RenderError> {
        let view = WorldView::new(eye)?;
        let size = view.size_px * SUPERSAMPLING;
        let mut last = self.targets.borrow_mut();
        let targets = match last.take() {
            Some(targets) if targets.size == size => targets,
            _ => Targets::new(&self.device, size),
        };
        let targets = last.insert(targets);
        self.submit(models, &view, targets);
        let texels = targets.color.read(&self.device, &self.queue)?;
        Ok(Picture::of_texels(size, &texels))
    }

    fn submit(&self, models: &[(&DrawnModel, &[u32])], view: &WorldView, targets: &Targets) {
        let uniform = self.device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: bytemuck::bytes_of(&view.uniform),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let bindings = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: uniform.as_entire_binding(),
            }],
        });
        // One pass clears the targets and draws all models.
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(targets.color.cleared())],
            depth_stencil_attachment: Some(targets.depth.cleared_depth()),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        for (model, units) in models {
            pass.set_bind_group(1, &model.texture, &[]);
            pass.set_vertex_buffer(0, model.vertices.slice(..));
            pass.set_index_buffer(model.indices.slice(..), wgpu::IndexFormat::Uint32);
            for &unit in *units {
                pass.draw_indexed(model.units[unit as usize].clone(), 0, 0..1);
            }
        }
        drop(pass);
        self.queue.submit([encoder.finish()]);
    }
}

impl Targets {
    fn new(device: &wgpu::Device, size: UVec2) -> Self {
        Self {
            size,
            color: Target::new(device, size, COLOR),
            depth: Target::new(device, size, DEPTH_BUFFER),
        }
    }
}

/// The layout of the uniform.
fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: wgpu::BufferSize::new(size_of::<Uniform>() as u64),
            },
            count: None,
        }],
    })
}

fn pipeline(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::include_wgsl!("shader.wgsl"));
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        bind_group_layouts: &[Some(layout), Some(&texture::layout(device))],
        ..wgpu::PipelineLayoutDescriptor::default()
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[wgpu::VertexBufferLayout {
                array_stride: size_of::<Vertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &Vertex::ATTRIBUTES,
            }],
        },
        // Nothing is culled: leaves are sheets that are seen from both sides.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_BUFFER,
            depth_write_enabled: Some(true),
            // Reversed depth: greater is nearer.
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("color"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(COLOR.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
