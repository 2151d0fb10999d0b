//! Aggregates: many loose pieces, such as leaves, blades and gravel, of which the covered area, the
//! colours and the shading are seen, but hardly the single piece.
//!
//! A simplifier that weighs distances makes such elements vanish one by one, and the crown with them.
//! Here surfaces are simplified as far as the size of the elements allows, and elements share what
//! triangles are left: those with many triangles are simplified as surfaces and get the area back that
//! they lose; those with few are [flattened and pruned](crate::plants::elements), those first that are seen
//! least, and others stand for what is gone (R. Cook, J. Halstead, M. Planck and D. Ryu: Stochastic Simplification of
//! Aggregate Detail, SIGGRAPH 2007).
//!
//! Deviations are measured as of any simplification, to the nearest surface, whichever leaf that is: that
//! of an element which is gone to those that are left, and that of one which has grown to the source. So
//! a guarantee says how far away the nearest leaf is drawn, not that each is.

use glam::Vec3;

use crate::levels::simplify::{Method, Simplified, Task};
use crate::mesh::SourceMesh;
use crate::mesh::components::{Component, components_of};

/// Fewer loose pieces are no aggregate.
const FEWEST_ELEMENTS: usize = 6;
/// An element has at most this share of the triangles of its group.
const MOST_OF_GROUP: f32 = 0.2;
/// Elements with no more triangles than this, in the mean, are pruned and not simplified.
const FEW_TRIANGLES: usize = 8;
/// A mesh is an aggregate if at least this share of its triangles is that of elements.
const LEAST_IN_ELEMENTS: f32 = 0.25;
/// An element that keeps less than this share of its area when it is simplified stays as it was.
const LEAST_AREA: f32 = 0.5;
/// One that keeps more gets nothing back: parts of a machine should not leave their places.
const ENOUGH_AREA: f32 = 0.97;
/// A surface between elements keeps at least this share of its triangles.
const SURFACE_RATIO: f32 = 0.5;
/// It may stray by this share of the radius of an element.
const SURFACE_TOLERANCE: f32 = 0.5;
/// The error of pruned elements, as a share of their radius: chosen so that the pictures of trees are about as good at
/// a threshold as those of levels without elements were.
const ERROR_OF_ELEMENTS: f32 = 0.3;
/// Elements keep at least this share of their triangles.
const LEAST_LEFT: f32 = 0.125;

/// Whether many triangles of a mesh are those of several loose pieces, such as leaves and fronds. `place` holds for each
/// vertex the first at its place.
pub(crate) fn is_aggregate(mesh: &SourceMesh, place: &[u32]) -> bool {
    let mut positions: Vec<[f32; 3]> = mesh.positions.iter().map(Vec3::to_array).collect();
    // At any scale areas are numbers.
    let coordinates = positions.as_flattened_mut();
    let extent = coordinates
        .iter()
        .fold(0.0, |most: f32, at| most.max(at.abs()));
    coordinates
        .iter_mut()
        .for_each(|at| *at /= extent.max(f32::MIN_POSITIVE));
    let is_locked = vec![false; positions.len()];
    let components = components_of(&mesh.indices, &positions, place, &is_locked);
    let share = |count: usize| count as f32 / mesh.triangle_count() as f32;
    let is_element = |c: &&Component| share(c.triangles.len()) <= MOST_OF_GROUP && c.area > 0.0;
    let elements = components.iter().filter(is_element);
    let elements: Vec<usize> = elements.map(|c| c.triangles.len()).collect();
    elements.len() >= FEWEST_ELEMENTS && share(elements.iter().sum()) >= LEAST_IN_ELEMENTS
}

