//! Tells the parts of a kit from the elements of a plant.
//!
//! Leaves repeat without order: the nearest leaves have other directions and shapes. A kit has few loose parts, or many
//! with order: studs, shingles, planks or bricks have twins beside them. Whether elements hide each other does not
//! decide: books and shingles hide each other more than leaves. Shares of elements with a twin in the labelled meshes
//! of `fixtures::loose_pieces`:
//!
//! | share | meshes |
//! |---:|---|
//! | 0.98–1 | studs, sockets, shingles, tiles, bricks, crates, cables, windows, feathers, chain |
//! | 0.89 | books |
//! | 0.25–0.33 | gravel, ivy, crossed cards |
//! | 0–0.17 | crowns, hedges, meadows, tufts, palms, leaf litter, rubble |
//!
//! Wrong answers remain for plants of copies in equal directions, such as crossed cards in rows, and for scales on a
//! small ball, which turn too much from one to the next.
//!
//! Both kinds keep their levels of elements: at an eighth of the triangles, plain simplification has 1.4 times the error
//! of elements on kits (0.8 to 5.4) and 1.0 times on plants (0.2 to 3.0). The kinds differ in the stated error, so a
//! wrong answer costs:
//! - A kit as a plant: a fifth of the pixels of shingles are wrong where their error is one pixel, trims of a platform
//!   have 2 to 6 times their area, and studs on a plate of their colour lose three quarters of theirs.
//! - A plant as a kit: pictures do not measure it. Half of some crossed cards are pruned at a radius of 8 px, where 0.92
//!   of the area is left, instead of 4 px.

use glam::{Mat3, Vec3};

use crate::mesh::components::Component;
use crate::plants::curve::Curve;

/// What the loose elements of a mesh are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum LooseElements {
    /// Leaves, blades or gravel: no single element is noticed.
    OfPlant,
    /// Pieces that are seen one by one.
    OfKit,
}

/// Plants have at least this many elements: fewer pieces are seen one by one.
const MIN_ELEMENTS_OF_PLANT: usize = 24;
/// A kit has at least this share of elements with a twin among their neighbours. At 0.4 and 0.8, only a pine of 30 cards
/// changes its kind.
const MIN_SHARE_OF_TWINS: f32 = 0.6;
/// Number of nearest neighbours among which a twin is searched. Among many, leaves have twins by chance.
const NEIGHBOURS: usize = 6;
/// Largest squared difference between twins. Cards whose planes meet at 6° have this difference.
const TWIN_DIFFERENCE: f32 = 0.02;

impl LooseElements {
    pub(crate) fn of(elements: &[Component], positions: &[[f32; 3]]) -> Self {
        let is_plant = elements.len() >= MIN_ELEMENTS_OF_PLANT
            && share_of_twins(elements, positions) < MIN_SHARE_OF_TWINS;
        if is_plant { Self::OfPlant } else { Self::OfKit }
    }
}

/// The share of elements with a neighbour of the same direction and shape.
fn share_of_twins(elements: &[Component], positions: &[[f32; 3]]) -> f32 {
    let poses = elements.iter().map(|element| Pose::of(element, positions));
    let poses: Vec<Pose> = poses.collect();
    let curve = Curve::through(elements);
    let has_twin = |index: &usize| {
        let near = curve.nearest_of(*index, elements, NEIGHBOURS);
        let own = &poses[*index];
        near.iter()
            .any(|&other| own.difference(&poses[other]) <= TWIN_DIFFERENCE)
    };
    let twins = (0..elements.len()).filter(has_twin).count();
    twins as f32 / elements.len() as f32
}

/// Direction and shape of an element, regardless of its place and size.
struct Pose {
    /// Mean of the squared normals of its triangles, and of the squared distances of its points from the centroid. Each is
    /// a symmetric matrix of trace 1.
    squared_normals: Mat3,
    squared_offsets: Mat3,
}

impl Pose {
    fn of(element: &Component, positions: &[[f32; 3]]) -> Self {
        let [mut normals, mut offsets] = [Mat3::ZERO; 2];
        for triangle in &element.triangles {
            let corner = |own: u32| Vec3::from(positions[own as usize]) - element.centroid;
            let [a, b, c] = triangle.map(corner);
            let area_vector = (b - a).cross(c - a);
            let area = area_vector.length();
            normals += squared(area_vector) * area.max(f32::MIN_POSITIVE).recip();
            // The integral over the triangle, up to a factor that the trace removes.
            offsets += (squared(a) + squared(b) + squared(c) + squared(a + b + c)) * area;
        }
        Self {
            squared_normals: with_unit_trace(normals),
            squared_offsets: with_unit_trace(offsets),
        }
    }

    fn difference(&self, other: &Self) -> f32 {
        let square = |difference: Mat3| {
            let columns = difference.to_cols_array_2d().map(Vec3::from);
            columns.map(Vec3::length_squared).iter().sum::<f32>()
        };
        square(self.squared_normals - other.squared_normals)
            + square(self.squared_offsets - other.squared_offsets)
    }
}

/// The matrix of the products of the coordinates.
fn squared(v: Vec3) -> Mat3 {
    Mat3::from_cols(v * v.x, v * v.y, v * v.z)
}

fn with_unit_trace(matrix: Mat3) -> Mat3 {
    let trace = matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z;
    matrix * trace.max(f32::MIN_POSITIVE).recip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;
    use crate::mesh::surfaces::Surfaces;
    use crate::mesh::topology::Topology;
    use crate::plants::aggregate::loose_elements;

    /// Plants of copies in equal directions or of few elements, and a kit whose pieces turn from one to the next.
    const EXCEPTIONS: [&str; 5] = [
        "scales",
        "palm of 12",
        "pine of cards",
        "crossed cards in rows",
        "islands",
    ];

    #[test]
    fn kits_and_plants_are_told_apart() {
        for seed in 1..4 {
            for pieces in fixtures::loose_pieces(seed) {
                let mesh = &pieces.mesh;
                let topology = Topology::of(mesh, &Surfaces::of([mesh]));
                let found = loose_elements(mesh, &topology.place);
                let expected = if pieces.is_plant {
                    LooseElements::OfPlant
                } else {
                    LooseElements::OfKit
                };
                if !EXCEPTIONS.contains(&pieces.name) {
                    assert_eq!(found, Some(expected), "{}", pieces.name);
                }
            }
        }
    }
}
