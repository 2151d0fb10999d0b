//! How far normals and texture coordinates are off where a simplification removed vertices.
//!
//! Each removed vertex is compared with the surface at the place nearest to it. Those at seams and
//! on thin pieces may find themselves compared with another side; the median passes over them.

use fieldlod_hierarchy::{Group, Hierarchy, Vertices};
use glam::{Vec3, Vec3A};
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::surface::{Hit, RunTree};
use crate::triangle::Triangle;

/// Most vertices that are looked at in one group.
const MOST_VERTICES: usize = 64;

/// Fills in the attribute errors of all groups. In scaled units, squares of coordinates do not
/// overflow.
pub(crate) fn measure_attribute_errors(hierarchy: &mut Hierarchy, scaled_from_local: f32) {
    if hierarchy.vertices.normals.is_empty() && hierarchy.vertices.uvs.is_empty() {
        return;
    }
    let comparison = AttributeComparison::new(hierarchy, scaled_from_local);
    let groups = (0..hierarchy.groups.len()).into_par_iter();
    let errors = groups.map(|group| {
        let found = comparison.differences(group, MOST_VERTICES);
        [median(found.normals), median(found.uvs)]
    });
    let errors: Vec<[f32; 2]> = errors.collect();
    for (group, [normal, uv]) in hierarchy.groups.iter_mut().zip(errors) {
        group.normal_error = normal.min(2.0);
        group.uv_error = uv.min(f32::MAX);
    }
}

/// What was found at the vertices that a simplification removed.
#[derive(Debug, Default)]
pub(crate) struct Differences {
    /// Lengths of the differences of unit normals.
    pub(crate) normals: Vec<f32>,
    /// Lengths of the differences of texture coordinates.
    pub(crate) uvs: Vec<f32>,
}

/// A hierarchy whose attributes are compared with themselves.
pub(crate) struct AttributeComparison<'a> {
    hierarchy: &'a Hierarchy,
    scaled_from_local: f32,
    /// For each group, the units that it produced.
    simplified: Vec<Vec<u32>>,
}

impl<'a> AttributeComparison<'a> {
    pub(crate) fn new(hierarchy: &'a Hierarchy, scaled_from_local: f32) -> Self {
        let mut simplified = vec![Vec::new(); hierarchy.groups.len()];
        for (index, unit) in hierarchy.units.iter().enumerate() {
            if let Some(group) = unit.producer() {
                simplified[group as usize].push(index as u32);
            }
        }
        Self {
            hierarchy,
            scaled_from_local,
            simplified,
        }
    }

    /// In scaled units.
    fn position(&self, vertex: u32) -> Vec3A {
        Vec3A::from(self.hierarchy.vertices.positions[vertex as usize] * self.scaled_from_local)
    }

    /// The differences at `most` of the vertices that the simplification of `group` removed.
    pub(crate) fn differences(&self, group: usize, most: usize) -> Differences {
        let hierarchy = self.hierarchy;
        // What the group was simplified to.
        let units = self.simplified[group].iter();
        let triangles: Vec<[u32; 3]> = units
            .flat_map(|&unit| hierarchy.source_triangles_of(&hierarchy.units[unit as usize]))
            .collect();
        if triangles.is_empty() {
            return Differences::default();
        }
        let corners = |triangle: u32| triangles[triangle as usize].map(|v| self.position(v));
        let tree = RunTree::of(triangles.len(), corners);
        // The triangle nearest to each vertex that is gone: it starts the search for the next.
        let mut found = Differences::default();
        let mut nearest = 0;
        for vertex in removed_vertices(hierarchy, &hierarchy.groups[group], &triangles, most) {
            let point = self.position(vertex);
            let distance = |triangle: u32| {
                let [a, b, c] = corners(triangle);
                Triangle::between(a, b, c).distance_squared(point)
            };
            let start = Hit {
                distance_squared: distance(nearest),
                triangle: nearest,
            };
            nearest = tree.nearest(point, 0.0, start, distance).triangle;
            let shares = nearest_shares(point, corners(nearest));
            let triangle = triangles[nearest as usize];
            found.add(&hierarchy.vertices, vertex, triangle, shares);
        }
        found
    }
}

