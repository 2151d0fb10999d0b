//! The vertices of all levels as the simplifier sees them: scaled, so that its 32-bit sums of squares
//! keep their precision whatever the units of the mesh. The source's come first, and after them those
//! that simplification makes.

use fieldlod_hierarchy::Vertices;
use glam::Vec3;
use meshopt::{SimplifyVertex, VertexDataAdapter};
use rustc_hash::FxHashMap;

use crate::config::BakeConfig;
use crate::levels::attributes::AttributeLayout;
use crate::mesh::SourceMesh;
use crate::mesh::edges::Links;
use crate::mesh::surface::Surface;
use crate::mesh::surfaces::Surfaces;

/// All vertices so far.
pub(crate) struct LevelVertices {
    /// Positions times `1 / local_from_scaled`.
    pub(crate) positions: Vec<[f32; 3]>,
    /// A power of two: scaled lengths times this are local lengths, without rounding.
    pub(crate) local_from_scaled: f32,
    pub(crate) layout: AttributeLayout,
    /// A row for each vertex.
    attributes: Vec<f32>,
    /// For each vertex, the first vertex at the same position.
    pub(crate) same_position: Vec<u32>,
    /// For each vertex, whether it lies on a texture seam to keep.
    pub(crate) protection: Vec<SimplifyVertex>,
    /// For each vertex, whether the source has an open edge at its position.
    pub(crate) is_border: Vec<bool>,
    /// For each vertex, the source vertex that it came from: itself, for one of the source.
    pub(crate) origin: Vec<u32>,
    pub(crate) source_count: usize,
    /// What the mesh looks like, as far as that is known.
    pub(crate) surfaces: Surfaces,
}

/// A vertex that a simplification made.
pub(crate) struct NewVertex {
    /// The vertex that it was.
    pub(crate) before: u32,
    pub(crate) position: [f32; 3],
    /// The first vertex at the same position, if that is an older one.
    pub(crate) same_position: Option<u32>,
}

impl LevelVertices {
    /// Those of the source, which must be valid.
    pub(crate) fn of(mesh: &SourceMesh, config: &BakeConfig) -> Self {
        let local_from_scaled = power_of_two_above(&mesh.positions);
        let scaled_from_local = local_from_scaled.recip();
        let scaled = |p: &Vec3| (*p * scaled_from_local).to_array();
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(scaled).collect();
        let layout = AttributeLayout::of(mesh, config);
        let same_position = meshopt::generate_position_remap(&adapter(&positions));
        let count = positions.len();
        let mut vertices = Self {
            attributes: layout.rows_of(mesh),
            is_border: border_of(&mesh.indices, &same_position),
            protection: vec![SimplifyVertex::empty(); count],
            origin: (0..count as u32).collect(),
            source_count: count,
            surfaces: Surfaces::of([mesh]),
            positions,
            local_from_scaled,
            layout,
            same_position,
        };
        vertices.protect_seams();
        vertices
    }

    pub(crate) fn position(&self, vertex: u32) -> Vec3 {
        Vec3::from(self.positions[vertex as usize])
    }

    /// What a vertex looks like, if that is known.
    pub(crate) fn surface(&self, vertex: u32) -> Option<&Surface> {
        self.surfaces.of_vertex(self.origin[vertex as usize])
    }

    /// Whether it is known of some triangles what a texture leaves of them.
    pub(crate) fn knows_what_is_cut_out(&self) -> bool {
        self.layout.has_uvs() && self.surfaces.any_known()
    }

    /// The attributes of all vertices, a row for each.
    pub(crate) fn rows(&self) -> &[f32] {
        &self.attributes
    }

    /// The attributes of a vertex.
    pub(crate) fn row(&self, vertex: u32) -> &[f32] {
        let width = self.layout.width();
        &self.attributes[vertex as usize * width..][..width]
    }

    /// Marks the vertices whose textures are torn from those of the first at their place.
    fn protect_seams(&mut self) {
        for vertex in 0..self.source_count as u32 {
            let first = self.same_position[vertex as usize];
            if self.layout.is_seam(self.row(vertex), self.row(first)) {
                self.protection[vertex as usize] = SimplifyVertex::Protect;
            }
        }
    }

