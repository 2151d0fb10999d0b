//! The source mesh, and reasons why it cannot be baked.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use fieldlod_hierarchy::{SourceHash, Vertices};
use glam::{Vec2, Vec3, Vec4};
use thiserror::Error;

use crate::mesh::surface::Surface;

/// Coordinates beyond this are refused: their squares would overflow `f32`.
pub const MAX_COORDINATE: f32 = 1e18;

/// A triangle mesh in its local space. The attributes of its [`Vertices`] can be used as fields of the mesh.
///
/// Every attribute has one value per position, or is empty. Attributes that are not finite count as
/// zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SourceMesh {
    /// Positions and other attributes of the vertices.
    pub vertices: Vertices,
    /// Whether the source has attributes that [`Vertices`] cannot hold. The hierarchy then records the source vertex
    /// of each moved vertex.
    pub has_other_attributes: bool,
    /// What its material looks like, if that is known. Plain opaque white counts as unknown.
    pub surface: Option<Arc<Surface>>,
    /// Triangles: three indices into the positions each, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
}

/// Why a mesh cannot be baked.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum MeshError {
    /// No indices at all.
    #[error("it has no triangles")]
    NoTriangles,
    /// Something is left over after the last whole triangle.
    #[error("{count} indices are not a whole number of triangles")]
    PartialTriangle { count: usize },
    /// An index beyond the last vertex.
    #[error("index {position} is {index}, but there are only {vertices} vertices")]
    IndexOutOfRange {
        position: usize,
        index: u32,
        vertices: usize,
    },
    /// NaN, infinite or beyond [`MAX_COORDINATE`].
    #[error("vertex {vertex} lies at {position}, which is not finite or too far out")]
    BadPosition { vertex: usize, position: Vec3 },
    /// An attribute is there, but not for every vertex.
    #[error("{count} {attribute} for {vertices} vertices")]
    AttributeCount {
        attribute: &'static str,
        count: usize,
        vertices: usize,
    },
    /// More vertices or triangles than 32-bit counts allow.
    #[error("it is too large: at most {limit} vertices and {limit} triangles can be baked", limit = MAX_COUNT)]
    TooLarge,
    /// A skinned or morphed mesh has more vertices than 16-bit indices reach.
    #[error(
        "it has {vertices} vertices, but levels of a skinned or morphed mesh have at most 65,536"
    )]
    TooLargeForRig { vertices: usize },
    /// A field of the configuration is out of its documented range.
    #[error("the bake setting {field} is out of range")]
    Config { field: &'static str },
}

// All levels together hold about twice the source triangles, and three indices each.
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
    /// How many triangles the mesh has.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    /// The identity of this mesh, as a hierarchy records it.
    #[must_use]
    pub fn source_hash(&self) -> SourceHash {
        self.vertices.source_hash(&self.indices)
    }

    /// The vertices as a hierarchy holds them: attributes that are not finite are zero.
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

    /// The surface, if it changes pictures of the mesh: it is visible, not plain white, and the mesh has the texture
    /// coordinates that it needs.
    pub(crate) fn telling_surface(&self) -> Option<&Arc<Surface>> {
        let has_uvs = |surface: &Surface| match surface.mapping() {
            Some(mapping) if mapping.uses_uvs_1 => !self.uvs_1.is_empty(),
            Some(_) => !self.uvs.is_empty(),
            None => true,
        };
        let surface = self.surface.as_ref();
        surface.filter(|s| s.is_visible() && has_uvs(s) && !s.is_blank())
    }

    /// The same triangles with three vertices of their own and a flat normal each: what a renderer
    /// makes of a mesh without normals.
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

    /// Checks all that the simplifier takes on trust: it reads out of bounds or never ends on bad
    /// indices and NaN positions.
    ///
    /// # Errors
    /// The first fault found.
    pub fn validate(&self) -> Result<(), MeshError> {
        self.check_shape()?;
        self.check_positions()
    }

    /// [`Self::validate`] without positions.
    pub(crate) fn check_shape(&self) -> Result<(), MeshError> {
        self.check_counts()?;
        self.check_indices()
    }

    fn check_counts(&self) -> Result<(), MeshError> {
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
        match self.vertices.incomplete_attribute() {
            Some((attribute, count)) => Err(MeshError::AttributeCount {
                attribute,
                count,
                vertices,
            }),
            None => Ok(()),
        }
    }

    fn check_indices(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        let mut indices = self.indices.iter().enumerate();
        match indices.find(|&(_, &index)| index as usize >= vertices) {
            Some((position, &index)) => Err(MeshError::IndexOutOfRange {
                position,
                index,
                vertices,
            }),
            None => Ok(()),
        }
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
