//! Surfaces of a mesh that was joined from one or more parts.

use std::sync::Arc;

use fieldlod_hierarchy::{Hierarchy, Vertices};
use glam::{Vec2, Vec3, Vec4};

use crate::mesh::SourceMesh;
use crate::mesh::surface::Surface;

/// Mean of the source's colour channels in pictures. The exposure scales colours to it.
const EXPOSURE: f32 = 0.35;

/// Surfaces of the parts of a mesh, in the order of their vertices.
#[derive(Clone, Default)]
pub(crate) struct Surfaces {
    parts: Vec<Part>,
}

#[derive(Clone)]
struct Part {
    /// End of the part's range of source vertices.
    end: u32,
    /// The surface, if known.
    surface: Option<Arc<Surface>>,
}

/// Surface and texture coordinates of each vertex of a hierarchy.
pub(crate) struct VertexSurfaces<'a> {
    pub(crate) surfaces: Vec<Option<&'a Surface>>,
    /// Texture coordinates that the vertex's surface uses.
    pub(crate) uvs: Vec<Vec2>,
}

impl Surfaces {
    pub(crate) fn of<'a>(parts: impl IntoIterator<Item = &'a SourceMesh>) -> Self {
        let mut end = 0;
        let parts = parts.into_iter().map(|mesh| {
            end += mesh.positions.len() as u32;
            Part {
                end,
                surface: mesh.visible_surface().cloned(),
            }
        });
        Self {
            parts: parts.collect(),
        }
    }

    /// Whether the mesh was joined from several parts.
    pub(crate) fn is_joined(&self) -> bool {
        self.parts.len() > 1
    }

    /// Surface and texture coordinates of each vertex of a hierarchy.
    pub(crate) fn vertex_surfaces(&self, hierarchy: &Hierarchy) -> VertexSurfaces<'_> {
        let vertices = &hierarchy.vertices;
        let all = 0..vertices.positions.len() as u32;
        let surface = |vertex: u32| self.of_vertex(hierarchy.origin_of(vertex).unwrap_or(0));
        let surfaces: Vec<Option<&Surface>> = all.clone().map(surface).collect();
        let uv = |vertex: u32| {
            let uvs = uvs_of(surfaces[vertex as usize], vertices);
            uvs.get(vertex as usize).copied().unwrap_or_default()
        };
        let uvs = all.map(uv).collect();
        VertexSurfaces { surfaces, uvs }
    }

    /// Whether any part has a known surface.
    pub(crate) fn any_known(&self) -> bool {
        self.parts.iter().any(|part| part.surface.is_some())
    }

    /// Whether there are parts, and all have known surfaces.
    pub(crate) fn all_known(&self) -> bool {
        !self.parts.is_empty() && self.parts.iter().all(|part| part.surface.is_some())
    }

    /// Whether a known surface has a texture.
    pub(crate) fn any_textured(&self) -> bool {
        let mut surfaces = self.parts.iter().flat_map(|part| &part.surface);
        surfaces.any(|surface| surface.mapping().is_some())
    }

    /// Whether a known surface is blended.
    pub(crate) fn any_blended(&self) -> bool {
        let mut surfaces = self.parts.iter().flat_map(|part| &part.surface);
        surfaces.any(|surface| surface.is_blended())
    }

    /// Index of the part of a source vertex.
    pub(crate) fn part_of(&self, vertex: u32) -> usize {
        self.parts.partition_point(|part| part.end <= vertex)
    }

    /// Surface of a source vertex, if known.
    pub(crate) fn of_vertex(&self, vertex: u32) -> Option<&Surface> {
        let part = self.part_of(vertex);
        self.parts.get(part)?.surface.as_deref()
    }

    /// End of the vertex range of each part, and the mean of its surface's colour channels.
    fn mean_channels(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let mean = |surface: &Surface| surface.mean_color().element_sum() / 3.0;
        let parts = self.parts.iter();
        parts.map(move |part| (part.end, part.surface.as_deref().map_or(1.0, mean)))
    }

    /// Factor for colours in pictures of the source and its levels. Vertices without a colour count as white.
    pub(crate) fn exposure(&self, source_colors: &[Vec4]) -> f32 {
        if source_colors.is_empty() && !self.any_known() {
            return EXPOSURE;
        }
        let (mut sum, mut vertices) = (0.0f32, 0u32);
        for (end, surface) in self.mean_channels() {
            for vertex in vertices..end {
                sum += picture_color(source_colors.get(vertex as usize)).element_sum() * surface;
            }
            vertices = end;
        }
        if sum > 0.0 {
            EXPOSURE * (vertices * 3) as f32 / sum
        } else {
            EXPOSURE
        }
    }
}

/// Colour of a vertex in pictures: white without a colour. Negative values become 0, because colours may hold other
/// data.
pub(crate) fn picture_color(color: Option<&Vec4>) -> Vec3 {
    color.map_or(Vec3::ONE, |color| color.truncate().max(Vec3::ZERO))
}

/// Texture coordinates that a surface uses; empty if the mesh does not have them.
fn uvs_of<'a>(surface: Option<&Surface>, vertices: &'a Vertices) -> &'a [Vec2] {
    match surface.and_then(Surface::mapping) {
        Some(mapping) if mapping.uses_uvs_1 => &vertices.uvs_1,
        _ => &vertices.uvs,
    }
}
