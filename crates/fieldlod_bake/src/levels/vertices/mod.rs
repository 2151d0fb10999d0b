//! Vertices of all levels in the form that the simplifier uses. Source vertices come first, then the vertices that
//! simplification creates. Positions are scaled to at most 2, so that 32-bit sums of squares keep their precision.

mod attributes;
pub(crate) mod uv_ranges;

use glam::Vec3;
use meshopt::SimplifyVertex;
use rustc_hash::FxHashMap;

use crate::config::BakeConfig;
use crate::levels::vertices::attributes::AttributeLayout;
use crate::mesh::SourceMesh;
use crate::mesh::edges::Links;
use crate::mesh::surfaces::Surfaces;
use crate::mesh::topology::Topology;
use crate::plants::appearance::MAX_VERTICES;

pub(crate) use crate::levels::vertices::attributes::NORMAL_WEIGHT;

/// Vertices of all levels.
pub(crate) struct LevelVertices {
    /// Positions divided by `local_from_scaled`.
    pub(crate) positions: Vec<[f32; 3]>,
    /// Factor from scaled to local lengths: a power of two, so that scaling is exact.
    pub(crate) local_from_scaled: f32,
    pub(crate) layout: AttributeLayout,
    /// One row per vertex.
    attributes: Vec<f32>,
    /// For each vertex, the first vertex at the same position.
    pub(crate) same_position: Vec<u32>,
    /// For each vertex, the first vertex at the same position that looks the same.
    pub(crate) corner: Vec<u32>,
    /// For each vertex, whether the simplifier must protect its texture seam, or its border between two parts.
    pub(crate) protection: Vec<SimplifyVertex>,
    /// For each vertex, whether the source has an open edge at its position.
    pub(crate) is_border: Vec<bool>,
    /// For the first source vertex at each position, whether the vertices there stay at all levels.
    pub(crate) is_kept: Vec<bool>,
    /// For each vertex, the source vertex that it was moved from; itself for a source vertex.
    pub(crate) origin: Vec<u32>,
    pub(crate) source_count: usize,
    /// Surfaces of the mesh, if known.
    pub(crate) surfaces: Surfaces,
}

/// A vertex that a simplification creates.
pub(crate) struct NewVertex {
    /// The vertex that it replaces.
    pub(crate) before: u32,
    pub(crate) position: [f32; 3],
    /// An older vertex at the same position, if there is one.
    pub(crate) same_position: Option<u32>,
}

impl LevelVertices {
    /// Creates the vertices of a valid source. `topology` welds them. `normal_weight` is the error of a unit normal
    /// that changes by 1.
    pub(crate) fn of(
        mesh: &SourceMesh,
        topology: Topology,
        surfaces: Surfaces,
        normal_weight: f32,
    ) -> Self {
        let local_from_scaled = power_of_two_below(&mesh.positions);
        let scaled_from_local = local_from_scaled.recip();
        let scaled = |p: &Vec3| (*p * scaled_from_local).to_array();
        let mut positions: Vec<[f32; 3]> = mesh.positions.iter().map(scaled).collect();
        let layout = AttributeLayout::of(mesh, normal_weight);
        // The simplifier welds only equal positions.
        let Topology { place, corner, .. } = topology;
        for (vertex, &first) in place.iter().enumerate() {
            positions[vertex] = positions[first as usize];
        }
        let same_position = place;
        let count = positions.len();
        let mut vertices = Self {
            attributes: layout.rows_of(mesh),
            is_border: border_of(&mesh.indices, &same_position),
            protection: vec![SimplifyVertex::empty(); count],
            origin: (0..count as u32).collect(),
            source_count: count,
            is_kept: vec![false; count],
            surfaces,
            positions,
            local_from_scaled,
            layout,
            same_position,
            corner,
        };
        vertices.protect_seams();
        vertices
    }

    pub(crate) fn position(&self, vertex: u32) -> Vec3 {
        Vec3::from(self.positions[vertex as usize])
    }

