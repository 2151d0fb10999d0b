//! Welding: finds vertices at the same place and vertices that look the same.
//!
//! Files repeat vertices at texture seams, at hard edges, and for each triangle of a triangle soup. Exporters round the
//! copies differently, so bits may differ. A *place* is a position with a tolerance of [`PLACE_TOLERANCE`] times the
//! local edge length. A *corner* is a place with attributes that look the same in a picture.
//!
//! Only vertices at open edges are welded by tolerance; elsewhere the surface is already closed.

use glam::{DVec3, Vec2, Vec3, Vec4};
use rustc_hash::FxHashMap;

use crate::mesh::SourceMesh;
use crate::mesh::adapter;
use crate::mesh::components::{connect, find_first};
use crate::mesh::edges::Links;
use crate::mesh::surfaces::Surfaces;

/// Tolerance of a place, as a share of the local edge length. It is ten times the rounding of game assets and scans.
/// For an edge across a screen of 2,000 pixels, the tolerance is 0.04 pixels.
const PLACE_TOLERANCE: f32 = 2e-5;
/// Tolerance of a place, as a share of the largest coordinate: four steps of an `f32`.
const ROUNDING: f32 = 4.8e-7;
/// Upper limit for both tolerances, as a share of the local edge length: larger tolerances would visibly shorten edges.
const MAX_EDGE_SHARE: f32 = 1e-3;
/// Texture coordinates of one corner: half a texel of a texture of 2,048.
pub(crate) const SAME_UV: f32 = 1.0 / 4096.0;
/// Unit normals of one corner: half a degree. At 0.02, a hard-edged scene has 3 % more triangles at equal image error;
/// at 0.005, 3 % fewer. Eight other props do not differ.
const SAME_NORMAL: f32 = 0.01;
/// Colours of one corner: less than a step of 8 bits.
const SAME_COLOR: f32 = 0.003;
/// Cosine between tangents of one corner: they differ by less than 60°. Tangents only orient a normal map.
const SAME_TANGENT: f32 = 0.5;
/// Limit for comparisons with corners of the same place: the tip of a cone may have thousands. At 8, nine props keep
/// their levels.
const MAX_CORNERS: usize = 16;

/// Places and corners of a mesh.
pub(crate) struct Topology {
    /// For each vertex, the first vertex at its place.
    pub(crate) place: Vec<u32>,
    /// For each vertex, the first vertex of its corner.
    pub(crate) corner: Vec<u32>,
    /// Number of vertices that were welded to a vertex with a different position.
    pub(crate) rounded: usize,
}

impl Topology {
    /// Welds only equal positions. The mesh must be valid.
    pub(crate) fn exact(mesh: &SourceMesh) -> Self {
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(Vec3::to_array).collect();
        Self {
            place: meshopt::generate_position_remap(&adapter(&positions)),
            corner: (0..positions.len() as u32).collect(),
            rounded: 0,
        }
    }

    /// Welds with tolerance. The mesh must be valid. Vertices of different parts never share a corner, and they share a
    /// place only if their positions are equal.
    pub(crate) fn of(mesh: &SourceMesh, parts: &Surfaces) -> Self {
        let Self {
            place: exact,
            corner,
            ..
        } = Self::exact(mesh);
        let mut place = exact.clone();
        weld_near(mesh, parts, &mut place);
        let pairs = place.iter().zip(&exact);
        let rounded = pairs.filter(|(place, exact)| place != exact).count();
        let corner = corners_of(mesh, &place, corner);
        Self {
            place,
            corner,
            rounded,
        }
    }
}

