//! Simplification of a whole character with respect to its poses.
//!
//! The components of the posed positions are vertex attributes. The simplifier charges the area times the squared
//! change of an attribute. With strength k, P poses, N triangles to keep, and the area A in squares of the extent, the
//! weight of the components is
//! ```text
//! k / (extent √P) · √(N / 6A)
//! ```
//! The area of one triangle then counts as much as the displacement of a vertex. Without the second factor, the
//! components have hardly any effect on the deviation.

use bytemuck::NoUninit;
use glam::Vec3;
use meshopt::{SimplifyOptions, SimplifyVertex};
use rustc_hash::FxHashMap;

use super::channels::{CHANNELS, channels};
use super::character::Character;
use super::poses::Pose;
use crate::levels::vertices::{LevelVertices, NORMAL_WEIGHT};
use crate::mesh::bounds::extent_of;
use crate::mesh::surfaces::Surfaces;
use crate::mesh::topology::Topology;
use crate::mesh::{SourceMesh, adapter};

/// A character, ready to be simplified.
pub(super) struct Simplifier<'a> {
    character: &'a Character<'a>,
    vertices: LevelVertices,
    /// For each vertex to which vertices of flat triangles are welded, these vertices.
    flat_vertices: FxHashMap<u32, Vec<u32>>,
    /// Protects the vertices where parts meet. Otherwise triangles would span two parts.
    between_parts: Vec<SimplifyVertex>,
    /// Triangles with odd vertices, which stay at all levels.
    odd: Vec<[u32; 3]>,
    /// Other triangles with welded vertices.
    indices: Vec<u32>,
    channels: Vec<[f32; CHANNELS]>,
    /// The weight of the channels if one triangle is kept and the strength is 1.
    channel_weight: f32,
}

impl<'a> Simplifier<'a> {
    pub(super) fn of(character: &'a Character<'a>, poses: &[Pose]) -> Self {
        let surfaces = Surfaces::of(character.parts.iter().map(|part| &part.primitive.mesh));
        let mut mesh = character.mesh.clone();
        mesh.positions.clone_from(&character.apart);
        // Welding connects triangles that have their own vertices.
        let first = welded(character);
        smooth_normals(character, &mut mesh, &first);
        let topology = Topology::of(&mesh, &surfaces);
        let mut vertices = LevelVertices::of(&mesh, topology, surfaces, NORMAL_WEIGHT);
        let is_odd = |triangle: &[u32; 3]| triangle.iter().any(|v| character.is_odd(*v));
        let triangles = character.triangles().iter().copied();
        let (odd, regular): (Vec<_>, Vec<_>) = triangles.partition(is_odd);
        let mut between_parts = between_parts(&vertices);
        // The rest stays connected to the odd triangles.
        for &vertex in odd.as_flattened() {
            let place = vertices.same_position[vertex as usize] as usize;
            vertices.protection[place] |= SimplifyVertex::Lock;
            between_parts[place] |= SimplifyVertex::Lock;
        }
        let posed: Vec<Vec<Vec3>> = poses.iter().map(|pose| pose.positions(character)).collect();
        let extent = extent_of(&character.apart);
        let area = character.area();
        let weight =
            (extent * extent / (6.0 * area)).sqrt() / (extent * (poses.len() as f32).sqrt());
        Self {
            indices: regular
                .as_flattened()
                .iter()
                .map(|&v| first[v as usize])
                .collect(),
            odd,
            between_parts,
            flat_vertices: flat_vertices(character, &first),
            channels: channels(&posed),
            channel_weight: if weight.is_finite() { weight } else { 0.0 },
            character,
            vertices,
        }
    }

    /// The character with about `target` triangles. `strength` is the weight of poses relative to shape. At 0, poses are
    /// ignored and texture seams are protected. Other strengths let seams tear, because hard-edged characters have too
    /// many to keep.
    pub(super) fn simplify(&self, target: usize, strength: f32) -> Vec<[u32; 3]> {
        let mut weights = self.vertices.layout.weights.clone();
        let mut rows = Vec::new();
        let mut locks = &self.vertices.protection;
        if strength > 0.0 {
            let weight = self.channel_weight * strength * (target as f32).sqrt();
            weights.extend([weight; CHANNELS]);
            for (vertex, channels) in (0..).zip(&self.channels) {
                rows.extend(self.vertices.row(vertex));
                rows.extend(channels);
            }
            locks = &self.between_parts;
        } else {
            rows.extend(self.vertices.rows());
        }
        let corners = meshopt::simplify_with_attributes_and_locks(
            &self.indices,
            &adapter(&self.vertices.positions),
            &rows,
            &weights,
            weights.len() * size_of::<f32>(),
            locks,
            target.saturating_sub(self.odd.len()) * 3,
            f32::MAX,
            SimplifyOptions::ErrorAbsolute | SimplifyOptions::Permissive,
            None,
        );
        let (triangles, _) = corners.as_chunks::<3>();
        let triangles = triangles
            .iter()
            .map(|triangle| facing(&self.character.mesh, &self.flat_vertices, *triangle));
        triangles.chain(self.odd.iter().copied()).collect()
    }
}

/// Replaces welded vertices of flat triangles by the vertices with normals nearest to the normal of the triangle.
fn facing(
    mesh: &SourceMesh,
    flat_vertices: &FxHashMap<u32, Vec<u32>>,
    triangle: [u32; 3],
) -> [u32; 3] {
    let corners = triangle.map(|v| mesh.positions[v as usize]);
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    triangle.map(|vertex| {
        let alike = flat_vertices.get(&vertex).into_iter().flatten();
        let towards = |vertex: &&u32| mesh.normals[**vertex as usize].dot(normal);
        let best = alike.max_by(|a, b| towards(a).total_cmp(&towards(b)));
        best.copied().unwrap_or(vertex)
    })
}

