//! The area of leaves, cloths and other thin pieces, on the way to a dozen triangles.
//!
//! Each corner that is cut off takes area away, and vertices are never moved, so that nothing gives
//! it back: leaves get thin with distance. Where a step costs too much area, it is tried once more
//! with the shape alone, without regard to normals and texture coordinates apart from seams.
//!
//! Measured as pixels covered in 13 orthographic views, a frond of a palm tree (252 triangles, a
//! thin closed body) keeps 99 and 94 % of its coverage at 126 and 62 triangles instead of 95 and
//! 83 %, at a quarter of the deviation; 63 instead of 66 % at 30, 37 instead of 30 % at 14, and 6
//! instead of 23 % at the last half dozen. A cloth of 115,000 triangles keeps 99 % at 896 and 90 %
//! at 55 triangles with or without, and 77 instead of 65 % at the last half dozen. Surfaces that
//! come through each other are not taken.
//!
//! Not done: enlarging what is left when islands vanish. A ball of 10,000 separate leaves of two
//! triangles covers 73, 45 and 26 % at a half, a quarter and an eighth of its triangles. To give
//! that back, levels would need vertices of their own, and their renderers another vertex buffer.
//! Their deviation, 0.3 of the radius at the first step, says that they have thinned out.

use glam::{DVec3, Vec3};

use crate::input::SimplifierInput;
use crate::simplify::{Simplified, Simplifier, SimplifyMode};

/// A step that keeps this share of the area is good enough.
const AREA_KEPT: f64 = 0.98;
/// What another way must gain at least, as a share of the area before.
const WORTH_IT: f64 = 0.01;

/// Most of a surface that may have turned over, as a share of its area.
const MOST_TURNED: f64 = 0.002;

/// `careful`, which came of `corners`, or what keeps more of their area.
pub(super) fn keep_area(
    simplifier: &Simplifier<'_>,
    corners: &[u32],
    target: usize,
    careful: Simplified,
) -> Simplified {
    let input = simplifier.input;
    let before = area_of(input, corners);
    let kept = area_of(input, &careful.corners);
    if input.weights.is_empty() || kept >= before * AREA_KEPT {
        return careful;
    }
    let shape = simplifier.simplify(corners, &input.locks, target, SimplifyMode::ShapeOnly);
    let gained = area_of(input, &shape.corners) - kept;
    let coarser = shape.corners.len() <= careful.corners.len();
    if gained >= before * WORTH_IT && coarser && !turns_over(input, &shape.corners) {
        shape
    } else {
        careful
    }
}

/// Whether some of a surface faces against the normals at all its corners, as the back of a leaf
/// does that has come through its front. Taken as so where there are no normals to tell.
fn turns_over(input: &SimplifierInput, corners: &[u32]) -> bool {
    let (triangles, _) = corners.as_chunks::<3>();
    let (mut turned, mut whole) = (0.0, 0.0);
    for &triangle in triangles {
        let Some(normals) = normals_at(input, triangle) else {
            return true;
        };
        let area_vector = area_vector(input, triangle);
        whole += area_vector.length();
        if normals.iter().all(|normal| normal.dot(area_vector) < 0.0) {
            turned += area_vector.length();
        }
    }
    turned > whole * MOST_TURNED
}

fn normals_at(input: &SimplifierInput, triangle: [u32; 3]) -> Option<[DVec3; 3]> {
    let count = input.weights.len();
    let normal = |vertex: u32| Vec3::from_slice(&input.attributes[vertex as usize * count..]);
    (count >= 3).then(|| triangle.map(|vertex| normal(vertex).as_dvec3()))
}

/// Twice as long as the triangle has area, scaled.
fn area_vector(input: &SimplifierInput, triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|v| Vec3::from(input.positions[v as usize]).as_dvec3());
    (b - a).cross(c - a)
}

/// Twice the area, scaled.
fn area_of(input: &SimplifierInput, corners: &[u32]) -> f64 {
    let (triangles, _) = corners.as_chunks::<3>();
    let triangles = triangles.iter();
    let areas = triangles.map(|&triangle| area_vector(input, triangle).length());
    areas.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BakeConfig, fixtures};

    #[test]
    fn another_way_is_taken_only_if_it_keeps_more() {
        let config = BakeConfig::default();
        let mut taken = 0;
        for mesh in [
            fixtures::rock(2, 5),
            fixtures::icosphere(2),
            fixtures::torus_knot(40, 5),
            fixtures::height_field(12),
        ] {
            let input = SimplifierInput::of(&mesh, &config);
            let simplifier = Simplifier::new(&input, &config);
            let mut corners = mesh.indices.clone();
            for _ in 0..4 {
                let target = corners.len() / 6 * 3;
                let careful =
                    || simplifier.simplify(&corners, &input.locks, target, SimplifyMode::Careful);
                let before = careful();
                let after = keep_area(&simplifier, &corners, target, careful());
                let gained = area_of(&input, &after.corners) - area_of(&input, &before.corners);
                assert!(gained >= 0.0 && after.corners.len() <= before.corners.len());
                taken += usize::from(gained > 0.0);
                corners = after.corners;
            }
        }
        assert!(taken > 0, "nothing was tried");
    }
}
