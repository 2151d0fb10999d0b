//! Checks random cuts for holes, overlaps and flipped triangles.

use std::collections::{HashMap, HashSet};

use fieldlod_hierarchy::Random;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::report::{Verified, VerifyError};
use super::subject::{CutTriangle, ROUNDING, Subject};
use crate::mesh::components::connected;
use crate::mesh::edges::{is_unbalanced, sorted_edges};
use crate::mesh::triangle_tree::TriangleTree;
use crate::mesh::weld;

/// Components with up to this many triangles may come from several groups. Each group may have removed a part of the
/// component. It is the limit of small elements in the bake, stated independently.
const SMALL_ELEMENT: usize = 16;
/// Largest share of the area of a cut that may face away from the source.
const MOST_FLIPPED: f32 = 0.01;

pub(super) fn check(subject: &Subject<'_>, verified: &mut Verified) -> Result<(), VerifyError> {
    check_finest(subject)?;
    let source = Source::of(subject);
    let cuts = (0..subject.settings.cuts).into_par_iter();
    let checked = cuts.map(|index| source.check_cut(index));
    let shares: Vec<f32> = checked.collect::<Result<_, VerifyError>>()?;
    verified.flipped_area = shares.into_iter().fold(0.0, f32::max);
    verified.cuts = subject.settings.cuts;
    Ok(())
}

/// Checks that the finest cut has exactly the triangles of the source.
fn check_finest(subject: &Subject<'_>) -> Result<(), VerifyError> {
    let hierarchy = subject.hierarchy;
    let units = hierarchy.units_at_level(0).into_iter();
    let finest = units.flat_map(|unit| hierarchy.triangles_of(&hierarchy.units[unit]));
    let source = subject.source_triangles().iter().copied();
    match differing_triangles(finest, source) {
        0 => Ok(()),
        found => Err(VerifyError::FinestCut { found }),
    }
}

/// Counts the triangles that one list has more often than the other. Order and first corner do not matter.
pub(crate) fn differing_triangles(
    a: impl Iterator<Item = [u32; 3]>,
    b: impl Iterator<Item = [u32; 3]>,
) -> usize {
    let mut balance: HashMap<[u32; 3], i64> = HashMap::new();
    a.for_each(|triangle| *balance.entry(turned(triangle)).or_default() += 1);
    b.for_each(|triangle| *balance.entry(turned(triangle)).or_default() -= 1);
    balance.values().filter(|&&count| count != 0).count()
}

/// One third of the cuts are by error, one third by distance as for a camera, and one third random.
fn random_cut(index: u32, subject: &Subject<'_>) -> Vec<usize> {
    let mut random = Random::new(u64::from(index));
    let groups = &subject.hierarchy.groups;
    let some_group = |random: &mut Random| &groups[random.index(groups.len())];
    match index % 3 {
        0 => {
            let threshold = some_group(&mut random).error_in_local;
            subject.cut(|group| groups[group].error_in_local > threshold)
        }
        1 => {
            let [near, far] = [(); 2].map(|()| some_group(&mut random).bounds.center);
            let radius = near.distance(far) * random.unit();
            subject.cut(|group| {
                let bounds = groups[group].bounds;
                bounds.center.distance(near) < radius + bounds.radius
            })
        }
        _ => {
            let share = random.unit().powi(3);
            subject.cut(|_| random.unit() < share)
        }
    }
}

/// Properties of the source that cuts are compared with.
struct Source<'a> {
    subject: &'a Subject<'a>,
    /// For each vertex, the first vertex at its position.
    weld: Vec<u32>,
    /// Welded vertices at open edges.
    border: HashSet<u32>,
    /// For each unit, areas and directions of its triangles.
    facings: Vec<Vec<Facing>>,
}

/// Twice the area of a triangle, and whether it faces away from the source.
#[derive(Clone, Copy)]
struct Facing {
    area: f64,
    is_flipped: bool,
}

impl<'a> Source<'a> {
    fn of(subject: &'a Subject<'a>) -> Self {
        let positions = subject.positions.iter().enumerate();
        // Vertices of the source are also welded with a tolerance.
        let weld = weld(positions.map(|(vertex, position)| {
            let place = subject.place.get(vertex);
            place.map_or(*position, |&first| subject.positions[first as usize])
        }));
        let border = open_edges(subject.source_triangles(), &weld);
        Self {
            border: border.into_iter().flat_map(|(a, b)| [a, b]).collect(),
            facings: facings(subject),
            subject,
            weld,
        }
    }

    /// Returns the share of a random cut's area that is flipped.
    fn check_cut(&self, cut: u32) -> Result<f32, VerifyError> {
        let drawn = random_cut(cut, self.subject);
        let hierarchy = self.subject.hierarchy;
        let units = drawn.iter().map(|&unit| &hierarchy.units[unit]);
        // Edges may be open only where the source has a border.
        let corners: Vec<[u32; 3]> = units
            .flat_map(|unit| hierarchy.triangles_of(unit))
            .collect();
        let triangles = corners.len();
        let open = open_edges(&corners, &self.weld);
        // An edge between two border vertices may be a coarser border.
        let is_new = |(a, b): &(u32, u32)| !self.border.contains(a) || !self.border.contains(b);
        let new: Vec<(u32, u32)> = open.into_iter().filter(is_new).collect();
        let edges = if new.is_empty() {
            0
        } else {
            self.count_cracks(&new, &drawn)
        };
        if edges > 0 {
            return Err(VerifyError::Hole {
                cut,
                triangles,
                edges,
            });
        }
        let share = self.flipped_share(&drawn);
        if share > MOST_FLIPPED {
            return Err(VerifyError::Flipped {
                cut,
                triangles,
                share,
            });
        }
        Ok(share)
    }

