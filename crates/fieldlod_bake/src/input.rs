//! What the simplifier sees of a mesh: positions and attributes, scaled so that its 32-bit sums of
//! squares keep their precision whatever the units of the mesh.

use glam::{DVec2, Vec2, Vec3};
use meshopt::{SimplifyVertex, VertexDataAdapter};

use crate::config::BakeConfig;
use crate::mesh::{MAX_COORDINATE, SourceMesh};

/// The simplifier's view of a mesh.
pub(crate) struct SimplifierInput {
    /// Positions times `1 / local_from_scaled`.
    pub(crate) positions: Vec<[f32; 3]>,
    /// A power of two: scaled lengths times this are local lengths, without rounding.
    pub(crate) local_from_scaled: f32,
    /// `weights.len()` numbers per vertex.
    pub(crate) attributes: Vec<f32>,
    /// One weight per attribute.
    pub(crate) weights: Vec<f32>,
    /// Bit k is set if a discontinuity of attribute k is a seam to keep.
    pub(crate) protect_mask: u32,
    /// For each vertex, the first vertex at the same position.
    pub(crate) same_position: Vec<u32>,
    /// For each vertex, whether it lies on a seam to keep.
    pub(crate) locks: Vec<SimplifyVertex>,
    /// Whether so many triangles share a place that growing clusters from neighbour to neighbour
    /// would take the square of their number.
    pub(crate) is_crowded: bool,
}

/// Triangles around the place of a corner, on average, from which on a mesh is crowded. There are
/// 6 as a rule; growing clusters takes about 8 ns a triangle for each of them.
const CROWD: u64 = 200;

impl SimplifierInput {
    pub(crate) fn of(mesh: &SourceMesh, config: &BakeConfig) -> Self {
        let local_from_scaled = power_of_two_above(&mesh.positions);
        let scaled_from_local = local_from_scaled.recip();
        // Attributes, how much each counts, and which of them make seams that are kept.
        let normals = usable_normals(mesh);
        let uvs = comparable_uvs(mesh);
        let mut weights = vec![config.normal_weight; if normals.is_empty() { 0 } else { 3 }];
        let first_uv = weights.len();
        weights.resize(
            first_uv + if uvs.is_empty() { 0 } else { 2 },
            config.uv_weight,
        );
        let protect_mask = match (config.protect_uv_seams, uvs.is_empty()) {
            (true, false) => 0b11 << first_uv,
            _ => 0,
        };
        // Positions, and what follows from which of them are the same.
        let scaled = |p: &Vec3| (*p * scaled_from_local).to_array();
        let mut input = Self {
            positions: mesh.positions.iter().map(scaled).collect(),
            local_from_scaled,
            attributes: interleave(mesh.positions.len(), &normals, &uvs),
            weights,
            protect_mask,
            same_position: Vec::new(),
            locks: vec![SimplifyVertex::empty(); mesh.positions.len()],
            is_crowded: false,
        };
        input.same_position = meshopt::generate_position_remap(&input.vertices());
        input.is_crowded = is_crowded(&mesh.indices, &input.same_position);
        input.protect_seams();
        input
    }

