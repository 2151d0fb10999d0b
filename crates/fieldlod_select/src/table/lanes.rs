//! Bounds and facings of groups, of eight groups or of 64, eight to an element. What is missing to a
//! full element is all zero.

use fieldlod_hierarchy::Group;
use glam::Vec3;
use wide::f32x8;

use crate::bits::LANES;
use crate::criterion::normal_variance;
use crate::error_bounds::{ErrorBounds, or_infinity, simplified};
use crate::lane::V3;

/// One value of each item, eight to an element.
pub(super) fn lanes_of<T>(items: &[T], elements: usize, value: impl Fn(&T) -> f32) -> Vec<f32x8> {
    let at = |index: usize| items.get(index).map_or(0.0, &value);
    (0..elements)
        .map(|element| f32x8::from(std::array::from_fn(|lane| at(element * LANES + lane))))
        .collect()
}

/// One vector of each item, eight to an element.
fn vectors_of<T>(items: &[T], elements: usize, value: impl Fn(&T) -> Vec3) -> Vec<V3<f32x8>> {
    let [x, y, z] = std::array::from_fn(|axis| lanes_of(items, elements, |item| value(item)[axis]));
    (0..elements)
        .map(|element| V3 {
            x: x[element],
            y: y[element],
            z: z[element],
        })
        .collect()
}

/// Spheres and errors.
#[derive(Clone, Debug)]
pub(crate) struct BoundsLanes {
    center: Vec<V3<f32x8>>,
    pub(crate) radius: Vec<f32x8>,
    /// `e √W` with the greatest weight `W` that any direction gives.
    pub(crate) error_weighed: Vec<f32x8>,
    pub(crate) deviation: Vec<f32x8>,
}

impl BoundsLanes {
    pub(super) fn new(items: impl Iterator<Item = ErrorBounds>, elements: usize) -> Self {
        let items: Vec<ErrorBounds> = items.collect();
        Self {
            center: vectors_of(&items, elements, |item| item.sphere.center),
            radius: lanes_of(&items, elements, |item| item.sphere.radius),
            error_weighed: lanes_of(&items, elements, |item| item.error_weighed),
            deviation: lanes_of(&items, elements, |item| item.deviation),
        }
    }

    #[inline]
    pub(crate) fn center(&self, element: usize) -> V3<f32x8> {
        self.center[element]
    }
}

/// How surfaces face: what bounds the weight `W` of all groups in a bound.
#[derive(Clone, Debug)]
pub(crate) struct FacingLanes {
    pub(crate) error: Vec<f32x8>,
    normal: Vec<V3<f32x8>>,
    /// At least `½ √v + 0.1` and by how much mean normals differ from `normal`: a quarter of `W` is at
    /// most `max(normal·s, 0)` more.
    pub(crate) edge_on_weight: Vec<f32x8>,
}

/// How the groups of one bound face.
struct Facing {
    error: f32,
    normal: Vec3,
    edge_on_weight: f32,
}

impl FacingLanes {
    /// One facing for each `size` groups; `elements` of eight.
    pub(super) fn new(groups: &[Group], size: usize, elements: usize) -> Self {
        let items: Vec<Facing> = groups.chunks(size).map(Facing::of).collect();
        Self {
            error: lanes_of(&items, elements, |item| item.error),
            normal: vectors_of(&items, elements, |item| item.normal),
            edge_on_weight: lanes_of(&items, elements, |item| item.edge_on_weight),
        }
    }

    #[inline]
    pub(crate) fn normal(&self, element: usize) -> V3<f32x8> {
        self.normal[element]
    }
}

impl Facing {
    fn of(groups: &[Group]) -> Self {
        let largest = |value: &dyn Fn(&Group) -> f32| {
            let values = groups.iter().map(|group| or_infinity(value(group)));
            values.fold(0.0, f32::max)
        };
        let sum: Vec3 = groups.iter().map(|group| group.mean_normal).sum();
        let normal = sum / groups.len() as f32;
        let edge_on_weight = |group: &Group| {
            let own = 0.5 * normal_variance(group.mean_normal).sqrt() + 0.101;
            own + group.mean_normal.distance(normal)
        };
        Self {
            error: largest(&|group| simplified(group, group.error_in_local)),
            normal,
            edge_on_weight: largest(&edge_on_weight),
        }
    }
}