impl Differences {
    /// Compares a vertex with the point of a triangle that has these `shares` of its corners.
    fn add(&mut self, vertices: &Vertices, vertex: u32, triangle: [u32; 3], shares: Vec3) {
        let normal = vertices.normals.get(vertex as usize);
        if let Some(normal) = normal.and_then(|normal| normal.try_normalize()) {
            let [a, b, c] = triangle.map(|corner| vertices.normals[corner as usize]);
            let mixed = (a * shares.x + b * shares.y + c * shares.z).normalize_or_zero();
            self.normals.push(mixed.distance(normal));
        }
        if let Some(uv) = vertices.uvs.get(vertex as usize) {
            let [a, b, c] = triangle.map(|corner| vertices.uvs[corner as usize]);
            let mixed = a * shares.x + b * shares.y + c * shares.z;
            self.uvs.push(mixed.distance(*uv));
        }
    }
}

/// Some of the vertices that `group` consumes and its simplification does not use, spread evenly.
fn removed_vertices(
    hierarchy: &Hierarchy,
    group: &Group,
    simplified: &[[u32; 3]],
    most: usize,
) -> Vec<u32> {
    let mut seen: FxHashSet<u32> = simplified.iter().flatten().copied().collect();
    let units = &hierarchy.units[group.units()];
    let consumed = units.iter().flat_map(|unit| hierarchy.vertices_of(unit));
    let is_new = |vertex: &u32| seen.insert(*vertex);
    let removed: Vec<u32> = consumed.copied().filter(is_new).collect();
    let stride = removed.len().div_ceil(most).max(1);
    removed.into_iter().step_by(stride).collect()
}

/// The shares of the corners at the point of a triangle that is nearest to `point`; at a point near
/// that if it is on the outline.
fn nearest_shares(point: Vec3A, [a, b, c]: [Vec3A; 3]) -> Vec3 {
    // Barycentric coordinates of the foot on the triangle's plane.
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (bb, bc, cc) = (ab.dot(ab), ab.dot(ac), ac.dot(ac));
    let (pb, pc) = (ap.dot(ab), ap.dot(ac));
    let area_squared = bb * cc - bc * bc;
    let at_b = (cc * pb - bc * pc) / area_squared;
    let at_c = (bb * pc - bc * pb) / area_squared;
    // Outside of the triangle some are negative: the others share the whole.
    let shares = Vec3::new(1.0 - at_b - at_c, at_b, at_c).max(Vec3::ZERO);
    let normalized = shares / shares.element_sum();
    if normalized.is_finite() {
        normalized
    } else {
        Vec3::X
    }
}

/// 0 of nothing.
fn median(mut values: Vec<f32>) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_inside_on_the_outline_and_on_needles() {
        let corners = [Vec3A::ZERO, Vec3A::X, Vec3A::Y];
        let inside = nearest_shares(Vec3A::new(0.25, 0.5, 3.0), corners);
        assert!(inside.distance(Vec3::new(0.25, 0.25, 0.5)) < 1e-6);
        let corner = nearest_shares(Vec3A::new(-1.0, -2.0, 0.0), corners);
        assert!(corner.distance(Vec3::X) < 1e-6);
        assert_eq!(nearest_shares(Vec3A::ONE, [Vec3A::ZERO; 3]), Vec3::X);
    }

    #[test]
    fn half_of_the_values_are_no_larger_than_the_median() {
        assert_eq!(median(vec![5.0, 1.0, 4.0, 2.0, 3.0]), 3.0);
        assert_eq!(median(Vec::new()), 0.0);
    }
}
