//! Planes that triangles are laid on: each on the one that it is nearest to, and each plane where it is nearest to its
//! triangles (S. Lloyd: Least Squares Quantization in PCM, 1982, with planes in place of points).

use glam::{Mat3, Vec3};
use rayon::prelude::*;

/// How much a triangle that lies across a plane counts, as a share of its area.
const ACROSS: f32 = 10.0;
/// How much the square of the distance along a plane, from its middle, counts: so cards stay small, and rays go
/// through few. With a quarter of this the cards of a crown cover three times as much, for hardly less error.
const ALONG: f32 = 0.0625;
/// How often planes are moved.
const ROUNDS: usize = 12;
/// Planes are found by about so many triangles.
const SAMPLES: usize = 6_000;
/// How often a matrix is multiplied until what is left is the direction that it stretches most.
const POWERS: usize = 40;

/// A triangle that is laid on a plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub(super) corners: [Vec3; 3],
    middle: Vec3,
    pub(super) normal: Vec3,
    pub(super) area: f32,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) middle: Vec3,
    pub(super) normal: Vec3,
}

impl Facet {
    pub(super) fn of(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let cross = (b - a).cross(c - a);
        Self {
            corners,
            middle: (a + b + c) / 3.0,
            normal: cross.normalize_or_zero(),
            area: 0.5 * cross.length(),
        }
    }
}

impl Plane {
    /// What is lost if a triangle is laid on this plane: about the square of a length.
    fn cost(&self, facet: &Facet) -> f32 {
        let distances = facet
            .corners
            .map(|corner| (corner - self.middle).dot(self.normal));
        let away = distances.iter().map(|d| d * d).sum::<f32>() / 3.0;
        let facing = facet.normal.dot(self.normal);
        let across = facet.area * (1.0 - facing * facing);
        let along = (facet.middle - self.middle).length_squared();
        away + ACROSS * across + ALONG * along
    }

    /// The plane from which triangles are least away, in the mean square by their areas; `None` of nothing.
    fn through<'a>(facets: impl Iterator<Item = &'a Facet> + Clone) -> Option<Self> {
        let corners = facets.flat_map(|facet| facet.corners.map(|corner| (corner, facet.area)));
        let weight: f32 = corners.clone().map(|(_, area)| area).sum();
        if weight <= 0.0 {
            return None;
        }
        let sum: Vec3 = corners.clone().map(|(corner, area)| corner * area).sum();
        let middle = sum / weight;
        let mut spread = Mat3::ZERO;
        for (corner, area) in corners {
            let away = corner - middle;
            spread +=
                Mat3::from_cols(away * away.x, away * away.y, away * away.z) * (area / weight);
        }
        // It stretches least across the plane: so does the trace without it most.
        let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
        let flipped = Mat3::from_diagonal(Vec3::splat(trace)) - spread;
        // In no special direction, so that it is at right angles to none.
        let mut normal = Vec3::new(0.3, 0.5, 0.8);
        for _ in 0..POWERS {
            normal = (flipped * normal).try_normalize()?;
        }
        Some(Self { middle, normal })
    }
}

/// So many planes, and for each triangle the one that it is laid on; nothing of triangles without area.
pub(super) fn planes_of(facets: &[Facet], count: usize) -> (Vec<Plane>, Vec<usize>) {
    let samples = samples_of(facets);
    // At first, those of some triangles.
    let first = (0..count).filter_map(|index| samples.get(index * samples.len() / count));
    let mut planes: Vec<Plane> = first
        .map(|facet| Plane {
            middle: facet.middle,
            normal: facet.normal,
        })
        .collect();
    if planes.is_empty() {
        return Default::default();
    }
    for _ in 0..ROUNDS {
        let nearest = nearest_of(&samples, &planes);
        let mut own = vec![Vec::new(); planes.len()];
        for (sample, plane) in samples.iter().zip(nearest) {
            own[plane].push(*sample);
        }
        for (plane, own) in planes.iter_mut().zip(&own) {
            *plane = Plane::through(own.iter()).unwrap_or(*plane);
        }
    }
    let nearest = nearest_of(facets, &planes);
    (planes, nearest)
}

fn nearest_of(facets: &[Facet], planes: &[Plane]) -> Vec<usize> {
    let nearest = |facet: &Facet| {
        let costs = planes.iter().map(|plane| plane.cost(facet)).enumerate();
        costs
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(0, |(plane, _)| plane)
    };
    facets.par_iter().map(nearest).collect()
}

/// Triangles at equal steps of their area.
fn samples_of(facets: &[Facet]) -> Vec<Facet> {
    let area: f32 = facets.iter().map(|facet| facet.area).sum();
    let step = (area / SAMPLES as f32).max(f32::MIN_POSITIVE);
    let mut left = step * 0.5;
    let mut samples = Vec::new();
    for facet in facets {
        left -= facet.area;
        if left < 0.0 {
            samples.push(*facet);
            left = step - (-left % step);
        }
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(middle: Vec3, x: Vec3, y: Vec3) -> [Facet; 2] {
        let [a, b, c, d] = [-x - y, x - y, x + y, y - x].map(|corner| middle + corner);
        [[a, b, c], [a, c, d]].map(Facet::of)
    }

    #[test]
    fn flat_things_lie_on_planes_of_their_own() {
        let mut facets = Vec::new();
        for at in [0.0, 10.0] {
            let middle = Vec3::splat(at);
            facets.extend(square(middle, Vec3::X, Vec3::Y));
            facets.extend(square(middle + 3.0, Vec3::Y, Vec3::Z));
        }
        let (planes, nearest) = planes_of(&facets, 4);
        assert_eq!(planes.len(), 4);
        for (facet, plane) in facets.iter().zip(nearest) {
            assert!(planes[plane].cost(facet) < ALONG, "{facet:?}");
        }
    }

    #[test]
    fn triangles_without_area_lie_nowhere() {
        let line = Facet::of([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]);
        let (planes, nearest) = planes_of(&[line; 9], 4);
        assert!(planes.is_empty() && nearest.is_empty());
    }

    #[test]
    fn the_plane_through_points_is_that_which_they_lie_on() {
        let (x, y) = (Vec3::new(1.0, 0.0, 2.0), Vec3::new(0.0, 1.0, -1.0));
        let plane = Plane::through(square(Vec3::ONE, x, y).iter()).unwrap();
        let expected = x.cross(y).normalize();
        assert!(plane.normal.dot(expected).abs() > 0.999_99, "{plane:?}");
        assert!(plane.middle.abs_diff_eq(Vec3::ONE, 1e-5));
        assert!(Plane::through([].iter()).is_none());
    }
}