/// Welds places at open edges within their tolerance.
fn weld_near(mesh: &SourceMesh, parts: &Surfaces, place: &mut [u32]) {
    let mut links = Links::of(place.len());
    links.add(mesh.indices.iter().map(|&v| place[v as usize]));
    let tolerance = tolerances(mesh, place);
    let is_open = |v: u32| place[v as usize] == v && links.is_open(v);
    let open = (0..place.len() as u32).filter(|&v| is_open(v) && tolerance[v as usize] > 0.0);
    let open: Vec<u32> = open.collect();
    let clusters = clusters_of(&open, mesh, parts, &tolerance);
    for cluster in &clusters {
        cluster.iter().for_each(|&v| connect(place, cluster[0], v));
    }
    // A cell level has two exponents of two. Cells are 4 to 16 tolerances wide: in smaller cells, more points are near
    // borders; in larger ones, more clusters are compared.
    let cell_level = |v: u32| exponent_of(tolerance[v as usize]).div_euclid(2);
    let mut levels: Vec<i32> = clusters.iter().map(|own| cell_level(own[0])).collect();
    levels.sort_unstable();
    levels.dedup();
    // A tolerance is less than 4 to the power of its level plus 1.
    let cell_size = |level: i32| 4.0 * 4f64.powi(level + 1);
    // Each cluster is stored in a cell of its own level. Clusters with smaller tolerances search the cells of coarser
    // levels.
    let mut cells: FxHashMap<(i32, [i64; 3]), Vec<usize>> = FxHashMap::default();
    for (index, cluster) in clusters.iter().enumerate() {
        let level = cell_level(cluster[0]);
        let at = mesh.positions[cluster[0] as usize].as_dvec3() / cell_size(level);
        let key = (level, at.floor().as_i64vec3().to_array());
        cells.entry(key).or_default().push(index);
    }
    let are_near = |a: u32, b: u32| {
        let [at, other] = [a, b].map(|v| mesh.positions[v as usize]);
        at.distance(other) <= tolerance[a as usize].min(tolerance[b as usize])
    };
    for cluster in &clusters {
        let own = cell_level(cluster[0]);
        let positions = || cluster.iter().map(|&v| mesh.positions[v as usize]);
        let low = positions().fold(Vec3::INFINITY, Vec3::min).as_dvec3();
        let high = positions().fold(Vec3::NEG_INFINITY, Vec3::max).as_dvec3();
        let reach = cluster.iter().map(|&v| tolerance[v as usize]);
        let reach = f64::from(reach.fold(0.0, f32::max));
        for &level in levels.iter().filter(|&&level| level >= own) {
            let cell = |at: DVec3| (at / cell_size(level)).floor().as_i64vec3().to_array();
            let (low, high) = (cell(low - reach), cell(high + reach));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        let near = cells.get(&(level, [x, y, z])).into_iter().flatten();
                        for other in near.map(|&other| &clusters[other]) {
                            // One pair connects two clusters. `are_near` uses original positions, so the order of the
                            // pairs has no effect.
                            let (a, b) = (cluster[0], other[0]);
                            if find_first(place, a) != find_first(place, b)
                                && parts.part_of(a) == parts.part_of(b)
                                && cluster
                                    .iter()
                                    .any(|&v| other.iter().any(|&o| are_near(v, o)))
                            {
                                connect(place, a, b);
                            }
                        }
                    }
                }
            }
        }
    }
    for v in 0..place.len() as u32 {
        place[v as usize] = find_first(place, v);
    }
}

/// The exponent of the largest power of two up to a normal number.
fn exponent_of(tolerance: f32) -> i32 {
    (tolerance.to_bits() >> 23) as i32 - 127
}

/// Divides vertices into clusters of one part, each within the tolerances of its vertices. Thousands of vertices may
/// differ by less: comparisons of all pairs would take quadratic time.
fn clusters_of(
    open: &[u32],
    mesh: &SourceMesh,
    parts: &Surfaces,
    tolerance: &[f32],
) -> Vec<Vec<u32>> {
    let mut clusters: Vec<Vec<u32>> = Vec::new();
    let mut of_cells: FxHashMap<_, usize> = FxHashMap::default();
    for &v in open {
        let exponent = exponent_of(tolerance[v as usize]);
        // The diagonal of a cell is shorter than the smallest tolerance in it.
        let at = mesh.positions[v as usize].as_dvec3() / 2f64.powi(exponent - 2);
        let cell = at.floor().to_array().map(f64::to_bits);
        let next = clusters.len();
        let cluster = *of_cells
            .entry((exponent, cell, parts.part_of(v)))
            .or_insert(next);
        if cluster == next {
            clusters.push(Vec::new());
        }
        clusters[cluster].push(v);
    }
    clusters
}

/// Tolerance of each place, stored at its first vertex. The local edge length is the longest edge of a triangle; if a
/// place has several triangles, the smallest of these counts.
fn tolerances(mesh: &SourceMesh, place: &[u32]) -> Vec<f32> {
    let mut shortest = vec![f32::INFINITY; place.len()];
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        let longest = (a - b).length().max((b - c).length()).max((c - a).length());
        if longest > 0.0 {
            for &v in triangle {
                let shortest = &mut shortest[place[v as usize] as usize];
                *shortest = shortest.min(longest);
            }
        }
    }
    let tolerance = |(edge, position): (f32, &Vec3)| {
        let rounding = position.abs().max_element() * ROUNDING;
        let tolerance = (edge * PLACE_TOLERANCE)
            .max(rounding)
            .min(edge * MAX_EDGE_SHARE);
        if tolerance.is_normal() {
            tolerance
        } else {
            0.0
        }
    };
    shortest
        .into_iter()
        .zip(&mesh.positions)
        .map(tolerance)
        .collect()
}

