//! Simplification of aggregates: many loose elements, such as leaves, blades and gravel. Their covered area, colours
//! and shading are visible, but no single element.
//!
//! A simplifier with an error metric of distances removes all small elements, and the crown vanishes. Aggregates are
//! simplified in two steps instead:
//!
//! 1. Surfaces are simplified up to an error that depends on the size of the elements.
//! 2. Elements share the remaining triangle budget. Elements with many triangles are simplified as surfaces and regain
//!    their lost area. Elements with few triangles are [flattened and pruned](crate::plants::elements), the least
//!    visible first, and neighbours grow to replace them (R. Cook, J. Halstead, M. Planck and D. Ryu: Stochastic
//!    Simplification of Aggregate Detail, SIGGRAPH 2007).
//!
//! Deviations are distances to the nearest surface, even if it belongs to another element. A guarantee bounds the
//! distance to the nearest leaf; it does not guarantee that each leaf is drawn.

use glam::Vec3;

use crate::levels::simplify::{Simplified, Task};
use crate::mesh::SourceMesh;
use crate::mesh::components::{Component, components_of};
use crate::plants::kits::LooseElements;

/// A group with fewer loose components is not an aggregate. At 3 and 12, plants' errors at equal triangles change by
/// less than 2 %.
const MIN_ELEMENTS: usize = 6;
/// Largest share of a group's triangles in one element. Larger components are surfaces. At 0.1 and 0.4, errors at equal
/// triangles change by about 1 %.
const MAX_ELEMENT_SHARE: f32 = 0.2;
/// If elements have at most this many triangles on average, they are flattened and pruned instead of simplified. At 4,
/// palms have 4 % less error at equal triangles; at 16, 4 % more.
const MAX_TRIANGLES_TO_FLATTEN: usize = 8;
/// A mesh is an aggregate if elements have at least this share of its triangles.
const MIN_SHARE_IN_ELEMENTS: f32 = 0.25;
/// An element that would keep less than this share of its area is restored: rescaling would more than double the rest.
/// At 0.9, palms have 5 % more error at equal triangles; at 0.25, 1 % less.
const MIN_AREA_KEPT: f32 = 0.5;
/// An element that keeps at least this share of its area is not rescaled: parts of a machine must stay in place. At 0.9
/// and 1, palms' errors change by less than 2 %.
const RESCALE_BELOW_AREA: f32 = 0.97;
/// Surfaces between elements keep at least this share of their triangles, even if elements need the whole budget. At
/// 0.25, eight plants have equal errors at equal triangles; at 1, crowns have 15 % more FLIP.
const SURFACE_RATIO: f32 = 0.5;
/// Error limit of surfaces between elements, as a share of the mean radius of the elements. At 0.25, crowns have 15 %
/// more error at equal triangles; at 1, 5 % less, but cards 80 % more.
const SURFACE_TOLERANCE: f32 = 0.5;
/// Error of flattened and pruned elements, as a share of their radius, and the largest error of other elements. At this
/// share, pictures of trees at a given threshold are about as good as pictures of levels without elements.
const ERROR_OF_ELEMENTS: f32 = 0.3;
/// Elements keep at least this share of their triangles, even if surfaces use up the budget.
const MIN_ELEMENT_RATIO: f32 = 0.125;

/// Returns what the loose elements of a mesh are, such as leaves and fronds. `None` if they have few of the triangles.
/// `place` holds the first vertex at each vertex's position.
pub(crate) fn loose_elements(mesh: &SourceMesh, place: &[u32]) -> Option<LooseElements> {
    let mut positions: Vec<[f32; 3]> = mesh.positions.iter().map(Vec3::to_array).collect();
    // Normalize the coordinates: areas of very large or small meshes would overflow or underflow.
    let coordinates = positions.as_flattened_mut();
    let extent = coordinates
        .iter()
        .fold(0.0, |most: f32, at| most.max(at.abs()));
    coordinates
        .iter_mut()
        .for_each(|at| *at /= extent.max(f32::MIN_POSITIVE));
    let is_locked = vec![false; positions.len()];
    let mut components = components_of(&mesh.indices, &positions, place, &is_locked);
    let share = |count: usize| count as f32 / mesh.triangle_count() as f32;
    // Elements without area cover nothing, and cannot be scaled.
    components.retain(|c| share(c.triangles.len()) <= MAX_ELEMENT_SHARE && c.area > 0.0);
    let count = components.iter().map(|c| c.triangles.len()).sum();
    (components.len() >= MIN_ELEMENTS && share(count) >= MIN_SHARE_IN_ELEMENTS)
        .then(|| LooseElements::of(&components, &positions))
}