impl Task<'_> {
    /// Simplifies surfaces and elements until the share `ratio` of the triangles is left; `None` if this
    /// is no aggregate.
    pub(crate) fn simplify_aggregate(&self, ratio: f32) -> Option<Simplified> {
        let (elements, surfaces) = self.elements_and_surfaces()?;
        let mut simplified = self.unchanged(Method::Elements);
        let count = triangles_of(&elements);
        let wanted = self.piece.triangle_count() as f32 * ratio;
        // Surfaces first, as far as elements alone do not do.
        let surface_area = area_of(&surfaces);
        let radius = elements.iter().map(|e| e.radius).sum::<f32>() / elements.len() as f32;
        let corners: Vec<u32> = surfaces.iter().flat_map(Component::corners).collect();
        let surface_ratio = (wanted - count) / triangles_of(&surfaces).max(1.0);
        let (surface, surface_error) = self.simplify_part(
            &mut simplified,
            &corners,
            surface_ratio.clamp(SURFACE_RATIO, 1.0),
            radius * SURFACE_TOLERANCE,
        );
        // Elements share what is left.
        let left = (wanted - surface.len() as f32 / 3.0).max(count * LEAST_LEFT);
        let elements = self.simplify_elements(&mut simplified, elements, left);
        let element_area = area_of(&elements);
        let squares = elements.iter().map(|e| e.area * e.radius * e.radius);
        let element_square = ERROR_OF_ELEMENTS * ERROR_OF_ELEMENTS * squares.sum::<f32>();
        let squares = surface_area * surface_error * surface_error + element_square;
        simplified.error_in_scaled =
            (squares / (surface_area + element_area).max(f32::MIN_POSITIVE)).sqrt();
        let kept = elements.iter().flat_map(Component::corners);
        simplified.corners = surface.into_iter().chain(kept).collect();
        Some(simplified)
    }

    /// Small loose components, and the others.
    fn elements_and_surfaces(&self) -> Option<(Vec<Component>, Vec<Component>)> {
        let mut components = components_of(
            &self.piece.corners,
            &self.piece.positions,
            &self.same_position,
            &self.is_locked,
        );
        for component in &mut components {
            let seen = component.vertices().into_iter();
            component.seen = match &self.seen {
                Some(pixels) => seen.map(|own| pixels[own as usize]).sum(),
                None => component.area,
            };
        }
        let most = (self.piece.triangle_count() as f32 * MOST_OF_GROUP) as usize;
        let is_element = |c: &Component| !c.is_locked && c.triangles.len() <= most && c.area > 0.0;
        let (elements, surfaces): (Vec<_>, Vec<_>) = components.into_iter().partition(is_element);
        (elements.len() >= FEWEST_ELEMENTS).then_some((elements, surfaces))
    }

    /// Simplifies some triangles in place; returns those that are left, and the error.
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

    /// Leaves about `wanted` triangles of elements.
    fn simplify_elements(
        &self,
        simplified: &mut Simplified,
        mut elements: Vec<Component>,
        wanted: f32,
    ) -> Vec<Component> {
        if triangles_of(&elements) <= wanted {
            return elements;
        }
        // As surfaces, while they have triangles to spare and this gets on.
        if triangles_of(&elements) > (elements.len() * FEW_TRIANGLES) as f32 {
            let before = triangles_of(&elements);
            elements = self.simplify_as_surfaces(simplified, elements, wanted / before);
            if triangles_of(&elements) <= before * self.config.stuck_ratio {
                return elements;
            }
        }
        // Or else flatter and fewer.
        self.thin_out(simplified, elements, wanted)
    }

    /// Simplifies each element, and gives it the area back that it lost.
    fn simplify_as_surfaces(
        &self,
        simplified: &mut Simplified,
        elements: Vec<Component>,
        ratio: f32,
    ) -> Vec<Component> {
        let before = elements.clone();
        let rows = simplified.rows.clone();
        let corners: Vec<u32> = elements.iter().flat_map(Component::corners).collect();
        let (left, _) = self.simplify_part(simplified, &corners, ratio, f32::MAX);
        // The remaining triangles of each element.
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
        for triangle in left.as_chunks::<3>().0 {
            elements[element_of[triangle[0] as usize]]
                .triangles
                .push(*triangle);
        }
        for (element, before) in elements.iter_mut().zip(before) {
            element.measure(&simplified.positions);
            if element.area < before.area * LEAST_AREA {
                self.restore(simplified, &before);
                *element = before;
            } else if element.area < before.area * ENOUGH_AREA {
                let mean = self.mean_row(&rows, &before);
                let area = before.area * self.area_gain;
                self.fit(simplified, element, area, before.centroid, &mean);
            }
        }
        elements
    }

    /// Puts the vertices of an element back.
    fn restore(&self, simplified: &mut Simplified, element: &Component) {
        let width = self.vertices.layout.width();
        for own in element.corners().map(|own| own as usize) {
            simplified.positions[own] = self.piece.positions[own];
            let row = self.vertices.row(self.piece.vertices[own]);
            simplified.rows[own * width..][..width].copy_from_slice(row);
            simplified.is_new[own] = false;
        }
    }
}

fn triangles_of(components: &[Component]) -> f32 {
    components.iter().map(|c| c.triangles.len()).sum::<usize>() as f32
}

fn area_of(components: &[Component]) -> f32 {
    components.iter().map(|component| component.area).sum()
}