/// For each vertex, the first vertex of the same place with similar attributes.
fn corners_of(mesh: &SourceMesh, place: &[u32], mut corner: Vec<u32>) -> Vec<u32> {
    // Other attributes are unknown, so vertices may look different. Meshes of several parts have other attributes.
    if mesh.has_other_attributes {
        return corner;
    }
    // For each place with several vertices, one vertex per look.
    let mut corners_at: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for v in 0..place.len() as u32 {
        let first = place[v as usize];
        if first == v {
            continue;
        }
        let corners = corners_at.entry(first).or_insert_with(|| vec![first]);
        match corners.iter().find(|&&other| looks_alike(mesh, v, other)) {
            Some(&other) => corner[v as usize] = other,
            None if corners.len() < MAX_CORNERS => corners.push(v),
            None => {}
        }
    }
    corner
}

fn looks_alike(mesh: &SourceMesh, a: u32, b: u32) -> bool {
    let [a, b] = [a, b].map(|v| v as usize);
    let uv = |uvs: &[Vec2]| uvs.is_empty() || is_near(uvs[a] - uvs[b], SAME_UV);
    let normal = |n: &[Vec3]| n.is_empty() || (n[a] - n[b]).length() <= SAME_NORMAL;
    let color = |c: &[Vec4]| c.is_empty() || (c[a] - c[b]).abs().max_element() <= SAME_COLOR;
    let tangent = |t: &[Vec4]| {
        t.is_empty()
            || t[a] == t[b]
            || t[a].w == t[b].w && t[a].truncate().dot(t[b].truncate()) >= SAME_TANGENT
    };
    uv(&mesh.uvs)
        && uv(&mesh.uvs_1)
        && normal(&mesh.normals)
        && color(&mesh.colors)
        && tangent(&mesh.tangents)
}

fn is_near(difference: Vec2, tolerance: f32) -> bool {
    difference.abs().max_element() <= tolerance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;

    fn places(mesh: &SourceMesh) -> usize {
        let place = Topology::of(mesh, &Surfaces::default()).place;
        place
            .iter()
            .zip(0..)
            .filter(|&(&first, v)| first == v)
            .count()
    }

    #[test]
    fn rounded_corners_are_welded() {
        let ball = fixtures::icosphere(4);
        for rounding in [0.0, 1e-8, 1e-7] {
            assert_eq!(
                places(&fixtures::soup(&ball, rounding)),
                ball.positions.len()
            );
        }
    }

    /// Comparisons of all pairs of tips would take hours.
    #[test]
    fn many_tips_apart_by_rounding_are_welded() {
        let needles = 300_000;
        let mut mesh = SourceMesh::default();
        for needle in 0..needles {
            let angle = needle as f32 / needles as f32 * std::f32::consts::TAU;
            let tip = Vec3::new(needle as f32, (needle * 7_919 % needles) as f32, 1.0);
            let rim = Vec3::new(angle.cos(), angle.sin(), 0.0);
            let side = Vec3::new(-angle.sin(), angle.cos(), 0.0) * 1e-6;
            let corners = [tip * (1e-6 / needles as f32), rim + side, rim - side];
            mesh.positions.extend(corners);
            mesh.indices.extend(needle * 3..needle * 3 + 3);
        }
        let place = Topology::of(&mesh, &Surfaces::default()).place;
        assert!(place.iter().step_by(3).all(|tip| *tip == 0));
    }

    #[test]
    fn small_parts_keep_their_places_beside_large_ones() {
        let mut ball = fixtures::soup(&fixtures::icosphere(3), 0.0);
        for position in &mut ball.positions {
            *position = *position * 1e-5 + Vec3::X;
        }
        let of_ball = places(&ball);
        let both = fixtures::joined(&[ball, fixtures::soup(&fixtures::plane(1), 0.0)]);
        assert_eq!(places(&both), of_ball + 4);
    }

    #[test]
    fn corners_of_hard_edges_and_seams_stay_separate() {
        let flat = fixtures::icosphere(2).without_shared_vertices();
        let topology = Topology::of(&flat, &Surfaces::default());
        let corners = topology
            .corner
            .iter()
            .zip(0..)
            .filter(|&(&first, v)| first == v);
        assert_eq!(corners.count(), flat.positions.len());
        let knot = fixtures::torus_knot(24, 8);
        let topology = Topology::of(&knot, &Surfaces::default());
        assert!(
            topology
                .place
                .iter()
                .zip(&topology.corner)
                .any(|(place, corner)| place != corner)
        );
    }
}