    /// Counts open edges outside elements. An element is a component that one group made, or a small component of
    /// several groups. If the source has borders, an element may have moved with its border; samples check how far.
    fn count_cracks(&self, open: &[(u32, u32)], drawn: &[usize]) -> usize {
        if self.border.is_empty() {
            return open.len();
        }
        let is_element = elements_of(&self.weld, &self.subject.triangles_of(drawn));
        open.iter().filter(|edge| !is_element(edge.0)).count()
    }

    fn flipped_share(&self, drawn: &[usize]) -> f32 {
        let (mut flipped, mut whole) = (0.0, 0.0);
        for facing in drawn.iter().flat_map(|&unit| &self.facings[unit]) {
            whole += facing.area;
            flipped += if facing.is_flipped { facing.area } else { 0.0 };
        }
        if whole > 0.0 {
            (flipped / whole) as f32
        } else {
            0.0
        }
    }
}

/// Returns a function that is `true` for vertices of elements of a cut. `weld` has the first vertex at the position of
/// each vertex.
fn elements_of(weld: &[u32], cut: &[CutTriangle]) -> impl Fn(u32) -> bool + use<> {
    let triangles: Vec<[u32; 3]> = cut.iter().map(|triangle| triangle.corners).collect();
    let first = connected(weld.to_vec(), &triangles);
    // The groups that made each component, and its number of triangles.
    let mut components: HashMap<u32, (Vec<Option<u32>>, usize)> = HashMap::new();
    for triangle in cut {
        let component = first[triangle.corners[0] as usize];
        let (makers, triangles) = components.entry(component).or_default();
        if !makers.contains(&triangle.produced_by) {
            makers.push(triangle.produced_by);
        }
        *triangles += 1;
    }
    move |vertex| {
        let component = components.get(&first[vertex as usize]);
        component.is_some_and(|(makers, triangles)| {
            let is_whole = makers.len() == 1 || *triangles <= SMALL_ELEMENT;
            is_whole && !makers.contains(&None)
        })
    }
}

/// Areas and directions of the triangles of each unit.
fn facings(subject: &Subject<'_>) -> Vec<Vec<Facing>> {
    let tree = TriangleTree::new(subject.source_corners());
    let units = subject.hierarchy.units.par_iter();
    let facings = units.map(|unit| {
        // If no deviation was measured, the group's error is the search distance.
        let stated = subject.deviation_in_scaled(unit.producer());
        let deviation = match unit.producer() {
            Some(group) if stated == f32::INFINITY => {
                let group = &subject.hierarchy.groups[group as usize];
                group.error_in_local * subject.scaled_from_local
            }
            _ => stated,
        };
        let triangles = subject.hierarchy.triangles_of(unit);
        let facing = triangles.map(|triangle| {
            let corners = subject.corners(triangle);
            let area_vector = area_vector(corners);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let faces_alike = |_, other| self::area_vector(other).dot(area_vector) >= 0.0;
            // Flipped: no triangle of the source within the deviation faces this way.
            let is_flipped = unit.producer().is_some()
                && tree.none_within(middle, deviation + ROUNDING, faces_alike);
            Facing {
                area: area_vector.length(),
                is_flipped,
            }
        });
        facing.collect()
    });
    facings.collect()
}

/// The normal of the triangle. Its length is twice the area.
fn area_vector(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a)
}

/// The smallest of the three rotations of a triangle's corners. The smallest vertex alone does not determine it if a
/// vertex occurs twice.
fn turned([a, b, c]: [u32; 3]) -> [u32; 3] {
    [a, b, c].min([b, c, a]).min([c, a, b])
}

/// Edges that triangles use more often in one direction than in the other. Vertices are welded.
fn open_edges(triangles: &[[u32; 3]], weld: &[u32]) -> HashSet<(u32, u32)> {
    let triangles = triangles.iter();
    let edges = sorted_edges(triangles.map(|triangle| triangle.map(|v| weld[v as usize])));
    let same = edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1));
    let open = same.filter(is_unbalanced);
    open.map(|same| (same[0].0, same[0].1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each triangle of a long strip has a smaller first vertex than the previous one. Without path compression, the last
    /// vertices are 400,000 steps from the first.
    #[test]
    fn long_strips_are_one_element() {
        let count = 400_000;
        let weld: Vec<u32> = (0..count + 2).collect();
        let triangle = |first: u32| CutTriangle {
            produced_by: Some(0),
            corners: [first + 2, first + 1, first],
        };
        let cut: Vec<CutTriangle> = (0..count).rev().map(triangle).collect();
        let is_element = elements_of(&weld, &cut);
        assert!(weld.iter().all(|vertex| is_element(*vertex)));
    }
}
