//! Bounds of groups, of eight groups or of 64, eight to an element. The last element is filled with zeros.

use glam::Vec3;
use wide::f32x8;

use crate::criterion::error_bounds::ErrorBounds;
use crate::lanes::V3;
use crate::lanes::bits::LANES;

/// One value of each item, eight to an element.
pub(super) fn lanes_of<T>(items: &[T], elements: usize, value: impl Fn(&T) -> f32) -> Vec<f32x8> {
    let at = |index: usize| items.get(index).map_or(0.0, &value);
    (0..elements)
        .map(|element| f32x8::from(std::array::from_fn(|lane| at(element * LANES + lane))))
        .collect()
}

/// One vector of each item, eight to an element.
pub(super) fn vectors_of<T>(
    items: &[T],
    elements: usize,
    value: impl Fn(&T) -> Vec3,
) -> Vec<V3<f32x8>> {
    let at = |index: usize| items.get(index).map_or(Vec3::ZERO, &value);
    (0..elements)
        .map(|element| V3::from_lanes(|lane| at(element * LANES + lane)))
        .collect()
}

/// Spheres and errors.
#[derive(Clone, Debug)]
pub(crate) struct BoundsLanes {
    pub(crate) center: Vec<V3<f32x8>>,
    pub(crate) radius: Vec<f32x8>,
    /// `e √W` with the largest weight `W` of any direction.
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
}