    /// The positions as the simplifier takes them.
    pub(crate) fn vertices(&self) -> VertexDataAdapter<'_> {
        let bytes = meshopt::typed_to_bytes(&self.positions);
        match VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0) {
            Ok(vertices) => vertices,
            Err(_) => unreachable!("three floats a vertex are a whole number of strides"),
        }
    }

    pub(crate) fn has_uvs(&self) -> bool {
        // Three for normals, two for texture coordinates.
        self.weights.len() % 3 == 2
    }

    pub(crate) fn is_locked(&self, vertex: u32) -> bool {
        self.locks[vertex as usize].contains(SimplifyVertex::Lock)
    }

    /// Locks all vertices at the positions of `vertices`.
    pub(crate) fn lock_positions(&mut self, vertices: &[u32]) {
        let mut is_locked = vec![false; self.positions.len()];
        for &vertex in vertices {
            is_locked[self.same_position[vertex as usize] as usize] = true;
        }
        for (lock, &first) in self.locks.iter_mut().zip(&self.same_position) {
            if is_locked[first as usize] {
                *lock |= SimplifyVertex::Lock;
            }
        }
    }

    /// Marks the vertices whose masked attributes differ from those of the first at their place.
    fn protect_seams(&mut self) {
        let count = self.weights.len();
        let masked: Vec<usize> = (0..count)
            .filter(|&k| self.protect_mask >> k & 1 != 0)
            .collect();
        let attribute = |vertex: usize, k: usize| self.attributes[vertex * count + k];
        for (vertex, &first) in self.same_position.iter().enumerate() {
            let differs = |&k: &usize| attribute(vertex, k) != attribute(first as usize, k);
            if masked.iter().any(differs) {
                self.locks[vertex] = SimplifyVertex::Protect;
            }
        }
    }

    /// Bytes between the attributes of one vertex and the next.
    pub(crate) fn attribute_stride(&self) -> usize {
        self.weights.len() * size_of::<f32>()
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

fn is_crowded(indices: &[u32], same_position: &[u32]) -> bool {
    let mut corners_at = vec![0u64; same_position.len()];
    for &vertex in indices {
        corners_at[same_position[vertex as usize] as usize] += 1;
    }
    let squares: u64 = corners_at.iter().map(|count| count * count).sum();
    squares > CROWD * indices.len() as u64
}

fn usable_normals(mesh: &SourceMesh) -> Vec<Vec3> {
    let usable = |normal: &Vec3| normal.normalize_or_zero();
    mesh.normals.iter().map(usable).collect()
}

/// Texture coordinates around zero, in units in which sliding the texture across the whole mesh is
/// a change of about 1, whether it repeats a thousand times or covers a thousandth of the image.
///
/// The simplifier subtracts squares of these numbers from each other, so they must not be large.
fn comparable_uvs(mesh: &SourceMesh) -> Vec<Vec2> {
    let uvs: Vec<Vec2> = mesh.uvs.iter().map(|uv| finite_or_zero(*uv)).collect();
    let Some((low, high)) = bounds_of(&uvs) else {
        return uvs;
    };
    // The scale at which sliding across the mesh is about 1, but no more than the range.
    let range = (high - low).max_element();
    let scale = mesh_per_uv(mesh, &uvs).min(range.recip());
    if !scale.is_finite() {
        return vec![Vec2::ZERO; uvs.len()];
    }
    let center = (low + high) * 0.5;
    let comparable = |uv: &Vec2| ((uv.as_dvec2() - center) * scale).as_vec2();
    uvs.iter().map(comparable).collect()
}

fn finite_or_zero(uv: Vec2) -> Vec2 {
    let usable = uv.is_finite() && uv.abs().max_element() <= MAX_COORDINATE;
    if usable { uv } else { Vec2::ZERO }
}

fn bounds_of(uvs: &[Vec2]) -> Option<(DVec2, DVec2)> {
    let corners = uvs.iter().map(|uv| (uv.as_dvec2(), uv.as_dvec2()));
    corners.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Which share of the mesh's extent one unit of texture covers, on average; infinite for a texture
/// that covers nothing.
fn mesh_per_uv(mesh: &SourceMesh, uvs: &[Vec2]) -> f64 {
    // Twice the areas on the surface and in the texture.
    let (mut area, mut uv_area) = (0.0, 0.0);
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
        area += (b - a).cross(c - a).length();
        let [a, b, c] = triangle.map(|v| uvs[v as usize].as_dvec2());
        uv_area += (b - a).perp_dot(c - a).abs();
    }
    (area / uv_area).sqrt() / extent_of(&mesh.positions)
}

fn extent_of(positions: &[Vec3]) -> f64 {
    let aabb = fieldlod_hierarchy::Aabb::around(positions.iter().copied()).unwrap_or_default();
    f64::from((aabb.max - aabb.min).max_element())
}

fn interleave(vertex_count: usize, normals: &[Vec3], uvs: &[Vec2]) -> Vec<f32> {
    let mut attributes = Vec::with_capacity(normals.len() * 3 + uvs.len() * 2);
    for vertex in 0..vertex_count {
        if let Some(normal) = normals.get(vertex) {
            attributes.extend(normal.to_array());
        }
        if let Some(uv) = uvs.get(vertex) {
            attributes.extend(uv.to_array());
        }
    }
    attributes
}
