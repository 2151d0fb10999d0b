//! A bounding-volume hierarchy over instances: blocks of sixteen along a Morton curve, blocks of
//! sixteen blocks, and so on.
//!
//! No pointers, no rotations: a changed instance touches one node per level, and each node is a plain
//! slot for what a view remembers of it. New instances go to the end, removed ones leave a hole, moved
//! ones stay in their block, and the curve is laid anew when a quarter is out of place. Ray-tracing
//! trees (obvhs) fit tighter, but a selection culls with spheres and margins, and objects move.

use fieldlod_hierarchy::Sphere;
use glam::Vec3;

use crate::hold::Whole;

pub(crate) const FAN: usize = 16;
/// For an instance without a place on the curve.
const NOWHERE: u32 = u32::MAX;
/// Instances that may be out of place in the smallest of scenes.
const FEW: usize = 64;

/// One node: what holds of all instances below.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) whole: Whole,
    /// When an instance below last changed.
    pub(crate) changed_at: u64,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    /// Instances along the curve, removed ones included until it is laid anew.
    pub(crate) order: Vec<u32>,
    place: Vec<u32>,
    /// From the leaves, which hold instances, to the root.
    pub(crate) levels: Vec<Vec<Node>>,
    /// Bounds of the leaves when the curve was laid.
    laid: Vec<Sphere>,
    /// For each place, whether its instance has come, gone or left those bounds since.
    is_out_of_place: Vec<bool>,
    out_of_place: usize,
    dirty: Vec<u32>,
}

impl Tree {
    pub(crate) fn new(items: &[Node]) -> Self {
        let live = morton_keys(items).zip(0..).zip(items);
        let mut keyed: Vec<(u32, u32)> = live
            .filter(|(_, item)| !item.is_empty())
            .map(|(keyed, _)| keyed)
            .collect();
        keyed.sort_unstable();
        let order: Vec<u32> = keyed.into_iter().map(|(_, index)| index).collect();
        let mut place = vec![NOWHERE; items.len()];
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
            laid: levels[0].iter().map(|leaf| leaf.whole.bounds).collect(),
            is_out_of_place: vec![false; order.len()],
            out_of_place: 0,
            dirty: Vec::new(),
            order,
            place,
            levels,
        }
    }

    /// Takes over that `instance` is now `item`: it came, moved or went.
    pub(crate) fn put(&mut self, instance: u32, item: &Node) {
        let position = self.place_of(instance);
        let leaf = position / FAN;
        let center = item.whole.bounds.center;
        let at_home = |laid: &Sphere| laid.center.distance(center) <= laid.radius;
        let strays = item.is_empty() || !self.laid.get(leaf).is_some_and(at_home);
        if strays && !self.is_out_of_place[position] {
            self.is_out_of_place[position] = true;
            self.out_of_place += 1;
        }
        self.dirty.push(leaf as u32);
    }

    fn place_of(&mut self, instance: u32) -> usize {
        let index = instance as usize;
        if index >= self.place.len() {
            self.place.resize(index + 1, NOWHERE);
        }
        if self.place[index] == NOWHERE {
            self.place[index] = self.order.len() as u32;
            self.order.push(instance);
            self.is_out_of_place.push(false);
        }
        self.place[index] as usize
    }

    /// Whether so much is out of place that the curve should be laid anew.
    pub(crate) fn is_worn(&self) -> bool {
        self.out_of_place > self.order.len() / 4 + FEW
    }

    /// Brings the bounds of what was put up to date.
    pub(crate) fn refit(&mut self, item: &impl Fn(u32) -> Node) {
        self.grow();
        let mut dirty = std::mem::take(&mut self.dirty);
        dirty.sort_unstable();
        dirty.dedup();
        for &leaf in &dirty {
            let first = leaf as usize * FAN;
            let end = self.order.len().min(first + FAN);
            let mut members = [Node::EMPTY; FAN];
            for (member, &instance) in members.iter_mut().zip(&self.order[first..end]) {
                *member = item(instance);
            }
            self.levels[0][leaf as usize] = Node::around(&members[..end - first]);
        }
        for level in 1..self.levels.len() {
            dirty.iter_mut().for_each(|index| *index /= FAN as u32);
            dirty.dedup();
            for &index in &dirty {
                let first = index as usize * FAN;
                let end = self.levels[level - 1].len().min(first + FAN);
                let node = Node::around(&self.levels[level - 1][first..end]);
                self.levels[level][index as usize] = node;
            }
        }
        dirty.clear();
        self.dirty = dirty;
    }

    /// Makes nodes for what was appended.
    fn grow(&mut self) {
        let mut count = self.order.len();
        for level in 0.. {
            count = count.div_ceil(FAN);
            if level == self.levels.len() {
                self.levels.push(Vec::new());
            }
            self.levels[level].resize(count, Node::EMPTY);
            if count <= 1 {
                return;
            }
        }
    }
}

impl Node {
    /// What holds of no instance at all.
    pub(crate) const EMPTY: Self = Self {
        whole: Whole {
            bounds: Sphere {
                center: Vec3::ZERO,
                radius: f32::NEG_INFINITY,
            },
            error_weighed: 0.0,
            deviation: 0.0,
        },
        changed_at: 0,
    };

    fn is_empty(&self) -> bool {
        self.whole.bounds.radius == f32::NEG_INFINITY
    }

    fn around(items: &[Self]) -> Self {
        let changed_at = items.iter().map(|i| i.changed_at).max().unwrap_or(0);
        let live = || items.iter().filter(|item| !item.is_empty());
        let boxes = live().map(|item| {
            let Sphere { center, radius } = item.whole.bounds;
            (center - Vec3::splat(radius), center + Vec3::splat(radius))
        });
        let Some((min, max)) = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else {
            return Self {
                changed_at,
                ..Self::EMPTY
            };
        };
        let center = (min + max) * 0.5;
        let largest = |value: &dyn Fn(&Self) -> f32| {
            // NaN must not get lost: it is as good as infinite.
            let or_infinity = |x: f32| if x.is_nan() { f32::INFINITY } else { x };
            live().map(|i| or_infinity(value(i))).fold(0.0, f32::max)
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
            changed_at,
        }
    }
}

/// Ten bits of each coordinate in the box of all centres, interleaved.
fn morton_keys(items: &[Node]) -> impl Iterator<Item = u32> {
    let centers = || {
        items
            .iter()
            .filter(|item| !item.is_empty())
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
