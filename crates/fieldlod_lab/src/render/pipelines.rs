//! How triangles and cards are drawn in a pass.

use super::cards::{self, CardVertex};
use super::model::{PlacedUnits, Vertex};
use super::target::DEPTH_BUFFER;

/// The pipelines of a kind of pass.
#[derive(Debug)]
pub(super) struct Pipelines {
    triangles: wgpu::RenderPipeline,
    cards: wgpu::RenderPipeline,
}

/// What the pipelines of a pass have in common.
struct Pass<'a> {
    device: &'a wgpu::Device,
    module: wgpu::ShaderModule,
    /// Of the uniform of a place and the shadow map.
    bindings: &'a wgpu::BindGroupLayout,
    formats: &'a [wgpu::TextureFormat],
}

impl Pipelines {
    /// Pictures: `fragment` writes targets of these formats, for cards the one that is named after it.
    pub(super) fn new(
        device: &wgpu::Device,
        bindings: &wgpu::BindGroupLayout,
        fragment: &str,
        formats: &[wgpu::TextureFormat],
    ) -> Self {
        let pass = Pass::new(device, bindings, formats);
        Self {
            triangles: pass.of_triangles("vertex", Some(fragment)),
            cards: pass.of_cards("card_vertex", &format!("card_{fragment}")),
        }
    }

    /// Depths as the light sees them.
    pub(super) fn of_shadows(device: &wgpu::Device, bindings: &wgpu::BindGroupLayout) -> Self {
        let pass = Pass::new(device, bindings, &[]);
        Self {
            triangles: pass.of_triangles("shadow_vertex", None),
            cards: pass.of_cards("card_shadow_vertex", "card_shadow"),
        }
    }

    /// Draws what is placed, by uniforms that lie `stride` apart.
    pub(super) fn draw(
        &self,
        pass: &mut wgpu::RenderPass,
        bindings: &wgpu::BindGroup,
        stride: usize,
        placed: &[PlacedUnits],
    ) {
        pass.set_pipeline(&self.triangles);
        for (index, placed) in placed.iter().enumerate() {
            let model = placed.model;
            pass.set_bind_group(0, bindings, &[(index * stride) as u32]);
            pass.set_vertex_buffer(0, model.vertices.slice(..));
            pass.set_index_buffer(model.indices.slice(..), wgpu::IndexFormat::Uint32);
            // One draw for each unit, which the shader knows by the instance's number.
            for &unit in placed.units {
                if model.card_indices(unit).is_none() {
                    let id = placed.first_id + unit;
                    pass.draw_indexed(model.units[unit as usize].clone(), 0, id..id + 1);
                }
            }
        }
        pass.set_pipeline(&self.cards);
        for (index, placed) in placed.iter().enumerate() {
            let Some(cards) = &placed.model.cards else {
                continue;
            };
            pass.set_bind_group(0, bindings, &[(index * stride) as u32]);
            pass.set_bind_group(1, &cards.picture, &[]);
            pass.set_vertex_buffer(0, cards.vertices.slice(..));
            pass.set_index_buffer(cards.indices.slice(..), wgpu::IndexFormat::Uint32);
            for &unit in placed.units {
                if let Some(indices) = cards.indices_of(unit) {
                    let id = placed.first_id + unit;
                    pass.draw_indexed(indices, 0, id..id + 1);
                }
            }
        }
    }
}

impl<'a> Pass<'a> {
    fn new(
        device: &'a wgpu::Device,
        bindings: &'a wgpu::BindGroupLayout,
        formats: &'a [wgpu::TextureFormat],
    ) -> Self {
        Self {
            device,
            module: device.create_shader_module(wgpu::include_wgsl!("shader.wgsl")),
            bindings,
            formats,
        }
    }

    fn of_triangles(&self, vertex: &str, fragment: Option<&str>) -> wgpu::RenderPipeline {
        let buffer = wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &Vertex::ATTRIBUTES,
        };
        self.pipeline(&[Some(self.bindings)], vertex, buffer, fragment)
    }

    fn of_cards(&self, vertex: &str, fragment: &str) -> wgpu::RenderPipeline {
        let buffer = wgpu::VertexBufferLayout {
            array_stride: size_of::<CardVertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &CardVertex::ATTRIBUTES,
        };
        let picture = cards::layout(self.device);
        let layouts = [Some(self.bindings), Some(&picture)];
        self.pipeline(&layouts, vertex, buffer, Some(fragment))
    }

    fn pipeline(
        &self,
        layouts: &[Option<&wgpu::BindGroupLayout>],
        vertex: &str,
        buffer: wgpu::VertexBufferLayout<'_>,
        fragment: Option<&str>,
    ) -> wgpu::RenderPipeline {
        let layout = wgpu::PipelineLayoutDescriptor {
            bind_group_layouts: layouts,
            ..wgpu::PipelineLayoutDescriptor::default()
        };
        let layout = self.device.create_pipeline_layout(&layout);
        let targets = self.formats.iter().map(|&format| Some(format.into()));
        let targets: Vec<_> = targets.collect();
        let options = wgpu::PipelineCompilationOptions::default();
        let descriptor = wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some(vertex),
                compilation_options: options.clone(),
                buffers: &[buffer],
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
            fragment: fragment.map(|entry_point| wgpu::FragmentState {
                module: &self.module,
                entry_point: Some(entry_point),
                compilation_options: options,
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        };
        self.device.create_render_pipeline(&descriptor)
    }
}