    /// Whether the opacity of some triangles is known.
    pub(crate) fn has_known_opacity(&self) -> bool {
        (self.layout.has_uvs() || self.layout.has_colors()) && self.surfaces.any_known()
    }

    /// Whether pictures measure how torn textures look: surfaces are known, and the mesh is small enough to be drawn.
    pub(crate) fn shows_tears(&self, config: &BakeConfig) -> bool {
        config.measure_appearance
            && self.surfaces.all_known()
            && self.source_count <= MAX_VERTICES as usize
    }

    /// Attributes of all vertices, one row each.
    pub(crate) fn rows(&self) -> &[f32] {
        &self.attributes
    }

    /// Attributes of a vertex.
    pub(crate) fn row(&self, vertex: u32) -> &[f32] {
        let width = self.layout.width();
        &self.attributes[vertex as usize * width..][..width]
    }

    /// Keeps the source vertices that `kept` marks, and all other vertices at their positions, at all levels. Keeps
    /// those on open borders as well if `with_borders`. `kept` has one value per source vertex, or is empty.
    pub(crate) fn keep(&mut self, kept: &[bool], with_borders: bool) {
        for vertex in 0..self.source_count {
            let is_kept = kept.get(vertex).is_some_and(|kept| *kept);
            if is_kept || with_borders && self.is_border[vertex] {
                self.is_kept[self.same_position[vertex] as usize] = true;
            }
        }
    }

    /// Protects vertices whose texture coordinates or parts differ from the first vertex at their position.
    fn protect_seams(&mut self) {
        for vertex in 0..self.source_count as u32 {
            let first = self.same_position[vertex as usize];
            // Parts have different materials, so no triangle may cross their border.
            let is_of_one_part = self.surfaces.part_of(vertex) == self.surfaces.part_of(first);
            if !is_of_one_part || self.layout.is_seam(self.row(vertex), self.row(first)) {
                self.protection[vertex as usize] = SimplifyVertex::Protect;
            }
        }
    }

    /// Adds a vertex, and returns its index.
    pub(crate) fn push(&mut self, new: &NewVertex, row: &[f32]) -> u32 {
        let vertex = self.positions.len() as u32;
        let before = new.before as usize;
        self.positions.push(new.position);
        self.attributes.extend_from_slice(row);
        self.same_position.push(new.same_position.unwrap_or(vertex));
        self.corner.push(vertex);
        self.protection.push(self.protection[before]);
        self.is_border.push(self.is_border[before]);
        self.origin.push(self.origin[before]);
        vertex
    }
}

/// A part of the surface with own vertices, in the order of their first use.
#[derive(Default)]
pub(crate) struct Piece {
    /// For each own vertex, its index in `LevelVertices`.
    pub(crate) vertices: Vec<u32>,
    /// Three own vertices per triangle.
    pub(crate) corners: Vec<u32>,
    pub(crate) positions: Vec<[f32; 3]>,
}

impl Piece {
    /// Creates the piece with these corners, three per triangle.
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

/// The largest power of two up to the largest coordinate. Coordinates divided by it are less than 2.
pub(crate) fn power_of_two_below(positions: &[Vec3]) -> f32 {
    let largest = positions
        .iter()
        .map(|p| p.abs().max_element())
        .fold(0.0, f32::max);
    // Keep only the exponent. Zero and denormals give the smallest normal number, whose reciprocal is finite.
    f32::from_bits(largest.to_bits() & 0x7f80_0000).max(f32::MIN_POSITIVE)
}

/// For each vertex, whether the source has an open edge at its position.
pub(crate) fn border_of(indices: &[u32], same_position: &[u32]) -> Vec<bool> {
    let mut links = Links::of(same_position.len());
    links.add(indices.iter().map(|&v| same_position[v as usize]));
    let firsts = same_position.iter();
    firsts.map(|&first| links.is_open(first)).collect()
}
