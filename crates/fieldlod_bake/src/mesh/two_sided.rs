//! Two-sided sheets, such as cloth and leaves, in which each triangle has a twin at the same place that faces the other
//! way.
//!
//! A simplifier takes both sides for one closed surface without thickness. It then collapses the border, and the sheet
//! shrinks. The bake therefore simplifies only the front sides, and adds back sides to the result.

use std::collections::VecDeque;

use rustc_hash::FxHashMap;

use crate::levels::groups::Groups;
use crate::levels::vertices::{LevelVertices, NewVertex};
use crate::mesh::SourceMesh;
use crate::mesh::components::connected;
use crate::mesh::topology::Topology;

const NONE: u32 = u32::MAX;

/// Front and back sides of a mesh's sheets.
pub(crate) struct Sheets {
    /// Back triangle of each front triangle. The key starts with the smallest index.
    backs: FxHashMap<[u32; 3], [u32; 3]>,
    /// For each front vertex, a back vertex at the same place; itself if both sides share it.
    back_vertex: FxHashMap<u32, u32>,
    /// Indices of all triangles except backs.
    front: Vec<u32>,
}

impl Sheets {
    /// Finds components in which every triangle has one twin. `None` if there are none.
    pub(crate) fn of(mesh: &SourceMesh, topology: &Topology) -> Option<Self> {
        let place = &topology.place;
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let twin = twins_of(triangles, place)?;
        let is_sheet = are_sheets(triangles, &twin, place);
        let is_back = backs_of(triangles, &twin, &is_sheet, place);
        let mut sheets = Self {
            backs: FxHashMap::default(),
            back_vertex: FxHashMap::default(),
            front: Vec::new(),
        };
        for (index, &triangle) in triangles.iter().enumerate() {
            if is_back[index] {
                continue;
            }
            sheets.front.extend(triangle);
            if is_sheet[index] {
                let back = triangles[twin[index] as usize];
                for vertex in triangle {
                    let at = |other: &&u32| place[**other as usize] == place[vertex as usize];
                    let other = back.iter().find(at).copied().unwrap_or(vertex);
                    // Levels use the first vertex of each corner.
                    for own in [vertex, topology.corner[vertex as usize]] {
                        sheets.back_vertex.entry(own).or_insert(other);
                    }
                }
                sheets.backs.insert(least_first(triangle), back);
            }
        }
        (!sheets.backs.is_empty()).then_some(sheets)
    }

    /// Number of triangles that are backs.
    pub(crate) fn back_count(&self) -> usize {
        self.backs.len()
    }

    /// The mesh without backs.
    pub(crate) fn front_of(&self, mesh: &SourceMesh) -> SourceMesh {
        SourceMesh {
            indices: self.front.clone(),
            ..mesh.clone()
        }
    }

    /// Adds to all units the backs of their front triangles.
    pub(crate) fn add_backs(&self, groups: &mut Groups, vertices: &mut LevelVertices) {
        let mut made = FxHashMap::default();
        for unit in groups.0.iter_mut().flat_map(|group| &mut group.units) {
            let backs = unit.clusters.iter().map(|corners| {
                let (triangles, _) = corners.as_chunks::<3>();
                let backs = triangles
                    .iter()
                    .filter_map(|&triangle| self.back_of(triangle, vertices, &mut made));
                backs.flatten().collect()
            });
            let backs: Vec<Vec<u32>> = backs.collect();
            unit.clusters.extend(
                backs
                    .into_iter()
                    .filter(|corners: &Vec<u32>| !corners.is_empty()),
            );
        }
    }

    /// The back of a triangle of any level. `None` unless all its vertices are front vertices.
    fn back_of(
        &self,
        triangle: [u32; 3],
        vertices: &mut LevelVertices,
        made: &mut FxHashMap<u32, u32>,
    ) -> Option<[u32; 3]> {
        if let Some(&back) = self.backs.get(&least_first(triangle)) {
            return Some(back);
        }
        let [a, b, c] = triangle;
        let is_front = |v: &u32| self.back_vertex.contains_key(&vertices.origin[*v as usize]);
        if !triangle.iter().all(is_front) {
            return None;
        }
        Some([a, c, b].map(|v| self.back_at(v, vertices, made)))
    }

    fn back_at(&self, v: u32, vertices: &mut LevelVertices, made: &mut FxHashMap<u32, u32>) -> u32 {
        let origin = vertices.origin[v as usize];
        let of_origin = self.back_vertex[&origin];
        if of_origin == origin {
            return v;
        }
        if v == origin {
            return of_origin;
        }
        *made.entry(v).or_insert_with(|| {
            let [own, front, back] =
                [v, origin, of_origin].map(|vertex| vertices.row(vertex).to_vec());
            let row = vertices.layout.back_row(&own, &front, &back);
            let new = NewVertex {
                before: of_origin,
                position: vertices.positions[v as usize],
                same_position: Some(vertices.same_position[v as usize]),
            };
            vertices.push(&new, &row)
        })
    }
}