impl Task<'_> {
    /// Simplifies surfaces and elements to the share `ratio` of the triangles. Returns `None` if the piece is not an
    /// aggregate.
    pub(crate) fn simplify_aggregate(&self, ratio: f32) -> Option<Simplified> {
        let (elements, surfaces) = self.elements_and_surfaces()?;
        let mut simplified = self.unchanged(self.loose);
        let count = triangles_of(&elements);
        let wanted = self.piece.triangle_count() as f32 * ratio;
        // Surfaces get the part of the budget that elements leave over.
        let surface_area = area_of(&surfaces);
        // A limit that depends on the elements: branches may differ by a fraction of a leaf.
        let radius = elements.iter().map(|e| e.radius).sum::<f32>() / elements.len() as f32;
        let corners: Vec<u32> = surfaces.iter().flat_map(Component::corners).collect();
        let surface_ratio = (wanted - count) / triangles_of(&surfaces).max(1.0);
        let (surface, surface_error) = self.simplify_part(
            &mut simplified,
            &corners,
            surface_ratio.clamp(SURFACE_RATIO, 1.0),
            radius * SURFACE_TOLERANCE,
        );
        // Elements get the rest. Surfaces may end above or below their part of the budget.
        let left = (wanted - surface.len() as f32 / 3.0).max(count * MIN_ELEMENT_RATIO);
        let (elements, element_error) = self.simplify_elements(&mut simplified, elements, left);
        let element_area = area_of(&elements);
        // The error is a root mean square over the area, as the simplifier's own error.
        let element_squares = elements.iter().map(|element| {
            let error = (element.radius * ERROR_OF_ELEMENTS).min(element_error);
            element.area * error * error
        });
        let squares = surface_area * surface_error * surface_error + element_squares.sum::<f32>();
        let mean = (squares / (surface_area + element_area).max(f32::MIN_POSITIVE)).sqrt();
        // Larger if a piece of a kit was pruned.
        simplified.error_in_scaled = simplified.error_in_scaled.max(mean);
        let kept = elements.iter().flat_map(Component::corners);
        simplified.corners = surface.into_iter().chain(kept).collect();
        Some(simplified)
    }

    /// Whether the elements are parts of a machine rather than leaves: they have many triangles, and `simplified` keeps
    /// the area.
    pub(crate) fn keeps_parts(&self, simplified: &Simplified) -> bool {
        let area = |corners: &[u32], positions: &[[f32; 3]]| {
            let mut whole = Component {
                triangles: corners.as_chunks().0.to_vec(),
                ..Component::default()
            };
            whole.measure(positions);
            whole.area
        };
        let before = area(&self.piece.corners, &self.piece.positions);
        let after = area(&simplified.corners, &simplified.positions);
        let has_leaves = |(elements, _): (Vec<_>, _)| are_flattened(&elements);
        after >= before * RESCALE_BELOW_AREA
            && !self.elements_and_surfaces().is_some_and(has_leaves)
    }

    /// Splits the piece into elements (small loose components) and surfaces.
    fn elements_and_surfaces(&self) -> Option<(Vec<Component>, Vec<Component>)> {
        let mut components = self.components(&self.piece.corners, &self.piece.positions);
        for component in &mut components {
            let vertices = component.vertices().into_iter();
            component.visible_px = match &self.visible_px {
                Some(pixels) => vertices.map(|own| pixels[own as usize]).sum(),
                None => component.area,
            };
        }
        let most = (self.piece.triangle_count() as f32 * MAX_ELEMENT_SHARE) as usize;
        // Other groups use the vertices of locked components, so these may not move.
        let is_element = |c: &Component| !c.is_locked && c.triangles.len() <= most && c.area > 0.0;
        let (elements, surfaces): (Vec<_>, Vec<_>) = components.into_iter().partition(is_element);
        (elements.len() >= MIN_ELEMENTS).then_some((elements, surfaces))
    }

    /// Simplifies triangles in place. Returns the remaining corners and the error.
    fn simplify_part(
        &self,
        simplified: &mut Simplified,
        corners: &[u32],
        ratio: f32,
        tolerance: f32,
    ) -> (Vec<u32>, f32) {
        if corners.is_empty() {
            return (Vec::new(), 0.0);
        }
        let target = ((corners.len() / 3) as f32 * ratio) as usize * 3;
        let mut error = 0.0;
        simplified.corners = corners.to_vec();
        let count = self.simplify_moving(simplified, target, tolerance, &mut error);
        simplified.corners.truncate(count);
        self.mark_new_vertices(simplified);
        (std::mem::take(&mut simplified.corners), error)
    }

    /// Reduces elements to about `wanted` triangles. Also returns the error of the simplifier; infinite if elements
    /// were flattened and pruned.
    fn simplify_elements(
        &self,
        simplified: &mut Simplified,
        mut elements: Vec<Component>,
        wanted: f32,
    ) -> (Vec<Component>, f32) {
        if triangles_of(&elements) <= wanted {
            return (elements, 0.0);
        }
        // Elements with many triangles are simplified as surfaces.
        if !are_flattened(&elements) {
            let before = triangles_of(&elements);
            let error;
            (elements, error) = self.simplify_as_surfaces(simplified, elements, wanted / before);
            if triangles_of(&elements) <= before * self.config.stuck_ratio {
                return (elements, error);
            }
        }
        // If that makes too little progress, elements are flattened and pruned.
        let elements = self.flatten_and_prune(simplified, elements, wanted);
        (elements, f32::INFINITY)
    }

    /// Simplifies each element, and scales it back to its area. Also returns the error of the simplifier.
    fn simplify_as_surfaces(
        &self,
        simplified: &mut Simplified,
        elements: Vec<Component>,
        ratio: f32,
    ) -> (Vec<Component>, f32) {
        let before = elements.clone();
        let rows = simplified.rows.clone();
        let corners: Vec<u32> = elements.iter().flat_map(Component::corners).collect();
        let (left, error) = self.simplify_part(simplified, &corners, ratio, f32::MAX);
        // Assign the remaining triangles to their elements.
        let mut element_of = vec![0; self.piece.vertices.len()];
        for (index, element) in elements.iter().enumerate() {
            element
                .corners()
                .for_each(|own| element_of[own as usize] = index);
        }
        let mut elements = elements;
        elements
            .iter_mut()
            .for_each(|element| element.triangles.clear());
        // The simplifier never connects two components, so all corners are in one element.
        for triangle in left.as_chunks::<3>().0 {
            elements[element_of[triangle[0] as usize]]
                .triangles
                .push(*triangle);
        }
        for (element, before) in elements.iter_mut().zip(before) {
            element.measure(&simplified.positions);
            if element.area < before.area * MIN_AREA_KEPT {
                self.restore(simplified, &before);
                *element = before;
            } else if element.area < before.area * RESCALE_BELOW_AREA {
                // Moved vertices have interpolated attributes. Their mean must stay, or the colour of the crown drifts
                // with each level.
                let mean = self.mean_row(&rows, &before);
                let area = before.area * self.area_gain;
                self.fit(simplified, element, area, before.centroid, &mean);
            }
        }
        (elements, error)
    }

    /// Undoes the simplification of a component's vertices.
    pub(crate) fn restore(&self, simplified: &mut Simplified, element: &Component) {
        let width = self.vertices.layout.width();
        for own in element.corners().map(|own| own as usize) {
            simplified.positions[own] = self.piece.positions[own];
            let row = self.vertices.row(self.piece.vertices[own]);
            simplified.rows[own * width..][..width].copy_from_slice(row);
            simplified.is_new[own] = false;
        }
    }
}

/// Whether elements have so few triangles that they are flattened and pruned.
fn are_flattened(elements: &[Component]) -> bool {
    triangles_of(elements) <= (elements.len() * MAX_TRIANGLES_TO_FLATTEN) as f32
}

fn triangles_of(components: &[Component]) -> f32 {
    components.iter().map(|c| c.triangles.len()).sum::<usize>() as f32
}

fn area_of(components: &[Component]) -> f32 {
    components.iter().map(|component| component.area).sum()
}
