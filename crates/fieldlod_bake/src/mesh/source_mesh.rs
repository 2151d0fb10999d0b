//! The source mesh, and errors of invalid meshes.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use fieldlod_hierarchy::{SourceHash, Vertices};
use glam::{Vec2, Vec3, Vec4};
use thiserror::Error;

use crate::mesh::surface::Surface;

/// Limit for coordinates: squares of larger coordinates would overflow `f32`.
pub const MAX_COORDINATE: f32 = 1e18;

/// A triangle mesh in its local space. It dereferences to its [`Vertices`].
///
/// Every attribute has one value per position, or is empty. Attributes that are not finite count as zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SourceMesh {
    /// Positions and other attributes of the vertices.
    pub vertices: Vertices,
    /// Whether the source has attributes that [`Vertices`] cannot hold. The hierarchy then records the source vertex
    /// of each moved vertex.
    pub has_other_attributes: bool,
    /// Colour and opacity of its material, if known. Plain opaque white counts as unknown.
    pub surface: Option<Arc<Surface>>,
    /// Three indices per triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
}

/// Errors of meshes that cannot be baked.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum MeshError {
    /// There are no indices.
    #[error("the mesh has no triangles")]
    NoTriangles,
    /// The number of indices is not a multiple of three.
    #[error("the number of indices, {count}, is not a multiple of 3")]
    PartialTriangle { count: usize },
    /// An index is beyond the last vertex.
    #[error("index {position} is {index}, but there are only {vertices} vertices")]
    IndexOutOfRange {
        position: usize,
        index: u32,
        vertices: usize,
    },
    /// A position is NaN, infinite or beyond [`MAX_COORDINATE`].
    #[error("vertex {vertex} lies at {position}, which is not finite or too far out")]
    BadPosition { vertex: usize, position: Vec3 },
    /// An attribute does not have one value per vertex.
    #[error("{count} {attribute} for {vertices} vertices")]
    AttributeCount {
        attribute: &'static str,
        count: usize,
        vertices: usize,
    },
    /// There are so many vertices or triangles that indices of all levels could exceed 32 bits.
    #[error("the mesh is too large: at most {limit} vertices and {limit} triangles are supported", limit = MAX_COUNT)]
    TooLarge,
    /// A skinned or morphed mesh has more vertices than 16-bit indices allow.
    #[error(
        "the mesh has {vertices} vertices, but skinned and morphed meshes may have at most 65,536"
    )]
    TooLargeForRig { vertices: usize },
    /// A field of the configuration is out of its documented range.
    #[error("the bake setting {field} is out of range")]
    Config { field: &'static str },
}

/// Limit for vertices and triangles. All levels together have about twice the triangles, with three indices each.
const MAX_COUNT: usize = u32::MAX as usize / 8;

impl Deref for SourceMesh {
    type Target = Vertices;

    fn deref(&self) -> &Vertices {
        &self.vertices
    }
}

impl DerefMut for SourceMesh {
    fn deref_mut(&mut self) -> &mut Vertices {
        &mut self.vertices
    }
}

impl SourceMesh {
    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    /// Hash of this mesh, which a hierarchy stores to recognize its source.
    #[must_use]
    pub fn source_hash(&self) -> SourceHash {
        self.vertices.source_hash(&self.indices)
    }

    /// The vertices as a hierarchy stores them: values that are not finite become zero.
    #[must_use]
    pub fn finite_vertices(&self) -> Vertices {
        Vertices {
            positions: self.positions.clone(),
            normals: finite_or_zero(&self.normals, Vec3::is_finite),
            uvs: finite_or_zero(&self.uvs, Vec2::is_finite),
            tangents: finite_or_zero(&self.tangents, Vec4::is_finite),
            uvs_1: finite_or_zero(&self.uvs_1, Vec2::is_finite),
            colors: finite_or_zero(&self.colors, Vec4::is_finite),
        }
    }

    /// The surface, if it affects pictures of the mesh: visible, not plain white with opaque vertices, and with the
    /// texture coordinates that it needs.
    pub(crate) fn visible_surface(&self) -> Option<&Arc<Surface>> {
        let has_uvs = |surface: &Surface| match surface.mapping() {
            Some(mapping) if mapping.uses_uvs_1 => !self.uvs_1.is_empty(),
            Some(_) => !self.uvs.is_empty(),
            None => true,
        };
        let surface = self.surface.as_ref();
        let has_alpha = |s: &Surface| s.uses_alpha() && self.colors.iter().any(|c| c.w < 1.0);
        surface.filter(|s| s.is_visible() && has_uvs(s) && (!s.is_blank() || has_alpha(s)))
    }

    /// The mesh with three vertices and a flat normal per triangle, as renderers draw meshes without normals.
    ///
    /// # Panics
    /// If an index is out of range.
    #[must_use]
    pub fn without_shared_vertices(&self) -> Self {
        let mut vertices = self.vertices.at(&self.indices);
        let (triangles, _) = vertices.positions.as_chunks::<3>();
        let flat = |[a, b, c]: &[Vec3; 3]| [(b - a).cross(c - a).normalize_or_zero(); 3];
        vertices.normals = triangles.iter().flat_map(flat).collect();
        Self {
            indices: (0..vertices.positions.len() as u32).collect(),
            vertices,
            ..self.clone()
        }
    }

    /// Checks the requirements of the simplifier. With invalid indices or NaN positions it would read out of bounds or
    /// never end.
    ///
    /// # Errors
    /// The first fault found.
    pub fn validate(&self) -> Result<(), MeshError> {
        self.check_shape()?;
        self.check_positions()
    }

    /// [`Self::validate`] without the positions.
    pub(crate) fn check_shape(&self) -> Result<(), MeshError> {
        // Counts come first: their errors are the clearest.
        let count = self.indices.len();
        if count == 0 {
            return Err(MeshError::NoTriangles);
        }
        if !count.is_multiple_of(3) {
            return Err(MeshError::PartialTriangle { count });
        }
        let vertices = self.positions.len();
        if vertices > MAX_COUNT || count / 3 > MAX_COUNT {
            return Err(MeshError::TooLarge);
        }
        if let Some((attribute, count)) = self.vertices.incomplete_attribute() {
            return Err(MeshError::AttributeCount {
                attribute,
                count,
                vertices,
            });
        }
        check_indices(&self.indices, vertices)
    }

    fn check_positions(&self) -> Result<(), MeshError> {
        let usable = |p: &Vec3| p.is_finite() && p.abs().max_element() <= MAX_COORDINATE;
        let mut positions = self.positions.iter().enumerate();
        match positions.find(|&(_, position)| !usable(position)) {
            Some((vertex, &position)) => Err(MeshError::BadPosition { vertex, position }),
            None => Ok(()),
        }
    }
}

/// Checks that no index is beyond the last vertex.
pub(crate) fn check_indices(indices: &[u32], vertices: usize) -> Result<(), MeshError> {
    let mut indices = indices.iter().enumerate();
    match indices.find(|&(_, &index)| index as usize >= vertices) {
        Some((position, &index)) => Err(MeshError::IndexOutOfRange {
            position,
            index,
            vertices,
        }),
        None => Ok(()),
    }
}

fn finite_or_zero<V: Copy + Default>(values: &[V], is_finite: impl Fn(V) -> bool) -> Vec<V> {
    let usable = |&value: &V| {
        if is_finite(value) {
            value
        } else {
            V::default()
        }
    };
    values.iter().map(usable).collect()
}
