//! Thin layers, such as labels, decals and clothes, that lie just in front of another surface.
//!
//! Levels of a layer and of the surface behind it deviate by more than their distance, so the surface would show
//! through. The bake finds layers in the source. At each level of the whole mesh, it [lifts](lift) them until they are
//! in front again. Meshes that are drawn in units keep their levels: a cut mixes levels, so no lift would fit.

mod lift;

use std::collections::BTreeMap;
use std::ops::Range;

use fieldlod_hierarchy::Aabb;
use glam::Vec3;

use crate::levels::vertices::{LevelVertices, power_of_two_below};
use crate::mesh::SourceMesh;
use crate::mesh::components::connected;
use crate::mesh::surfaces::Surfaces;
use crate::mesh::topology::Topology;
use crate::mesh::triangle_tree::TriangleTree;
use crate::mesh::triangle_tree::triangle::nearest_point;
use crate::plants::aggregate::loose_elements;
use crate::plants::kits::LooseElements;

/// Largest distance of a layer from the surface behind it, as a share of the mesh's radius and of the layer's radius.
/// Farther surfaces are other parts of the object.
const MOST_GAP: f32 = 0.02;
const MOST_GAP_OF_LAYER: f32 = 0.1;
/// A component is a layer if at least this share of its area is in front of other components. At 0.5, panels and screws
/// of two of six game assets are layers.
const LEAST_COVER: f32 = 0.8;
/// Least cosine between the normals of a layer and the surface behind it, and between the normal and the way there.
const LEAST_COSINE: f32 = 0.7;
/// Largest number of triangles at which a component is sampled.
const MOST_SAMPLES: usize = 64;
/// Largest number of layers on each other that are told apart.
const MOST_DEPTH: u32 = 8;

/// The layers of a mesh.
pub(crate) struct Layers {
    /// For each vertex of the source, its component.
    component: Vec<u32>,
    /// Those on other layers come after them.
    pub(crate) layers: Vec<Layer>,
    reach_in_scaled: f32,
}

/// A component in front of others.
pub(crate) struct Layer {
    /// The first vertex of the component.
    pub(crate) component: u32,
    /// The components just behind it, in ascending order.
    pub(crate) behind: Vec<u32>,
    /// Estimated from the sampled triangles.
    twice_area: f32,
    /// Mean distance from the components behind it.
    gap_in_scaled: f32,
}

/// Samples of a component.
#[derive(Default)]
struct Cover {
    area: f32,
    area_in_front: f32,
    /// Sum of area times distance.
    gaps: f32,
    behind: Vec<u32>,
}

impl Layers {
    /// Finds the layers of a mesh with `vertices`. Leaves of plants are no layers.
    pub(crate) fn of(mesh: &SourceMesh, vertices: &LevelVertices) -> Option<Self> {
        let count = mesh.positions.len() as u32;
        let positions: Vec<Vec3> = (0..count).map(|vertex| vertices.position(vertex)).collect();
        let place = &vertices.same_position[..count as usize];
        let found = Self::at(&positions, place, &mesh.indices)?;
        let is_plant = loose_elements(mesh, place) == Some(LooseElements::OfPlant);
        (!is_plant).then_some(found)
    }

    /// Finds the layers of a valid mesh before its bake.
    pub(crate) fn of_joined(mesh: &SourceMesh) -> Option<Self> {
        let place = Topology::of(mesh, &Surfaces::default()).place;
        Self::at(&scaled(mesh), &place, &mesh.indices)
    }

    fn at(positions: &[Vec3], place: &[u32], indices: &[u32]) -> Option<Self> {
        let (triangles, _) = indices.as_chunks::<3>();
        let component = connected(place.to_vec(), triangles);
        let component_of = |triangle: &[u32; 3]| component[triangle[0] as usize];
        let mut of_components: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
        for triangle in triangles {
            let own = of_components.entry(component_of(triangle)).or_default();
            own.push(*triangle);
        }
        if of_components.len() < 2 {
            return None;
        }
        let corners = |triangle: &[u32; 3]| triangle.map(|v| positions[v as usize]);
        let tree = TriangleTree::new(triangles.iter().map(corners));
        let most_reach = radius_of(triangles.iter().flat_map(corners)) * MOST_GAP;
        let layer = |(own, of_component): (u32, Vec<[u32; 3]>)| {
            let radius = radius_of(of_component.iter().flat_map(corners));
            let reach = most_reach.min(radius * MOST_GAP_OF_LAYER);
            let other = |id: u32| {
                let other = component_of(&triangles[id as usize]);
                (other != own).then_some(other)
            };
            let step = of_component.len().div_ceil(MOST_SAMPLES);
            let mut cover = Cover::default();
            for triangle in of_component.iter().step_by(step) {
                cover.add(corners(triangle), &tree, reach, other);
            }
            cover.layer(own, step)
        };
        let mut layers: Vec<Layer> = of_components.into_iter().filter_map(layer).collect();
        sort_by_depth(&mut layers);
        (!layers.is_empty()).then_some(Self {
            layers,
            component,
            reach_in_scaled: most_reach,
        })
    }

