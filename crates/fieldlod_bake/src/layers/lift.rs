//! Lifts the layers of each level in front of the surfaces behind them.

use std::collections::BTreeMap;

use fieldlod_hierarchy::{Group, Hierarchy, Sphere};
use glam::Vec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::{Layer, Layers};
use crate::mesh::bits;
use crate::mesh::triangle_tree::TriangleTree;

/// The share of its distance in the source that a layer keeps. Points between samples may be lower. At 1, a decal on a
/// ball needs twice the triangles; at 0.1, four layers lose as few pixels.
const KEPT_GAP: f32 = 0.5;
/// Least cosine between the normals of a layer and the surface behind it at a level. Coarse levels turn by more than the
/// source; the other side of a thin part faces away.
const LEAST_COSINE: f32 = 0.5;
/// Largest number of sample rows on one triangle. The distance between samples is the reach of layers.
const MOST_ROWS: u32 = 16;
/// Number of times that layers are measured and lifted. A vertex rises along its own normal, and not along the normals
/// of its triangles.
const PASSES: usize = 3;

/// A level with one place per position and component.
struct Level {
    /// Positions in scaled units.
    places: Vec<Vec3>,
    /// Corners as indices of places.
    triangles: Vec<[u32; 3]>,
    /// The component of each triangle.
    component: Vec<u32>,
    /// Largest distance at which the surface behind a layer is looked for.
    range: f32,
}

/// New positions of vertices of a level, in local units.
type Lifted = FxHashMap<u32, Vec3>;

impl Layers {
    /// Lifts layers at each level of the whole mesh. `origin` has the source vertex of each vertex, and those of lifted
    /// vertices are added. A hierarchy in which nothing is lifted is returned as it is.
    pub(crate) fn lift(
        &self,
        hierarchy: Hierarchy,
        origin: &mut Vec<u32>,
        scaled_from_local: f32,
    ) -> Hierarchy {
        let Some(whole) = hierarchy.whole_mesh_levels() else {
            return hierarchy;
        };
        let levels = whole.units.iter();
        let levels: Vec<Vec<[u32; 3]>> =
            levels.map(|it| whole.triangles_of(it).collect()).collect();
        // The finest level is the source.
        let coarser = (1..levels.len()).into_par_iter();
        let lifted = coarser.map(|index| {
            let mut level = self.level(&whole, index, &levels[index], origin, scaled_from_local);
            level.lift(self, &levels[index], scaled_from_local)
        });
        let lifted: Vec<Lifted> = lifted.collect();
        if lifted.iter().all(Lifted::is_empty) {
            return hierarchy;
        }
        with_lifted(whole, levels, &lifted, origin).unwrap_or(hierarchy)
    }

    fn level(
        &self,
        whole: &Hierarchy,
        index: usize,
        triangles: &[[u32; 3]],
        origin: &[u32],
        scaled_from_local: f32,
    ) -> Level {
        let finer = &whole.groups[index - 1];
        let mut level = Level {
            places: Vec::new(),
            triangles: Vec::with_capacity(triangles.len()),
            component: Vec::with_capacity(triangles.len()),
            range: self.reach_in_scaled + 2.0 * finer.error_in_local * scaled_from_local,
        };
        let mut at: FxHashMap<(u32, [u32; 3]), u32> = FxHashMap::default();
        for triangle in triangles {
            let own = self.component[origin[triangle[0] as usize] as usize];
            level.component.push(own);
            level.triangles.push(triangle.map(|vertex| {
                let position = whole.vertices.positions[vertex as usize];
                *at.entry((own, bits(position))).or_insert_with(|| {
                    level.places.push(position * scaled_from_local);
                    level.places.len() as u32 - 1
                })
            }));
        }
        level
    }
}

impl Level {
    /// Lifts all layers. Returns the new positions of `triangles`, which are those of the level.
    fn lift(&mut self, layers: &Layers, triangles: &[[u32; 3]], scaled_from_local: f32) -> Lifted {
        let before = self.places.clone();
        for layer in (0..PASSES).flat_map(|_| &layers.layers) {
            for (place, lift) in self.lifts(layer, layers.reach_in_scaled) {
                self.places[place as usize] += lift;
            }
        }
        let corners = triangles.as_flattened().iter();
        let corners = corners.zip(self.triangles.as_flattened());
        let lifted =
            corners.filter(|&(_, &place)| before[place as usize] != self.places[place as usize]);
        let local_from_scaled = scaled_from_local.recip();
        lifted
            .map(|(&vertex, &place)| (vertex, self.places[place as usize] * local_from_scaled))
            .collect()
    }

