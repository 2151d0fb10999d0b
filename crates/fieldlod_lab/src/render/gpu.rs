//! The adapter, its pipelines, and drawing.

use std::cell::RefCell;
use std::time::{Duration, Instant};

use fieldlod_hierarchy::{Hierarchy, Sphere};
use glam::UVec2;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

use super::camera::{Uniform, WorldView};
use super::model::{DrawnModel, PlacedUnits};
use super::picture::{Picture, UnitMap};
use super::pipelines::Pipelines;
use super::target::{DEPTH_BUFFER, Target, extent, wait};
use super::{RenderError, SUPERSAMPLING};
use crate::eye::Eye;

const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const UNIT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
/// Texels along a side of the shadow map.
const SHADOW_TEXELS: u32 = 2048;

/// Draws cuts without a window.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: String,
    layout: wgpu::BindGroupLayout,
    color_pipelines: Pipelines,
    units_pipelines: Pipelines,
    shadow_pipelines: Pipelines,
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
        // One uniform for all shaders, and what they know of shadows.
        let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: wgpu::BufferSize::new(size_of::<Uniform>() as u64),
        };
        let shadow_map = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[
                entry(0, wgpu::ShaderStages::VERTEX_FRAGMENT, uniform),
                entry(1, wgpu::ShaderStages::FRAGMENT, shadow_map),
            ],
        });
        Self {
            color_pipelines: Pipelines::new(&device, &layout, "color", &[COLOR]),
            units_pipelines: Pipelines::new(&device, &layout, "color_and_unit", &[COLOR, UNIT]),
            shadow_pipelines: Pipelines::of_shadows(&device, &layout),
            device,
            queue,
            adapter,
            layout,
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
        DrawnModel::new(&self.device, &self.queue, hierarchy)
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
        let view = WorldView::new(eye, None)?;
        self.with_targets(view.size_px * SUPERSAMPLING, |targets| {
            // The time ends when the adapter is done, before the picture is read.
            let start = Instant::now();
            let placed = [PlacedUnits::at_origin(model, units)];
            self.submit(&placed, &view, targets, false);
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
        self.draw_scene(&[PlacedUnits::at_origin(model, units)], eye, None)
    }

    /// Draws units of many models and tells which of them each texel shows, with shadows of the light
    /// within a sphere of the world, or without.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn draw_scene(
        &self,
        placed: &[PlacedUnits],
        eye: &Eye,
        shadows: Option<&Sphere>,
    ) -> Result<(Picture, UnitMap), RenderError> {
        let view = WorldView::new(eye, shadows)?;
        self.with_targets(view.size_px * SUPERSAMPLING, |targets| {
            self.submit(placed, &view, targets, true);
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
        placed: &[PlacedUnits],
        view: &WorldView,
        targets: &Targets,
        with_units: bool,
    ) {
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        // Uniforms of all places, each at a multiple of what the adapter asks for.
        let alignment = self.device.limits().min_uniform_buffer_offset_alignment as usize;
        let stride = size_of::<Uniform>().next_multiple_of(alignment);
        let mut uniforms = vec![0; stride * placed.len().max(1)];
        for (placed, bytes) in placed.iter().zip(uniforms.chunks_exact_mut(stride)) {
            let uniform = view.of_place(&placed.world_from_local);
            bytes[..size_of::<Uniform>()].copy_from_slice(bytemuck::bytes_of(&uniform));
        }
        let uniforms = self.device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: &uniforms,
            usage: wgpu::BufferUsages::UNIFORM,
        });
        // What the light sees, if there are shadows.
        let no_map = self.shadow_map(1);
        let map = if view.has_shadows() {
            let map = self.shadow_map(SHADOW_TEXELS);
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                depth_stencil_attachment: Some(depth_attachment(&map, wgpu::StoreOp::Store)),
                ..wgpu::RenderPassDescriptor::default()
            });
            let bindings = self.bindings(&uniforms, &no_map);
            self.shadow_pipelines
                .draw(&mut pass, &bindings, stride, placed);
            map
        } else {
            no_map
        };
        // One pass, cleared, with or without a second target for the units.
        let count = if with_units { 2 } else { 1 };
        let attachments: Vec<_> = targets.colors[..count].iter().map(cleared).collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &attachments,
            depth_stencil_attachment: Some(depth_attachment(
                &targets.depth.view,
                wgpu::StoreOp::Discard,
            )),
            ..wgpu::RenderPassDescriptor::default()
        });
        let pipelines = if with_units {
            &self.units_pipelines
        } else {
            &self.color_pipelines
        };
        pipelines.draw(&mut pass, &self.bindings(&uniforms, &map), stride, placed);
        drop(pass);
        self.queue.submit([encoder.finish()]);
    }

    fn shadow_map(&self, texels: u32) -> wgpu::TextureView {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: extent(UVec2::splat(texels)),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: DEPTH_BUFFER,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    fn bindings(&self, uniforms: &wgpu::Buffer, shadow_map: &wgpu::TextureView) -> wgpu::BindGroup {
        let uniform = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: uniforms,
            offset: 0,
            size: wgpu::BufferSize::new(size_of::<Uniform>() as u64),
        });
        let shadow_map = wgpu::BindingResource::TextureView(shadow_map);
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &[(0, uniform), (1, shadow_map)].map(entry),
        })
    }
}

fn depth_attachment(
    view: &wgpu::TextureView,
    store: wgpu::StoreOp,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: wgpu::LoadOp::Clear(0.0),
            store,
        }),
        stencil_ops: None,
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
