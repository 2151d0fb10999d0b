//! The base colour texture of a model.

use fieldlod_bake::Surface;
use glam::UVec2;
use wgpu::util::{DeviceExt, TextureDataOrder};

/// The layout of a texture and its sampler.
pub(super) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[entry(0, texture), entry(1, sampler)],
    })
}

/// Uploads the texture of a surface with all its mips. Without a texture, uploads a single transparent texel, for which
/// the shader draws a pattern of waves.
pub(super) fn bind_group(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    surface: Option<&Surface>,
) -> wgpu::BindGroup {
    let mips: Vec<(UVec2, &[[u8; 4]])> = surface.map_or_else(Vec::new, |s| s.mips().collect());
    let texels: Vec<u8> = if mips.is_empty() {
        vec![0; 4]
    } else {
        let texels = mips.iter().flat_map(|(_, mip)| mip.as_flattened());
        texels.copied().collect()
    };
    let size = mips.first().map_or(UVec2::ONE, |(size, _)| *size);
    let descriptor = wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: size.x,
            height: size.y,
            depth_or_array_layers: 1,
        },
        mip_level_count: mips.len().max(1) as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let order = TextureDataOrder::LayerMajor;
    let texture = device.create_texture_with_data(queue, &descriptor, order, &texels);
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    });
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout(device),
        entries: &[
            wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            },
            wgpu::BindGroupEntry {
                binding: 1,
                resource: wgpu::BindingResource::Sampler(&sampler),
            },
        ],
    })
}