    /// Adds a vertex, and returns its number.
    pub(crate) fn push(&mut self, new: &NewVertex, row: &[f32]) -> u32 {
        let vertex = self.positions.len() as u32;
        let before = new.before as usize;
        self.positions.push(new.position);
        self.attributes.extend_from_slice(row);
        self.same_position.push(new.same_position.unwrap_or(vertex));
        self.protection.push(self.protection[before]);
        self.is_border.push(self.is_border[before]);
        self.origin.push(self.origin[before]);
        vertex
    }

    /// All vertices in local units: those of `mesh` as they are, and after them the others; and where
    /// these came from, if the mesh has attributes that are not among these.
    pub(crate) fn in_local(self, mesh: &SourceMesh) -> (Vertices, Vec<u32>) {
        let mut vertices = mesh.vertices();
        for vertex in self.source_count as u32..self.positions.len() as u32 {
            let position = self.position(vertex) * self.local_from_scaled;
            vertices.positions.push(position);
            let origin = self.origin[vertex as usize] as usize;
            self.layout.push_to(&mut vertices, self.row(vertex), origin);
        }
        let mut moved_from = self.origin;
        moved_from.drain(..self.source_count);
        if !mesh.has_other_attributes {
            moved_from.clear();
        }
        (vertices, moved_from)
    }
}

/// A part of the surface with vertices of its own, in the order of their first use.
#[derive(Default)]
pub(crate) struct Piece {
    /// For each own vertex, its number among all.
    pub(crate) vertices: Vec<u32>,
    /// Three own vertices for each triangle.
    pub(crate) corners: Vec<u32>,
    pub(crate) positions: Vec<[f32; 3]>,
}

impl Piece {
    /// Of triangles that are given by their corners.
    pub(crate) fn of(corners: impl Iterator<Item = u32>, all: &LevelVertices) -> Self {
        let mut piece = Self::default();
        let mut own: FxHashMap<u32, u32> = FxHashMap::default();
        for vertex in corners {
            let next = piece.vertices.len() as u32;
            let corner = *own.entry(vertex).or_insert(next);
            if corner == next {
                piece.vertices.push(vertex);
                piece.positions.push(all.positions[vertex as usize]);
            }
            piece.corners.push(corner);
        }
        piece
    }

    pub(crate) fn triangle_count(&self) -> usize {
        self.corners.len() / 3
    }

    /// For each own vertex, the first own vertex at the same position.
    pub(crate) fn same_position(&self, all: &LevelVertices) -> Vec<u32> {
        let mut first: FxHashMap<u32, u32> = FxHashMap::default();
        let own = self.vertices.iter().zip(0..);
        own.map(|(&vertex, corner)| {
            *first
                .entry(all.same_position[vertex as usize])
                .or_insert(corner)
        })
        .collect()
    }
}

/// The positions as the simplifier takes them.
pub(crate) fn adapter(positions: &[[f32; 3]]) -> VertexDataAdapter<'_> {
    let bytes = meshopt::typed_to_bytes(positions);
    match VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0) {
        Ok(vertices) => vertices,
        Err(_) => unreachable!("three floats a vertex are a whole number of strides"),
    }
}

/// A power of two that brings all coordinates to at most 2.
pub(crate) fn power_of_two_above(positions: &[Vec3]) -> f32 {
    let largest = positions
        .iter()
        .map(|p| p.abs().max_element())
        .fold(0.0, f32::max);
    // The exponent alone; that of zero and of denormals is left at the smallest with a reciprocal.
    f32::from_bits(largest.to_bits() & 0x7f80_0000).max(f32::MIN_POSITIVE)
}

/// Which vertices lie where the source has an open edge.
fn border_of(indices: &[u32], same_position: &[u32]) -> Vec<bool> {
    let mut links = Links::of(same_position.len());
    links.add(indices.iter().map(|&v| same_position[v as usize]));
    let firsts = same_position.iter();
    firsts.map(|&first| links.is_open(first)).collect()
}
