//! A bounding-volume hierarchy over instances: blocks of sixteen along a Morton curve, blocks of
//! sixteen blocks, and so on.
//!
//! No pointers, no rotations: refitting a moved instance touches one node per level, and each node is
//! a plain slot for what a view remembers of it. Ray-tracing trees (obvhs) fit tighter, but a
//! selection culls with spheres and margins, and objects move.

use fieldlod_hierarchy::Sphere;
use glam::Vec3;

use crate::hold::Whole;

pub(crate) const FAN: usize = 16;

/// One node: what holds of all instances below.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Node {
    pub(crate) whole: Whole,
    /// When an instance below last changed.
    pub(crate) changed_at: u64,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    /// Instances along the curve.
    pub(crate) order: Vec<u32>,
    place: Vec<u32>,
    /// From the leaves, which hold instances, to the root.
    pub(crate) levels: Vec<Vec<Node>>,
}

impl Tree {
    pub(crate) fn new(items: &[Node]) -> Self {
        let mut keyed: Vec<(u32, u32)> = morton_keys(items).zip(0..).collect();
        keyed.sort_unstable();
        let order: Vec<u32> = keyed.into_iter().map(|(_, index)| index).collect();
        let mut place = vec![0; order.len()];
        for (position, &index) in order.iter().enumerate() {
            place[index as usize] = position as u32;
        }
        let sorted: Vec<Node> = order.iter().map(|&index| items[index as usize]).collect();
        let mut levels = Vec::new();
        let mut below = &sorted;
        while below.len() > 1 || levels.is_empty() {
            levels.push(below.chunks(FAN).map(Node::around).collect::<Vec<_>>());
            below = &levels[levels.len() - 1];
        }
        Self {
            order,
            place,
            levels,
        }
    }

    /// Takes over the change of one instance.
    pub(crate) fn refit(&mut self, instance: u32, item: &impl Fn(u32) -> Node) {
        let mut index = self.place[instance as usize] as usize / FAN;
        let leaf = self.order.chunks(FAN).nth(index).unwrap_or_default();
        let mut members = [Node::default(); FAN];
        for (member, &instance) in members.iter_mut().zip(leaf) {
            *member = item(instance);
        }
        let mut node = Node::around(&members[..leaf.len()]);
        for level in 0..self.levels.len() {
            self.levels[level][index] = node;
            let first = index / FAN * FAN;
            let end = self.levels[level].len().min(first + FAN);
            node = Node::around(&self.levels[level][first..end]);
            index /= FAN;
        }
    }
}

impl Node {
    fn around(items: &[Self]) -> Self {
        let boxes = items.iter().map(|item| {
            let Sphere { center, radius } = item.whole.bounds;
            (center - Vec3::splat(radius), center + Vec3::splat(radius))
        });
        let (min, max) = boxes
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
            .unwrap_or_default();
        let center = (min + max) * 0.5;
        let largest = |value: &dyn Fn(&Self) -> f32| {
            // NaN must not get lost: it is as good as infinite.
            let or_infinity = |x: f32| if x.is_nan() { f32::INFINITY } else { x };
            items
                .iter()
                .map(|i| or_infinity(value(i)))
                .fold(0.0, f32::max)
        };
        Self {
            whole: Whole {
                bounds: Sphere {
                    center,
                    radius: largest(&|i| {
                        i.whole.bounds.center.distance(center) + i.whole.bounds.radius
                    }) * 1.0001,
                },
                error_weighed: largest(&|i| i.whole.error_weighed),
                deviation: largest(&|i| i.whole.deviation),
            },
            changed_at: items.iter().map(|i| i.changed_at).max().unwrap_or(0),
        }
    }
}

/// Ten bits of each coordinate in the box of all centres, interleaved.
fn morton_keys(items: &[Node]) -> impl Iterator<Item = u32> {
    let centers = || {
        items
            .iter()
            .map(|item| item.whole.bounds.center)
            .filter(|c| c.is_finite())
    };
    let min = centers().fold(Vec3::splat(f32::MAX), Vec3::min);
    let max = centers().fold(Vec3::splat(f32::MIN), Vec3::max);
    let extent = (max - min).max_element().max(f32::MIN_POSITIVE);
    items.iter().map(move |item| {
        let cell = (item.whole.bounds.center - min) * (1023.0 / extent);
        // Casts saturate, and take NaN to 0.
        spread(cell.x as u32) | spread(cell.y as u32) << 1 | spread(cell.z as u32) << 2
    })
}

/// Puts two zero bits before each of the lowest ten.
fn spread(x: u32) -> u32 {
    let x = x.min(1023);
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}
