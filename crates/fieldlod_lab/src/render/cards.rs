//! Cards on the adapter: rectangles that show parts of one picture, where that is half opaque or more.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fieldlod_hierarchy::{CardPicture, Cards, Hierarchy};
use wgpu::util::{BufferInitDescriptor, DeviceExt, TextureDataOrder};

use super::target::extent;

/// The cards of a hierarchy of whole meshes, ready to be drawn.
#[derive(Debug)]
pub(super) struct DrawnCards {
    pub(super) vertices: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    /// The picture and how it is read.
    pub(super) picture: wgpu::BindGroup,
    /// The first unit that is cards: so are all that follow.
    first_unit: usize,
    /// The range of the indices of each.
    levels: Vec<Range<u32>>,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CardVertex {
    position: [f32; 3],
    tangent: [f32; 3],
    bitangent: [f32; 3],
    uv: [f32; 2],
    tint: [f32; 3],
}

impl CardVertex {
    pub(super) const ATTRIBUTES: [wgpu::VertexAttribute; 5] = wgpu::vertex_attr_array![
        0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Float32x2, 4 => Float32x3
    ];
}

impl DrawnCards {
    /// `None` of a hierarchy of which no unit is cards.
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        hierarchy: &Hierarchy,
    ) -> Option<Self> {
        let units = hierarchy.card_units();
        let cards = hierarchy.cards.as_ref().filter(|_| !units.is_empty())?;
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor {
                label: None,
                contents,
                usage,
            })
        };
        let vertices = vertices_of(cards);
        let corners = (0..vertices.len() as u32).step_by(4);
        let indices = corners.flat_map(|a| [a, a + 1, a + 2, a, a + 2, a + 3]);
        let indices: Vec<u32> = indices.collect();
        let mut end = 0;
        let range = |count: usize| {
            let first = end;
            end += 6 * count as u32;
            first..end
        };
        let counts = cards.levels.iter().map(|level| level.cards.len());
        Some(Self {
            vertices: buffer(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer(bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
            picture: bindings_of(device, queue, &cards.picture),
            first_unit: units.start,
            levels: counts.map(range).collect(),
        })
    }

    /// The indices of a unit that is cards.
    pub(super) fn indices_of(&self, unit: u32) -> Option<Range<u32>> {
        let level = (unit as usize).checked_sub(self.first_unit)?;
        self.levels.get(level).cloned()
    }
}

/// Four of each card of all levels.
fn vertices_of(cards: &Cards) -> Vec<CardVertex> {
    let all = cards.levels.iter().flat_map(|level| &level.cards);
    let vertices = all.flat_map(|card| {
        let [tangent, bitangent, _] = card.axes().map(|axis| axis.to_array());
        let corners = card.corners().into_iter();
        let uvs = card.uvs(cards.picture.side_texels);
        corners.zip(uvs).map(move |(position, uv)| CardVertex {
            position: position.to_array(),
            tangent,
            bitangent,
            uv: uv.to_array(),
            tint: cards.picture.tint.to_array(),
        })
    });
    vertices.collect()
}

/// What the shader knows of a picture.
pub(super) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[(0, texture), (1, texture), (2, sampler)].map(entry),
    })
}

/// The picture in all sizes, which are mixed as games do it.
fn bindings_of(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    picture: &CardPicture,
) -> wgpu::BindGroup {
    let mips = picture.mips();
    let opaque = |&[x, y, z]: &[u8; 3]| [x, y, z, u8::MAX];
    let colors = mips.iter().flat_map(|mip| &mip.colors).copied().collect();
    let normals = mips.iter().flat_map(|mip| mip.normals.iter().map(opaque));
    let view = |texels: Vec<[u8; 4]>, format| {
        let descriptor = wgpu::TextureDescriptor {
            label: None,
            size: extent(glam::UVec2::splat(picture.side_texels)),
            mip_level_count: mips.len() as u32,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        };
        let order = TextureDataOrder::LayerMajor;
        let texture =
            device.create_texture_with_data(queue, &descriptor, order, texels.as_flattened());
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    };
    let colors = view(colors, wgpu::TextureFormat::Rgba8UnormSrgb);
    let normals = view(normals.collect(), wgpu::TextureFormat::Rgba8Unorm);
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    });
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout(device),
        entries: &[
            (0, wgpu::BindingResource::TextureView(&colors)),
            (1, wgpu::BindingResource::TextureView(&normals)),
            (2, wgpu::BindingResource::Sampler(&sampler)),
        ]
        .map(entry),
    })
}
