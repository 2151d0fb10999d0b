//! The adapter, its pipelines, and drawing.

use std::cell::RefCell;
use std::time::{Duration, Instant};

use fieldlod_hierarchy::Hierarchy;
use glam::UVec2;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

use super::camera::{self, Uniform};
use super::model::{DrawnModel, Vertex};
use super::picture::{Picture, UnitMap};
use super::target::{Target, wait};
use super::{RenderError, SUPERSAMPLING};
use crate::eye::Eye;

const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const DEPTH_BUFFER: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const UNIT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// Draws cuts without a window.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: String,
    layout: wgpu::BindGroupLayout,
    color_pipeline: wgpu::RenderPipeline,
    units_pipeline: wgpu::RenderPipeline,
    /// The targets of the last picture, as most pictures are of one size.
    targets: RefCell<Option<Targets>>,
}

#[derive(Debug)]
struct Targets {
    size: UVec2,
    colors: [Target; 2],
    depth: Target,
}

impl Renderer {
    /// Takes the best adapter there is, software at the last.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`], or [`RenderError::NoDevice`] from an adapter that fails.
    pub fn new() -> Result<Self, RenderError> {
        // The adapter, and what it is called.
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options))
            .map_err(|_| RenderError::NoAdapter)?;
        let name = adapter.get_info().name;
        // A device that takes all that the adapter can.
        let descriptor = wgpu::DeviceDescriptor {
            // Buffers of large models.
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let device = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = device.map_err(|source| RenderError::NoDevice {
            adapter: name.clone(),
            source,
        })?;
        Ok(Self::with_device(device, queue, name))
    }

    fn with_device(device: wgpu::Device, queue: wgpu::Queue, adapter: String) -> Self {
        // One uniform for both shaders.
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let color_pipeline = pipeline(&device, &layout, "color", &[COLOR]);
        let units_pipeline = pipeline(&device, &layout, "color_and_unit", &[COLOR, UNIT]);
        Self {
            device,
            queue,
            adapter,
            layout,
            color_pipeline,
            units_pipeline,
            targets: RefCell::new(None),
        }
    }

    /// The name of the adapter.
    #[must_use]
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    /// Brings a hierarchy to the adapter.
    #[must_use]
    pub fn upload(&self, hierarchy: &Hierarchy) -> DrawnModel {
        DrawnModel::new(&self.device, hierarchy)
    }

    /// Draws some units of a model.
    ///
    /// # Errors
    /// [`RenderError::Orthographic`]; [`RenderError::Lost`] from an adapter that stops.
    pub fn draw(
        &self,
        model: &DrawnModel,
        eye: &Eye,
        units: &[u32],
    ) -> Result<Picture, RenderError> {
        Ok(self.draw_timed(model, eye, units)?.0)
    }

    /// Draws some units of a model, and tells the time from the first command to the last texel.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn draw_timed(
        &self,
        model: &DrawnModel,
        eye: &Eye,
        units: &[u32],
    ) -> Result<(Picture, Duration), RenderError> {
        let (size_px, uniform) = camera::of_eye(eye)?;
        self.with_targets(size_px * SUPERSAMPLING, |targets| {
            // The time ends when the adapter is done, before the picture is read.
            let start = Instant::now();
            self.submit(model, &uniform, units, targets, false);
            wait(&self.device)?;
            let elapsed = start.elapsed();
            let texels = targets.colors[0].read(&self.device, &self.queue)?;
            Ok((Picture::of_texels(targets.size, &texels), elapsed))
        })
    }

    /// Draws some units of a model and tells which of them each texel shows.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn draw_units(
        &self,
        model: &DrawnModel,
        eye: &Eye,
        units: &[u32],
    ) -> Result<(Picture, UnitMap), RenderError> {
        let (size_px, uniform) = camera::of_eye(eye)?;
        self.with_targets(size_px * SUPERSAMPLING, |targets| {
            self.submit(model, &uniform, units, targets, true);
            let texels = targets.colors[0].read(&self.device, &self.queue)?;
            // The shader counts units from 1, so that 0 is none.
            let shown: Vec<u32> = targets.colors[1].read(&self.device, &self.queue)?;
            let map = UnitMap {
                size_texels: targets.size,
                units: shown.iter().map(|unit| unit.checked_sub(1)).collect(),
            };
            Ok((Picture::of_texels(targets.size, &texels), map))
        })
    }

    fn with_targets<T>(
        &self,
        size: UVec2,
        draw: impl FnOnce(&Targets) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        // Those of the last picture serve again if they have the size.
        let mut last = self.targets.borrow_mut();
        let targets = match last.take() {
            Some(targets) if targets.size == size => targets,
            _ => Targets::new(&self.device, size),
        };
        draw(last.insert(targets))
    }

    fn submit(
        &self,
        model: &DrawnModel,
        uniform: &Uniform,
        units: &[u32],
        targets: &Targets,
        with_units: bool,
    ) {
        // One pass, cleared, with or without a second target for the units.
        let bindings = self.bindings(uniform);
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let count = if with_units { 2 } else { 1 };
        let attachments: Vec<_> = targets.colors[..count].iter().map(cleared).collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &attachments,
            depth_stencil_attachment: Some(targets.depth_attachment()),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(if with_units {
            &self.units_pipeline
        } else {
            &self.color_pipeline
        });
        pass.set_bind_group(0, &bindings, &[]);
        pass.set_vertex_buffer(0, model.vertices.slice(..));
        pass.set_index_buffer(model.indices.slice(..), wgpu::IndexFormat::Uint32);
        // One draw for each unit, which the shader knows by the instance's number.
        for &unit in units {
            pass.draw_indexed(model.units[unit as usize].clone(), 0, unit..unit + 1);
        }
        drop(pass);
        self.queue.submit([encoder.finish()]);
    }

    fn bindings(&self, uniform: &Uniform) -> wgpu::BindGroup {
        let buffer = self.device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: bytemuck::bytes_of(uniform),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: buffer.as_entire_binding(),
            }],
        })
    }
}

impl Targets {
    fn new(device: &wgpu::Device, size: UVec2) -> Self {
        Self {
            size,
            colors: [COLOR, UNIT].map(|format| Target::new(device, size, format)),
            depth: Target::new(device, size, DEPTH_BUFFER),
        }
    }

    fn depth_attachment(&self) -> wgpu::RenderPassDepthStencilAttachment<'_> {
        wgpu::RenderPassDepthStencilAttachment {
            view: &self.depth.view,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }
    }
}

fn cleared(target: &Target) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view: &target.view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            store: wgpu::StoreOp::Store,
        },
    })
}

fn pipeline(
    device: &wgpu::Device,
    bindings: &wgpu::BindGroupLayout,
    fragment: &str,
    formats: &[wgpu::TextureFormat],
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::include_wgsl!("shader.wgsl"));
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        bind_group_layouts: &[Some(bindings)],
        ..wgpu::PipelineLayoutDescriptor::default()
    });
    let targets: Vec<_> = formats.iter().map(|&format| Some(format.into())).collect();
    let options = wgpu::PipelineCompilationOptions::default();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: options.clone(),
            buffers: &[wgpu::VertexBufferLayout {
                array_stride: size_of::<Vertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &Vertex::ATTRIBUTES,
            }],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_BUFFER,
            depth_write_enabled: Some(true),
            // Nearness: greater is nearer.
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(fragment),
            compilation_options: options,
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
