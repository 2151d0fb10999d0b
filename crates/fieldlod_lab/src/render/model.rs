//! A hierarchy on the GPU.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fieldlod_bake::Surface;
use fieldlod_hierarchy::Hierarchy;
use glam::Vec3;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

use super::texture;

/// A hierarchy's vertices and the triangles of all its units, ready to be drawn.
#[derive(Debug)]
pub struct DrawnModel {
    pub(super) vertices: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    /// The range of each unit's indices.
    pub(super) units: Vec<Range<u32>>,
    /// The base colour texture.
    pub(super) texture: wgpu::BindGroup,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    uv: [f32; 2],
    color: [f32; 3],
}

impl Vertex {
    pub(super) const ATTRIBUTES: [wgpu::VertexAttribute; 4] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2, 3 => Float32x3];
}

impl DrawnModel {
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        hierarchy: &Hierarchy,
        surface: Option<&Surface>,
    ) -> Self {
        let (indices, units) = indices_of(hierarchy);
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor {
                label: None,
                contents,
                usage,
            })
        };
        let vertices = vertices_of(hierarchy, surface);
        Self {
            vertices: buffer(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer(bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
            units,
            texture: texture::bind_group(device, queue, surface),
        }
    }
}

fn vertices_of(hierarchy: &Hierarchy, surface: Option<&Surface>) -> Vec<Vertex> {
    let source = &hierarchy.vertices;
    // Meshes without normals get smooth normals.
    let computed;
    let normals = if source.normals.is_empty() {
        computed = smooth_normals(hierarchy);
        &computed
    } else {
        &source.normals
    };
    let tint = surface.map_or(Vec3::ONE, Surface::base_color);
    let mapping = surface.and_then(Surface::mapping).unwrap_or_default();
    let uvs = if mapping.uses_uvs_1 {
        &source.uvs_1
    } else {
        &source.uvs
    };
    let color = |index: usize| {
        let color = source.colors.get(index);
        let color = color.map_or(Vec3::ONE, |color| color.truncate());
        (color * tint).to_array()
    };
    let uv = |index: usize| {
        let uv = uvs.get(index).copied().unwrap_or_default();
        mapping.transform.transform_point2(uv).to_array()
    };
    let vertex = |index: usize| Vertex {
        position: source.positions[index].to_array(),
        normal: normals[index].to_array(),
        uv: uv(index),
        color: color(index),
    };
    (0..source.positions.len()).map(vertex).collect()
}

/// Computes area-weighted mean normals. For a source vertex, only source triangles count. For a moved vertex, all
/// triangles that use it count.
fn smooth_normals(hierarchy: &Hierarchy) -> Vec<Vec3> {
    let positions = &hierarchy.vertices.positions;
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for unit in &hierarchy.units {
        let is_source = unit.producer().is_none();
        for triangle in hierarchy.triangles_of(unit) {
            // The cross product is as long as twice the triangle's area.
            let [a, b, c] = triangle.map(|v| positions[v as usize]);
            // Triangles of coarser levels would change the normals of the reference.
            let counts = |&vertex: &u32| is_source || vertex >= hierarchy.source_vertex_count;
            for vertex in triangle.into_iter().filter(counts) {
                normals[vertex as usize] += (b - a).cross(c - a);
            }
        }
    }
    normals.into_iter().map(Vec3::normalize_or_zero).collect()
}

/// Lists the vertex indices of all triangles, unit by unit, and the range of each unit's indices.
fn indices_of(hierarchy: &Hierarchy) -> (Vec<u32>, Vec<Range<u32>>) {
    let mut indices = Vec::new();
    let mut units = Vec::with_capacity(hierarchy.units.len());
    for unit in &hierarchy.units {
        let first = indices.len() as u32;
        indices.extend(hierarchy.triangles_of(unit).flatten());
        units.push(first..indices.len() as u32);
    }
    (indices, units)
}
