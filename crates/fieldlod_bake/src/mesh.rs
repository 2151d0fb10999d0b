//! The mesh that goes in, and what may be wrong with it.

use fieldlod_hierarchy::SourceHash;
use glam::{Vec2, Vec3};
use thiserror::Error;

/// Coordinates beyond this are refused: their squares would overflow `f32`.
pub const MAX_COORDINATE: f32 = 1e18;

/// A triangle mesh in its local space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SourceMesh {
    /// Positions in local units.
    pub positions: Vec<Vec3>,
    /// Unit normals, one per position, or empty. Normals that are not finite count as zero.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per position, or empty. Those that are not finite count as zero.
    pub uvs: Vec<Vec2>,
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
    /// A unit's triangles have 16-bit indices.
    #[error("a drawable unit would have {vertices} vertices, over 65535: lower group_clusters")]
    UnitTooLarge { vertices: usize },
    /// A field of the configuration is out of its documented range.
    #[error("the bake setting {field} is out of range")]
    Config { field: &'static str },
}

// All levels together hold about twice the source triangles, and three indices each.
const MAX_COUNT: usize = u32::MAX as usize / 8;

impl SourceMesh {
    /// How many triangles the mesh has.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    /// The identity of this mesh, as a hierarchy records it.
    #[must_use]
    pub fn source_hash(&self) -> SourceHash {
        SourceHash::of(&self.positions, self.indices.iter().copied())
    }

    /// The same triangles with three vertices of their own and a flat normal each: what a renderer
    /// makes of a mesh without normals.
    ///
    /// # Panics
    /// If an index is out of range.
    #[must_use]
    pub fn without_shared_vertices(&self) -> Self {
        let corners = self.indices.iter().map(|&index| index as usize);
        let positions: Vec<Vec3> = corners.clone().map(|v| self.positions[v]).collect();
        let uvs = corners.filter_map(|v| self.uvs.get(v)).copied().collect();
        let (triangles, _) = positions.as_chunks::<3>();
        let flat = |[a, b, c]: &[Vec3; 3]| [(b - a).cross(c - a).normalize_or_zero(); 3];
        Self {
            normals: triangles.iter().flat_map(flat).collect(),
            uvs,
            indices: (0..positions.len() as u32).collect(),
            positions,
        }
    }

    /// Checks all that the simplifier takes on trust: it reads out of bounds or never ends on bad
    /// indices and NaN positions.
    ///
    /// # Errors
    /// The first fault found.
    pub fn validate(&self) -> Result<(), MeshError> {
        self.check_counts()?;
        self.check_indices()?;
        self.check_positions()
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
        let counts = [("normals", self.normals.len()), ("uvs", self.uvs.len())];
        match counts
            .into_iter()
            .find(|&(_, count)| count != 0 && count != vertices)
        {
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
