//! Spheres and errors of groups, of eight groups, of 64: what the conservative tests read.

use fieldlod_hierarchy::{Group, Sphere};
use glam::Vec3;
use wide::f32x8;

use super::{error_weighed, normal_variance, of_simplified};
use crate::hold::Whole;

/// Structures of arrays, eight to an element; what is missing to a full one is all zero.
#[derive(Clone, Debug)]
pub(crate) struct Bounds {
    pub(crate) x: Vec<f32x8>,
    pub(crate) y: Vec<f32x8>,
    pub(crate) z: Vec<f32x8>,
    pub(crate) radius: Vec<f32x8>,
    /// `e √W` with the greatest weight W that any direction gives.
    pub(crate) error_weighed: Vec<f32x8>,
    pub(crate) deviation: Vec<f32x8>,
}

impl Bounds {
    pub(super) fn new(items: impl Iterator<Item = Whole>, elements: usize) -> Self {
        let items: Vec<Whole> = items.collect();
        let lanes = |value: &dyn Fn(&Whole) -> f32| -> Vec<f32x8> {
            let at = |index: usize| items.get(index).map_or(0.0, value);
            (0..elements)
                .map(|element| f32x8::from(std::array::from_fn(|lane| at(element * 8 + lane))))
                .collect()
        };
        Self {
            x: lanes(&|item| item.bounds.center.x),
            y: lanes(&|item| item.bounds.center.y),
            z: lanes(&|item| item.bounds.center.z),
            radius: lanes(&|item| item.bounds.radius),
            error_weighed: lanes(&|item| item.error_weighed),
            deviation: lanes(&|item| item.deviation),
        }
    }
}

/// A group by itself.
pub(super) fn of_one(group: &Group) -> Whole {
    Whole {
        bounds: group.bounds,
        error_weighed: error_weighed(group),
        deviation: of_simplified(group, group.deviation_in_local),
    }
}

/// A sphere around the spheres of groups, and the largest errors of those that are not terminal. NaN
/// counts as infinite.
pub(super) fn around(groups: &[Group]) -> Whole {
    let largest = |value: &dyn Fn(&Group) -> f32| {
        let or_infinity = |x: f32| if x.is_nan() { f32::INFINITY } else { x };
        groups
            .iter()
            .map(|g| or_infinity(value(g)))
            .fold(0.0, f32::max)
    };
    let corners = groups.iter().flat_map(|group| {
        let Sphere { center, radius } = group.bounds;
        [center - Vec3::splat(radius), center + Vec3::splat(radius)]
    });
    let center = Sphere::around(corners).center;
    Whole {
        bounds: Sphere {
            center,
            radius: largest(&|g| g.bounds.center.distance(center) + g.bounds.radius) * 1.0001,
        },
        error_weighed: largest(&error_weighed),
        deviation: largest(&|g| of_simplified(g, g.deviation_in_local)),
    }
}

/// How surfaces face: what bounds the weight W of all groups in a bound.
#[derive(Clone, Debug)]
pub(crate) struct Facings {
    pub(crate) error: Vec<f32x8>,
    pub(crate) normal: [Vec<f32x8>; 3],
    /// At least `½ √v + 0.1` and by how much mean normals differ from `normal`: a quarter of W is at
    /// most `max(normal·s, 0)` more.
    pub(crate) edge_on_weight: Vec<f32x8>,
}

#[derive(Clone, Copy, Default)]
struct Facing {
    error: f32,
    normal: Vec3,
    edge_on_weight: f32,
}

impl Facings {
    /// One for each `size` groups; `elements` of eight.
    pub(super) fn new(groups: &[Group], size: usize, elements: usize) -> Self {
        let items: Vec<Facing> = groups.chunks(size).map(Facing::around).collect();
        let lanes = |value: &dyn Fn(&Facing) -> f32| -> Vec<f32x8> {
            let at = |index: usize| items.get(index).map_or(0.0, value);
            (0..elements)
                .map(|element| f32x8::from(std::array::from_fn(|lane| at(element * 8 + lane))))
                .collect()
        };
        Self {
            error: lanes(&|item| item.error),
            normal: [
                lanes(&|item| item.normal.x),
                lanes(&|item| item.normal.y),
                lanes(&|item| item.normal.z),
            ],
            edge_on_weight: lanes(&|item| item.edge_on_weight),
        }
    }
}

impl Facing {
    fn around(groups: &[Group]) -> Self {
        let or_infinity = |x: f32| if x.is_nan() { f32::INFINITY } else { x };
        let largest = |value: &dyn Fn(&Group) -> f32| {
            let values = groups.iter().map(|group| or_infinity(value(group)));
            values.fold(0.0, f32::max)
        };
        let sum: Vec3 = groups.iter().map(|group| group.mean_normal).sum();
        let normal = sum / groups.len() as f32;
        let weight = |group: &Group| {
            let own = 0.5 * normal_variance(group.mean_normal).sqrt() + 0.101;
            own + group.mean_normal.distance(normal)
        };
        Self {
            error: largest(&|group| of_simplified(group, group.error_in_local)),
            normal,
            edge_on_weight: largest(&weight),
        }
    }
}
