//! The vertices of all levels as the simplifier sees them: scaled, so that its 32-bit sums of squares
//! keep their precision whatever the units of the mesh. The source's come first, and after them those
//! that simplification makes.

mod attributes;
pub(crate) mod uv_ranges;

use fieldlod_hierarchy::Vertices;
use glam::Vec3;
use meshopt::SimplifyVertex;
use rustc_hash::FxHashMap;

use crate::levels::vertices::attributes::AttributeLayout;
use crate::mesh::SourceMesh;
use crate::mesh::edges::Links;
use crate::mesh::surfaces::Surfaces;
use crate::mesh::topology::Topology;

pub(crate) use crate::levels::vertices::attributes::NORMAL_WEIGHT;

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
    /// For each vertex, the first that looks the same there.
    pub(crate) corner: Vec<u32>,
    /// For each vertex, whether it lies on a texture seam to keep.
    pub(crate) protection: Vec<SimplifyVertex>,
    /// For each vertex, whether the source has an open edge at its position.
    pub(crate) is_border: Vec<bool>,
    /// For each vertex of the source, whether it stays at all levels.
    is_kept: Vec<bool>,
    /// For each vertex, the source vertex that it came from: itself, for one of the source.
    pub(crate) origin: Vec<u32>,
    pub(crate) source_count: usize,
    /// The surfaces of the mesh, as far as they are known.
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
    /// The vertices of the source, which must be valid, and which of them are one. A change of the unit normal
    /// by 1 counts as `normal_weight`.
    pub(crate) fn of(
        mesh: &SourceMesh,
        topology: Topology,
        surfaces: Surfaces,
        normal_weight: f32,
    ) -> Self {
        let local_from_scaled = power_of_two_above(&mesh.positions);
        let scaled_from_local = local_from_scaled.recip();
        let scaled = |p: &Vec3| (*p * scaled_from_local).to_array();
        let mut positions: Vec<[f32; 3]> = mesh.positions.iter().map(scaled).collect();
        let layout = AttributeLayout::of(mesh, normal_weight);
        // The simplifier takes equal positions alone for one place.
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

    /// For each vertex that is the first at its position, whether it is kept, or whether several of some groups of
    /// corners use that position: there it must stay, or the surface would tear between them.
    pub(crate) fn shared_positions<'a>(
        &self,
        groups: impl Iterator<Item = impl Iterator<Item = &'a u32>>,
    ) -> Vec<bool> {
        const NOBODY: u32 = u32::MAX;
        let mut used_by = vec![NOBODY; self.positions.len()];
        let mut is_shared = self.is_kept.clone();
        is_shared.resize(self.positions.len(), false);
        for (group, corners) in (0..).zip(groups) {
            for &vertex in corners {
                let first = self.same_position[vertex as usize] as usize;
                is_shared[first] |= used_by[first] != NOBODY && used_by[first] != group;
                used_by[first] = group;
            }
        }
        is_shared
    }

    /// Lets vertices of the source stay at all levels, with all others at their positions.
    pub(crate) fn keep(&mut self, vertices: impl Iterator<Item = usize>) {
        for vertex in vertices {
            self.is_kept[self.same_position[vertex] as usize] = true;
        }
    }

    /// Marks the vertices whose textures are torn from those of the first at their place, or that are of other parts.
    fn protect_seams(&mut self) {
        for vertex in 0..self.source_count as u32 {
            let first = self.same_position[vertex as usize];
            let is_of_one_part = self.surfaces.part_of(vertex) == self.surfaces.part_of(first);
            if !is_of_one_part || self.layout.is_seam(self.row(vertex), self.row(first)) {
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
        self.corner.push(vertex);
        self.protection.push(self.protection[before]);
        self.is_border.push(self.is_border[before]);
        self.origin.push(self.origin[before]);
        vertex
    }

    /// All vertices in local units: those of `mesh` first, unchanged. And the source vertices that the others came from,
    /// if the mesh has other attributes.
    pub(crate) fn in_local(self, mesh: &SourceMesh) -> (Vertices, Vec<u32>) {
        let mut vertices = mesh.finite_vertices();
        for vertex in self.source_count as u32..self.positions.len() as u32 {
            let position = self.position(vertex) * self.local_from_scaled;
            vertices.positions.push(position);
            let origin = self.origin[vertex as usize] as usize;
            let row = self.row(vertex);
            self.layout.push_to(&mut vertices, row, origin);
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
    /// The piece with these corners, three per triangle.
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
pub(crate) fn border_of(indices: &[u32], same_position: &[u32]) -> Vec<bool> {
    let mut links = Links::of(same_position.len());
    links.add(indices.iter().map(|&v| same_position[v as usize]));
    let firsts = same_position.iter();
    firsts.map(|&first| links.is_open(first)).collect()
}