fn between_parts(vertices: &LevelVertices) -> Vec<SimplifyVertex> {
    let part = |vertex: u32| vertices.surfaces.part_of(vertex);
    let numbered = (0..).zip(&vertices.same_position);
    let is_between = numbered.map(|(vertex, &first)| part(vertex) != part(first));
    let lock = |is_between| {
        if is_between {
            SimplifyVertex::Protect
        } else {
            SimplifyVertex::empty()
        }
    };
    is_between.map(lock).collect()
}

/// The vertices of flat triangles, by the vertex that they are welded to.
fn flat_vertices(character: &Character<'_>, first: &[u32]) -> FxHashMap<u32, Vec<u32>> {
    let mut alike: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    if character.mesh.normals.is_empty() {
        return alike;
    }
    let flat = character
        .parts
        .iter()
        .filter(|part| part.has_flat_triangles());
    for vertex in flat.flat_map(|part| part.vertices.clone()) {
        alike
            .entry(first[vertex as usize])
            .or_default()
            .push(vertex);
    }
    alike
}

/// Gives vertices of flat triangles the mean normals of adjacent triangles. Otherwise every edge would be a hard edge.
fn smooth_normals(character: &Character<'_>, mesh: &mut SourceMesh, first: &[u32]) {
    let flat = character
        .parts
        .iter()
        .filter(|part| part.has_flat_triangles());
    if mesh.normals.is_empty() {
        return;
    }
    for part in flat {
        let mut sums: FxHashMap<u32, Vec3> = FxHashMap::default();
        for corners in part.range().step_by(3) {
            let [a, b, c] = [0, 1, 2].map(|k| mesh.positions[corners + k]);
            for vertex in &first[corners..corners + 3] {
                *sums.entry(*vertex).or_default() += (b - a).cross(c - a);
            }
        }
        for (vertex, sum) in sums {
            mesh.normals[vertex as usize] = sum.normalize_or_zero();
        }
    }
}

/// The levels of a character as other tools make them: each primitive separately, in the bind pose, with normals and
/// `Regularize`. Collapses across seams are allowed; otherwise most characters would stop at a quarter of their
/// triangles. Flat triangles are simplified with smooth normals, and get flat normals, as ours do. Level `k` is
/// simplified to `ratio` to the power of `k`.
#[cfg(any(test, feature = "test-support"))]
#[must_use]
pub fn plain_levels(character: &Character<'_>, ratio: f32, count: usize) -> Vec<Vec<[u32; 3]>> {
    let positions: Vec<[f32; 3]> = character
        .mesh
        .positions
        .iter()
        .map(Vec3::to_array)
        .collect();
    let first = welded(character);
    let mut mesh = character.mesh.clone();
    smooth_normals(character, &mut mesh, &first);
    let flat_vertices = flat_vertices(character, &first);
    let indices: Vec<u32> = mesh.indices.iter().map(|&v| first[v as usize]).collect();
    let normals: Vec<f32> = mesh.normals.iter().flat_map(Vec3::to_array).collect();
    let level = |share: f32| {
        let of_part = |part: &super::character::Part<'_>| {
            let own = indices.iter().filter(|v| part.vertices.contains(v));
            let own: Vec<u32> = own.copied().collect();
            let target = (own.len() as f32 / 3.0 * share) as usize * 3;
            meshopt::simplify_with_attributes_and_locks(
                &own,
                &adapter(&positions),
                &normals,
                &[NORMAL_WEIGHT; 3],
                3 * size_of::<f32>(),
                &vec![false; positions.len()],
                target,
                f32::MAX,
                SimplifyOptions::Regularize | SimplifyOptions::Permissive,
                None,
            )
        };
        let corners: Vec<u32> = character.parts.iter().flat_map(of_part).collect();
        let triangles = corners.as_chunks::<3>().0.iter();
        let facing = |triangle: &[u32; 3]| facing(&character.mesh, &flat_vertices, *triangle);
        triangles.map(facing).collect()
    };
    (1..=count).map(|k| level(ratio.powi(k as i32))).collect()
}

/// For each vertex, the first vertex of its part with the same attributes and rig. Tangents are ignored. Normals are
/// ignored if every triangle has its own vertices, because they are then the normals of the triangles.
fn welded(character: &Character<'_>) -> Vec<u32> {
    let mesh = &character.mesh;
    let mut firsts: FxHashMap<Vec<u8>, u32> = FxHashMap::default();
    let mut first = vec![0; mesh.positions.len()];
    for (number, part) in (0..).zip(&character.parts) {
        let is_flat = part.has_flat_triangles();
        for (own, vertex) in part.range().enumerate() {
            // All keys of a part have the same layout, so they need no separators.
            let mut key: Vec<u8> = bytemuck::bytes_of::<u32>(&number).to_vec();
            let normal = mesh.normals.get(vertex).filter(|_| !is_flat);
            add(&mut key, mesh.positions.get(vertex));
            add(&mut key, normal);
            add(&mut key, mesh.uvs.get(vertex));
            add(&mut key, mesh.uvs_1.get(vertex));
            add(&mut key, mesh.colors.get(vertex));
            let targets = part.rig.targets.iter();
            targets.for_each(|target| add(&mut key, target.get(own)));
            for (joint, weight) in character.influences.get(vertex).into_iter().flatten() {
                add(&mut key, Some(joint));
                add(&mut key, Some(weight));
            }
            first[vertex] = *firsts.entry(key).or_insert(vertex as u32);
        }
    }
    first
}

fn add<T: NoUninit>(key: &mut Vec<u8>, value: Option<&T>) {
    key.extend(value.into_iter().flat_map(bytemuck::bytes_of));
}