    /// The places of a layer that are too low, and the ways by which they rise.
    fn lifts(&self, layer: &Layer, spacing: f32) -> impl Iterator<Item = (u32, Vec3)> + use<> {
        let all = || self.triangles.iter().zip(&self.component);
        let corners = |triangle: &[u32; 3]| triangle.map(|place| self.places[place as usize]);
        let behind = all().filter(|(_, own)| layer.behind.binary_search(own).is_ok());
        let tree = TriangleTree::new(behind.map(|(triangle, _)| corners(triangle)));
        // For each place, the sum of normals and the largest need.
        let mut needs: BTreeMap<u32, (Vec3, f32)> = BTreeMap::new();
        for (triangle, _) in all().filter(|(_, own)| **own == layer.component) {
            let of_triangle @ [a, b, c] = corners(triangle);
            let cross = (b - a).cross(c - a);
            let normal = cross.normalize_or_zero();
            let heights = samples(of_triangle, spacing)
                .filter_map(|at| height_above(&tree, at, normal, self.range));
            let lowest = heights.fold(f32::INFINITY, f32::min);
            // Backs of two-sided layers have nothing behind them. Their normals would cancel those of the fronts.
            if lowest == f32::INFINITY {
                continue;
            }
            for place in triangle {
                let (normals, need) = needs.entry(*place).or_default();
                *normals += cross;
                *need = need.max(layer.gap_in_scaled * KEPT_GAP - lowest);
            }
        }
        let needs = needs.into_iter().filter(|(_, (_, need))| *need > 0.0);
        needs.map(|(place, (normals, need))| (place, normals.normalize_or_zero() * need))
    }
}

/// Corners of a triangle, and points between them.
fn samples([a, b, c]: [Vec3; 3], spacing: f32) -> impl Iterator<Item = Vec3> {
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let rows = ((longest / spacing) as u32).clamp(1, MOST_ROWS);
    let point = move |row: u32, column: u32| {
        let [x, y] = [row, column].map(|count| count as f32 / rows as f32);
        a + (b - a) * x + (c - a) * y
    };
    (0..=rows).flat_map(move |row| (0..=rows - row).map(move |column| point(row, column)))
}

/// Height of a point above the nearest surface on the line along `normal` that faces alike. `None` without one in range.
fn height_above(tree: &TriangleTree, point: Vec3, normal: Vec3, range: f32) -> Option<f32> {
    let mut nearest: Option<f32> = None;
    tree.none_within(point, range, |_, [a, b, c]| {
        let facing = (b - a).cross(c - a).normalize_or_zero();
        let cosine = facing.dot(normal);
        if cosine < LEAST_COSINE {
            return false;
        }
        let height = (point - a).dot(facing) / cosine;
        let foot = point - normal * height;
        let is_inside = |p: Vec3, q: Vec3| facing.dot((q - p).cross(foot - p)) >= 0.0;
        // Ties by sign: the result must not depend on the order of the search.
        let is_nearer = |least: f32| (height.abs(), height) < (least.abs(), least);
        if is_inside(a, b) && is_inside(b, c) && is_inside(c, a) && nearest.is_none_or(is_nearer) {
            nearest = Some(height);
        }
        false
    });
    nearest
}

/// The levels with lifted vertices. `lifted` has those of each level but the finest. `None` if a level needs more
/// vertices than 16-bit indices allow.
fn with_lifted(
    whole: Hierarchy,
    mut levels: Vec<Vec<[u32; 3]>>,
    lifted: &[Lifted],
    origin: &mut Vec<u32>,
) -> Option<Hierarchy> {
    let groups = whole.groups;
    let mut result = Hierarchy {
        source: whole.source,
        source_vertex_count: whole.source_vertex_count,
        vertices: whole.vertices,
        ..Hierarchy::default()
    };
    let mut origins = origin.clone();
    let mut longest = vec![0.0f32; levels.len()];
    for (index, lifted) in (1..).zip(lifted) {
        let mut new_of: FxHashMap<u32, u32> = FxHashMap::default();
        for vertex in levels[index].as_flattened_mut() {
            let Some(&position) = lifted.get(vertex) else {
                continue;
            };
            let before = *vertex;
            *vertex = *new_of.entry(before).or_insert_with(|| {
                let own = &mut result.vertices;
                let way = position.distance(own.positions[before as usize]);
                longest[index] = longest[index].max(way);
                own.push_copy(before, position);
                origins.push(origins[before as usize]);
                origins.len() as u32 - 1
            });
        }
    }
    // Two components may share a position, so origins tell which one a lifted vertex belongs to.
    result.moved_from = origins[whole.source_vertex_count as usize..].to_vec();
    let bounds = Sphere::around(result.vertices.positions.iter().copied());
    let mut most = 0.0f32;
    for (index, (level, group)) in levels.iter().zip(groups).enumerate() {
        // A group has the error of the next level. Errors must not shrink towards coarser levels.
        most = longest.get(index + 1).map_or(most, |next| next.max(most));
        let group = Group {
            bounds,
            error_in_local: group.error_in_local.max(most),
            deviation_in_local: group.deviation_in_local + most,
            ..group
        };
        result.push_whole_mesh(level, group)?;
    }
    *origin = origins;
    Some(result)
}