/// For each triangle, the twin at the same place that faces the other way. `None` if no triangle has one.
fn twins_of(triangles: &[[u32; 3]], place: &[u32]) -> Option<Vec<u32>> {
    let mut twin = vec![NONE; triangles.len()];
    let mut first: FxHashMap<[u32; 3], u32> = FxHashMap::default();
    let mut any = false;
    for (index, triangle) in triangles.iter().enumerate() {
        let places = least_first(triangle.map(|v| place[v as usize]));
        let [a, b, c] = places;
        if a == b || b == c || c == a {
            continue;
        }
        if let Some(&other) = first.get(&[a, c, b])
            && twin[other as usize] == NONE
        {
            (twin[other as usize], twin[index]) = (index as u32, other);
            any = true;
        } else {
            first.insert(places, index as u32);
        }
    }
    any.then_some(twin)
}

/// For each triangle, whether all triangles of its component have twins.
fn are_sheets(triangles: &[[u32; 3]], twin: &[u32], place: &[u32]) -> Vec<bool> {
    let first = connected(place.to_vec(), triangles);
    let first_of = |triangle: &[u32; 3]| first[triangle[0] as usize] as usize;
    let mut is_mixed = vec![false; place.len()];
    for (triangle, &twin) in triangles.iter().zip(twin) {
        is_mixed[first_of(triangle)] |= twin == NONE;
    }
    let is_sheet = |triangle| !is_mixed[first_of(triangle)];
    triangles.iter().map(is_sheet).collect()
}

/// For each triangle, whether it is a back. The first triangle of each sheet is a front. Two neighbours are on the same
/// side if they use their shared edge in opposite directions.
fn backs_of(triangles: &[[u32; 3]], twin: &[u32], is_sheet: &[bool], place: &[u32]) -> Vec<bool> {
    let edges_of = |index: u32| {
        let [a, b, c] = triangles[index as usize].map(|v| place[v as usize]);
        [(a, b), (b, c), (c, a)]
    };
    let of_sheets = || (0..triangles.len() as u32).filter(|&index| is_sheet[index as usize]);
    let mut by_edge: FxHashMap<(u32, u32), Vec<u32>> = FxHashMap::default();
    for index in of_sheets() {
        for edge in edges_of(index) {
            by_edge.entry(edge).or_default().push(index);
        }
    }
    let mut is_back = vec![false; triangles.len()];
    let mut is_front = vec![false; triangles.len()];
    let mut waiting = VecDeque::new();
    for first in of_sheets() {
        let mut found = vec![first];
        loop {
            // Marked before they wait: an edge of many sheets would add each triangle once per sheet.
            for index in found {
                if !is_front[index as usize] && !is_back[index as usize] {
                    is_front[index as usize] = true;
                    is_back[twin[index as usize] as usize] = true;
                    waiting.push_back(index);
                }
            }
            let Some(index) = waiting.pop_front() else {
                break;
            };
            // The triangles at an edge are all on one side, so they are found once.
            let edges = edges_of(index).into_iter();
            let at_edges = edges.flat_map(|(from, to)| by_edge.remove(&(to, from)));
            found = at_edges.flatten().collect();
        }
    }
    is_back
}

/// Rotates a triangle so that its smallest index is first.
pub(crate) fn least_first<I: Ord + Copy>(mut triangle: [I; 3]) -> [I; 3] {
    let first = (0..3).min_by_key(|&corner| triangle[corner]);
    triangle.rotate_left(first.unwrap_or(0));
    triangle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::surfaces::Surfaces;
    use glam::Vec3;

    /// Each sheet visits each other one if it waits once per neighbour: 2.5e9 visits.
    #[test]
    fn many_sheets_on_one_edge_are_found() {
        let sheets = 50_000;
        let mut mesh = SourceMesh::default();
        mesh.positions.extend([Vec3::ZERO, Vec3::Y]);
        for sheet in 0..sheets {
            let angle = sheet as f32 / sheets as f32 * std::f32::consts::TAU;
            mesh.positions
                .push(Vec3::new(angle.cos(), 0.5, angle.sin()));
            mesh.indices.extend([0, 1, sheet + 2, 1, 0, sheet + 2]);
        }
        let topology = Topology::of(&mesh, &Surfaces::default());
        let found = Sheets::of(&mesh, &topology).unwrap();
        assert_eq!(found.back_count(), sheets as usize);
    }
}
