//! Random cuts: holes, overlaps and flipped triangles.

use std::collections::{HashMap, HashSet};

use fieldlod_hierarchy::Hierarchy;
use fieldlod_hierarchy::fixtures::Random;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Verified, VerifyError, VerifySettings, cut};
use crate::SourceMesh;

pub(super) fn check(
    mesh: &SourceMesh,
    hierarchy: &Hierarchy,
    settings: &VerifySettings,
    verified: &mut Verified,
) -> Result<(), VerifyError> {
    let source = Source::of(mesh);
    source.check_finest(hierarchy)?;
    let cuts = (0..settings.cuts).into_par_iter();
    let shares: Result<Vec<f32>, VerifyError> = cuts
        .map(|index| source.check_cut(index, hierarchy, settings))
        .collect();
    verified.flipped_area = shares?.into_iter().fold(0.0, f32::max);
    verified.cuts = settings.cuts;
    Ok(())
}

/// A third of the cuts by error, a third by place as a camera would, a third at random.
fn random_cut(index: u32, hierarchy: &Hierarchy) -> Vec<(Option<u32>, [u32; 3])> {
    let mut random = Random::new(u64::from(index));
    let groups = &hierarchy.groups;
    let some_group = |random: &mut Random| &groups[random.index(groups.len())];
    match index % 3 {
        0 => {
            let threshold = some_group(&mut random).error_in_local;
            cut(hierarchy, |group| groups[group].error_in_local > threshold)
        }
        1 => {
            let (near, far) = (
                some_group(&mut random).bounds,
                some_group(&mut random).bounds,
            );
            let reach = near.center.distance(far.center) * random.unit();
            cut(hierarchy, |group| {
                let bounds = groups[group].bounds;
                bounds.center.distance(near.center) < reach + bounds.radius
            })
        }
        _ => {
            let share = random.unit().powi(3);
            cut(hierarchy, |_| random.unit() < share)
        }
    }
}

struct Source<'a> {
    mesh: &'a SourceMesh,
    positions: Vec<Vec3>,
    scaled_from_local: f32,
    /// The first vertex at the same place as each.
    weld: Vec<u32>,
    /// Welded vertices at open edges.
    border: HashSet<u32>,
    /// At the first vertex of each place, the direction in which the source faces there.
    normals: Vec<DVec3>,
}

impl<'a> Source<'a> {
    fn of(mesh: &'a SourceMesh) -> Self {
        let weld = weld(&mesh.positions);
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let border = open_edges(triangles, &weld);
        let scaled_from_local = crate::input::power_of_two_above(&mesh.positions).recip();
        let positions: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|p| *p * scaled_from_local)
            .collect();
        Self {
            mesh,
            normals: normals_of(triangles, &positions, &weld),
            border: border.into_iter().flat_map(|(a, b)| [a, b]).collect(),
            positions,
            scaled_from_local,
            weld,
        }
    }

    fn check_finest(&self, hierarchy: &Hierarchy) -> Result<(), VerifyError> {
        let mut balance: HashMap<[u32; 3], i64> = HashMap::new();
        for (_, triangle) in cut(hierarchy, |_| true) {
            *balance.entry(turned(triangle)).or_default() += 1;
        }
        let (source, _) = self.mesh.indices.as_chunks::<3>();
        for &triangle in source {
            *balance.entry(turned(triangle)).or_default() -= 1;
        }
        match balance.values().filter(|&&count| count != 0).count() {
            0 => Ok(()),
            found => Err(VerifyError::FinestCut { found }),
        }
    }

    /// The share of the area that is flipped.
    fn check_cut(
        &self,
        index: u32,
        hierarchy: &Hierarchy,
        settings: &VerifySettings,
    ) -> Result<f32, VerifyError> {
        let (cut, drawn) = (index, random_cut(index, hierarchy));
        let triangles = drawn.len();
        let corners: Vec<[u32; 3]> = drawn.iter().map(|&(_, corners)| corners).collect();
        let open = open_edges(&corners, &self.weld);
        let new = open
            .iter()
            .filter(|(a, b)| !self.border.contains(a) || !self.border.contains(b));
        let edges = new.count();
        if edges > 0 {
            return Err(VerifyError::Hole {
                cut,
                triangles,
                edges,
            });
        }
        let share = self.flipped_share(&drawn, hierarchy);
        if share > settings.flipped_area {
            return Err(VerifyError::Flipped {
                cut,
                triangles,
                share,
            });
        }
        Ok(share)
    }

    /// Triangles thinner than twice the deviation have no facing of their own: not counted.
    fn flipped_share(&self, drawn: &[(Option<u32>, [u32; 3])], hierarchy: &Hierarchy) -> f32 {
        let (mut flipped, mut whole) = (0.0, 0.0);
        for &(producer, triangle) in drawn {
            let area_vector = self.area_vector(triangle);
            let area = area_vector.length();
            whole += area;
            let deviation = producer.map_or(0.0, |group| {
                hierarchy.groups[group as usize].deviation_in_local * self.scaled_from_local
            });
            let thin = area <= 2.0 * f64::from(deviation) * self.longest_edge(triangle);
            if !thin && self.faces_against(triangle, area_vector) {
                flipped += area;
            }
        }
        if whole > 0.0 {
            (flipped / whole) as f32
        } else {
            0.0
        }
    }

    fn longest_edge(&self, triangle: [u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|v| self.positions[v as usize].as_dvec3());
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    }

    /// Twice as long as the triangle has area.
    fn area_vector(&self, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|v| self.positions[v as usize].as_dvec3());
        (b - a).cross(c - a)
    }

    /// Whether a triangle faces away from the source surface at all its corners.
    fn faces_against(&self, triangle: [u32; 3], area_vector: DVec3) -> bool {
        let normals = triangle.map(|v| self.normals[self.weld[v as usize] as usize]);
        normals.iter().all(|normal| normal.dot(area_vector) < 0.0)
    }
}

/// Sums of the area vectors of the triangles around each place.
fn normals_of(triangles: &[[u32; 3]], positions: &[Vec3], weld: &[u32]) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| positions[v as usize].as_dvec3());
        for &vertex in triangle {
            normals[weld[vertex as usize] as usize] += (b - a).cross(c - a);
        }
    }
    normals
}

/// The same triangle, its smallest vertex first.
fn turned(mut triangle: [u32; 3]) -> [u32; 3] {
    let smallest = (0..3).min_by_key(|&corner| triangle[corner]);
    triangle.rotate_left(smallest.unwrap_or(0));
    triangle
}

/// The first vertex at the place of each.
fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut first_at: HashMap<[u32; 3], u32> = HashMap::new();
    // Adding zero makes one of the two zeros.
    let bits = |p: &Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let vertices = positions.iter().enumerate();
    vertices
        .map(|(v, p)| *first_at.entry(bits(p)).or_insert(v as u32))
        .collect()
}

/// The edges, by welded vertices, that are not passed as often one way as the other.
fn open_edges(triangles: &[[u32; 3]], weld: &[u32]) -> HashSet<(u32, u32)> {
    let mut edges: Vec<(u32, u32, i32)> = Vec::with_capacity(triangles.len() * 3);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| weld[v as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let sign = if from < to { 1 } else { -1 };
            if from != to {
                edges.push((from.min(to), from.max(to), sign));
            }
        }
    }
    edges.sort_unstable();
    let same = edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1));
    let open = same.filter(|same| same.iter().map(|edge| edge.2).sum::<i32>() != 0);
    open.map(|same| (same[0].0, same[0].1)).collect()
}