    /// The layers with vertices in the range `own` that lie on vertices outside of it, if they have most of the area
    /// there. A few screws on a hull do not make one mesh a layer of another.
    pub(crate) fn mostly_on_others(&self, mesh: &SourceMesh, own: &Range<usize>) -> Vec<&Layer> {
        let is_own = |vertex: u32| own.contains(&(vertex as usize));
        let own_layers = self.layers.iter().filter(|it| is_own(it.component));
        let on_others = own_layers.filter(|it| it.behind.iter().any(|other| !is_own(*other)));
        let on_others: Vec<&Layer> = on_others.collect();
        if on_others.is_empty() {
            return on_others;
        }
        let area: f32 = on_others.iter().map(|layer| layer.twice_area).sum();
        let positions = scaled(mesh);
        let triangles = mesh.indices.as_chunks::<3>().0.iter();
        let areas = triangles
            .filter(|triangle| is_own(triangle[0]))
            .map(|triangle| {
                let [a, b, c] = triangle.map(|v| positions[v as usize]);
                (b - a).cross(c - a).length()
            });
        if area > 0.5 * areas.sum::<f32>() {
            on_others
        } else {
            Vec::new()
        }
    }
}

fn scaled(mesh: &SourceMesh) -> Vec<Vec3> {
    let scaled_from_local = power_of_two_below(&mesh.positions).recip();
    let positions = mesh.positions.iter();
    positions.map(|p| *p * scaled_from_local).collect()
}

/// Half the diagonal of the bounding box.
fn radius_of(points: impl Iterator<Item = Vec3>) -> f32 {
    let aabb = Aabb::around(points).unwrap_or_default();
    0.5 * (aabb.max - aabb.min).length()
}

/// Sorts layers so that those on other layers come after them. The order in a cycle is that of components.
fn sort_by_depth(layers: &mut [Layer]) {
    let mut depth: BTreeMap<u32, u32> = layers.iter().map(|it| (it.component, 0)).collect();
    for _ in 0..MOST_DEPTH {
        for layer in layers.iter() {
            let behind = layer.behind.iter().filter_map(|other| depth.get(other));
            let own = behind.max().map_or(0, |deepest| deepest + 1);
            depth.insert(layer.component, own.min(MOST_DEPTH));
        }
    }
    layers.sort_by_key(|layer| (depth[&layer.component], layer.component));
}

impl Cover {
    /// Adds the centre of a triangle with the nearest triangle just behind it. `other` has the component of a triangle
    /// of the tree, unless it is the own one.
    fn add(
        &mut self,
        [a, b, c]: [Vec3; 3],
        tree: &TriangleTree,
        reach: f32,
        other: impl Fn(u32) -> Option<u32>,
    ) {
        let (middle, cross) = ((a + b + c) / 3.0, (b - a).cross(c - a));
        let normal = cross.normalize_or_zero();
        let mut nearest: Option<(f32, u32)> = None;
        tree.none_within(middle, reach, |id, corners| {
            let [a, b, c] = corners;
            let facing = (b - a).cross(c - a).normalize_or_zero();
            let way = middle - nearest_point(middle, corners);
            let gap = way.length();
            // Coincident surfaces have no order.
            let is_behind = gap > 0.0
                && facing.dot(normal) >= LEAST_COSINE
                && way.dot(facing) >= LEAST_COSINE * gap;
            // Ties by component: the result must not depend on the order of the search.
            if let Some(other) = other(id).filter(|_| is_behind)
                && nearest.is_none_or(|least| (gap, other) < least)
            {
                nearest = Some((gap, other));
            }
            false
        });
        self.area += cross.length();
        if let Some((gap, other)) = nearest {
            self.area_in_front += cross.length();
            self.gaps += cross.length() * gap;
            self.behind.push(other);
        }
    }

    /// The component as a layer if it is one. One in `step` triangles was sampled.
    fn layer(mut self, component: u32, step: usize) -> Option<Layer> {
        self.behind.sort_unstable();
        self.behind.dedup();
        let is_layer = self.area_in_front > 0.0 && self.area_in_front >= self.area * LEAST_COVER;
        is_layer.then_some(Layer {
            component,
            behind: self.behind,
            twice_area: self.area * step as f32,
            gap_in_scaled: self.gaps / self.area_in_front,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(component: u32, behind: &[u32]) -> Layer {
        Layer {
            component,
            behind: behind.to_vec(),
            twice_area: 1.0,
            gap_in_scaled: 0.1,
        }
    }

    #[test]
    fn layers_come_after_those_behind_them() {
        let mut layers = [layer(1, &[5]), layer(5, &[0, 7]), layer(7, &[0])];
        sort_by_depth(&mut layers);
        assert_eq!(layers.map(|layer| layer.component), [7, 5, 1]);
        // Shingles in a ring lie on each other.
        let mut ring = [layer(1, &[2]), layer(2, &[3]), layer(3, &[1])];
        sort_by_depth(&mut ring);
        assert_eq!(ring.len(), 3);
    }
}
