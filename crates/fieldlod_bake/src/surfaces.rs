//! What the parts of a mesh look like.

use std::sync::Arc;

use crate::mesh::SourceMesh;
use crate::surface::Surface;

/// The surfaces of a mesh of one or more parts, in the order of their vertices.
#[derive(Clone, Default)]
pub(crate) struct Surfaces {
    /// Up to which of the source's vertices each part reaches, and its surface if that is known.
    parts: Vec<(u32, Option<Arc<Surface>>)>,
}

impl Surfaces {
    pub(crate) fn of<'a>(parts: impl IntoIterator<Item = &'a SourceMesh>) -> Self {
        let mut end = 0;
        let parts = parts.into_iter().map(|mesh| {
            end += mesh.positions.len() as u32;
            (end, mesh.telling_surface().cloned())
        });
        Self {
            parts: parts.collect(),
        }
    }

    /// Whether that of any part is known.
    pub(crate) fn any_known(&self) -> bool {
        self.parts.iter().any(|(_, surface)| surface.is_some())
    }

    /// That of the part of a vertex of the source.
    pub(crate) fn of_vertex(&self, vertex: u32) -> Option<&Surface> {
        let part = self.parts.partition_point(|&(end, _)| end <= vertex);
        self.parts.get(part)?.1.as_deref()
    }

    /// By what the surface multiplies the colours of the vertices of each part in the mean, and where the part ends.
    pub(crate) fn mean_tints(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let tint = |surface: &Surface| surface.mean_color().element_sum() / 3.0;
        let parts = self.parts.iter();
        parts.map(move |(end, surface)| (*end, surface.as_deref().map_or(1.0, tint)))
    }
}
