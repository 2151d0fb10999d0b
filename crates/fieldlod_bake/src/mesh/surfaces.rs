//! What the parts of a mesh look like.

use std::sync::Arc;

use fieldlod_hierarchy::Hierarchy;
use glam::{Vec2, Vec3};

use crate::mesh::SourceMesh;
use crate::mesh::surface::{Surface, uvs_of};

/// The surfaces of a mesh of one or more parts, in the order of their vertices.
#[derive(Clone, Default)]
pub(crate) struct Surfaces {
    parts: Vec<Part>,
    /// Whether pictures may stand for all of them.
    are_usable: bool,
}

#[derive(Clone)]
struct Part {
    /// Up to which of the source's vertices it reaches.
    end: u32,
    /// If that is known.
    surface: Option<Arc<Surface>>,
    is_double_sided: bool,
}

/// What the vertices of a hierarchy look like.
pub(crate) struct Looks<'a> {
    pub(crate) surfaces: Vec<Option<&'a Surface>>,
    /// The texture coordinates by which each goes.
    pub(crate) uvs: Vec<Vec2>,
}

impl Surfaces {
    pub(crate) fn of<'a>(parts: impl IntoIterator<Item = &'a SourceMesh>) -> Self {
        let (mut end, mut are_usable) = (0, true);
        let parts = parts.into_iter().map(|mesh| {
            end += mesh.positions.len() as u32;
            are_usable &= mesh.usable_surface().is_some();
            Part {
                end,
                surface: mesh.telling_surface().cloned(),
                is_double_sided: mesh
                    .surface
                    .as_deref()
                    .is_some_and(Surface::is_double_sided),
            }
        });
        Self {
            parts: parts.collect(),
            are_usable,
        }
    }

    /// Whether it is known of every part what a picture of it shows.
    pub(crate) fn are_usable(&self) -> bool {
        self.are_usable
    }

    pub(crate) fn part_count(&self) -> usize {
        self.parts.len()
    }

    /// Which part a vertex of the source belongs to.
    pub(crate) fn part_of(&self, vertex: u32) -> usize {
        self.parts.partition_point(|part| part.end <= vertex)
    }

    /// The base colour of a part, white if that is not known.
    pub(crate) fn base_color(&self, part: usize) -> Vec3 {
        let surface = self
            .parts
            .get(part)
            .and_then(|part| part.surface.as_deref());
        surface.map_or(Vec3::ONE, Surface::base_color)
    }

    /// Whether backs of a part are lit as fronts turned over.
    pub(crate) fn is_double_sided(&self, part: usize) -> bool {
        self.parts[part].is_double_sided
    }

    /// What all vertices of a hierarchy look like.
    pub(crate) fn looks_of(&self, hierarchy: &Hierarchy) -> Looks<'_> {
        let vertices = &hierarchy.vertices;
        let all = 0..vertices.positions.len() as u32;
        let surface = |vertex: u32| self.of_vertex(hierarchy.origin_of(vertex).unwrap_or(0));
        let surfaces: Vec<Option<&Surface>> = all.clone().map(surface).collect();
        let uv = |vertex: u32| {
            let uvs = uvs_of(surfaces[vertex as usize], vertices);
            uvs.get(vertex as usize).copied().unwrap_or_default()
        };
        let uvs = all.map(uv).collect();
        Looks { surfaces, uvs }
    }

    /// Whether that of any part is known.
    pub(crate) fn any_known(&self) -> bool {
        self.parts.iter().any(|part| part.surface.is_some())
    }

    /// That of the part of a vertex of the source.
    pub(crate) fn of_vertex(&self, vertex: u32) -> Option<&Surface> {
        self.parts.get(self.part_of(vertex))?.surface.as_deref()
    }

    /// By what the surface multiplies the colours of the vertices of each part in the mean, and where the part ends.
    pub(crate) fn mean_tints(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let tint = |surface: &Surface| surface.mean_color().element_sum() / 3.0;
        let parts = self.parts.iter();
        parts.map(move |part| (part.end, part.surface.as_deref().map_or(1.0, tint)))
    }
}
