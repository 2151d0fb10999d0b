//! A bounding-volume hierarchy over instances: blocks of sixteen along a Morton curve, blocks of
//! sixteen blocks, and so on.
//!
//! No pointers, no rotations: a changed instance touches one node per level, and each node is a plain
//! place for what a view remembers of it. New instances go to the end, removed ones leave a hole, moved
//! ones stay in their block, and the tree is built anew when a quarter is out of bounds. Ray-tracing
//! trees (obvhs) fit tighter, but a selection culls with spheres and margins, and objects move.

use fieldlod_hierarchy::Sphere;
use glam::Vec3;

use crate::boxes::AxisBox;
use crate::error_bounds::ErrorBounds;

pub(crate) const FAN: usize = 16;
/// For an instance without a position on the curve.
const NOWHERE: u32 = u32::MAX;
/// Instances that may be out of bounds in the smallest of scenes.
const FEW: usize = 64;

/// What bounds all instances below a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) bounds: ErrorBounds,
    /// The largest radius of an instance below whose mesh can hide others; 0 if none can.
    pub(crate) occluder_radius: f32,
    /// Around the surfaces of all instances below.
    pub(crate) surface_box: AxisBox,
    /// The smallest and the largest radius on screen of an instance below: that of its vertices, times its
    /// bias.
    pub(crate) radii: [f32; 2],
    /// The layers that any instance below is on.
    pub(crate) layers: u64,
    /// Whether the level of an instance below is forced.
    pub(crate) is_forced: bool,
    /// When an instance below last changed.
    pub(crate) changed_at: u64,
    /// The tallies of all instances below.
    pub(crate) tally: Tally,
}

/// What is counted of instances: sums over those that have been given numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Sums of the [numbers](crate::Scene::set_numbers) of instances.
    pub sums: [u64; 3],
    /// How many instances have none.
    pub without_numbers: u32,
}

impl Tally {
    /// The tally of one instance.
    pub(crate) fn of(numbers: Option<[u32; 3]>) -> Self {
        Self {
            sums: numbers.unwrap_or_default().map(u64::from),
            without_numbers: u32::from(numbers.is_none()),
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        for (sum, number) in self.sums.iter_mut().zip(other.sums) {
            *sum += number;
        }
        self.without_numbers += other.without_numbers;
    }

    fn subtract(&mut self, other: &Self) {
        for (sum, number) in self.sums.iter_mut().zip(other.sums) {
            *sum -= number;
        }
        self.without_numbers -= other.without_numbers;
    }
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    /// Instances along the curve, removed ones included until the tree is built anew.
    pub(crate) order: Vec<u32>,
    /// By instance, its position along the curve.
    position: Vec<u32>,
    /// From the leaves, which hold instances, to the root.
    pub(crate) levels: Vec<Vec<Node>>,
    /// Bounds of the leaves when the tree was built.
    built_bounds: Vec<Sphere>,
    /// By position, whether its instance has come, gone or left those bounds since.
    is_out_of_bounds: Vec<bool>,
    out_of_bounds_count: usize,
    /// Leaves whose bounds are not up to date.
    dirty: Vec<u32>,
}

impl Tree {
    pub(crate) fn new(items: &[Node]) -> Self {
        // The live instances along the curve.
        let live = morton_keys(items).zip(0..).zip(items);
        let mut keyed: Vec<(u32, u32)> = live
            .filter(|(_, item)| !item.bounds.is_empty())
            .map(|(keyed, _)| keyed)
            .collect();
        keyed.sort_unstable();
        let order: Vec<u32> = keyed.into_iter().map(|(_, index)| index).collect();
        let mut positions = vec![NOWHERE; items.len()];
        for (position, &index) in order.iter().enumerate() {
            positions[index as usize] = position as u32;
        }
        // The levels above them, each a sixteenth of the one before.
        let sorted: Vec<Node> = order.iter().map(|&index| items[index as usize]).collect();
        let mut levels = Vec::new();
        let mut below = &sorted;
        while below.len() > 1 || levels.is_empty() {
            levels.push(below.chunks(FAN).map(Node::around).collect::<Vec<_>>());
            below = &levels[levels.len() - 1];
        }
        Self {
            built_bounds: levels[0].iter().map(|leaf| leaf.bounds.sphere).collect(),
            is_out_of_bounds: vec![false; order.len()],
            out_of_bounds_count: 0,
            dirty: Vec::new(),
            order,
            position: positions,
            levels,
        }
    }

    /// Notes that `instance` is now `item`: it came, moved or went.
    pub(crate) fn put(&mut self, instance: u32, item: &Node) {
        let position = self.position_of(instance);
        let leaf = position / FAN;
        let center = item.bounds.sphere.center;
        let is_within = |built: &Sphere| built.center.distance(center) <= built.radius;
        let is_in_bounds =
            !item.bounds.is_empty() && self.built_bounds.get(leaf).is_some_and(is_within);
        if !is_in_bounds && !self.is_out_of_bounds[position] {
            self.is_out_of_bounds[position] = true;
            self.out_of_bounds_count += 1;
        }
        self.dirty.push(leaf as u32);
    }

    /// The position of an instance along the curve; a new one comes to the end.
    fn position_of(&mut self, instance: u32) -> usize {
        let index = instance as usize;
        if index >= self.position.len() {
            self.position.resize(index + 1, NOWHERE);
        }
        if self.position[index] == NOWHERE {
            self.position[index] = self.order.len() as u32;
            self.order.push(instance);
            self.is_out_of_bounds.push(false);
        }
        self.position[index] as usize
    }

    /// The position of an instance along the curve, if it was put there.
    pub(crate) fn position(&self, instance: u32) -> Option<usize> {
        let position = *self.position.get(instance as usize)?;
        (position != NOWHERE).then_some(position as usize)
    }

    /// Lets the nodes above an instance count another tally of it. Their bounds are up to date.
    pub(crate) fn replace_tally(&mut self, instance: u32, was: &Tally, now: &Tally) {
        let Some(mut index) = self.position(instance) else {
            return;
        };
        for level in &mut self.levels {
            index /= FAN;
            let tally = &mut level[index].tally;
            tally.subtract(was);
            tally.add(now);
        }
    }

    /// Whether so much is out of bounds that the tree should be built anew.
    pub(crate) fn needs_rebuild(&self) -> bool {
        self.out_of_bounds_count > self.order.len() / 4 + FEW
    }

    /// Brings the bounds of what was put up to date.
    pub(crate) fn refit(&mut self, item: &impl Fn(u32) -> Node) {
        self.grow();
        // The leaves, then the nodes above them level by level.
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
        // Sixteen children have one parent.
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
    /// The node of no instance at all.
    pub(crate) const EMPTY: Self = Self {
        bounds: ErrorBounds::EMPTY,
        occluder_radius: 0.0,
        surface_box: AxisBox::EMPTY,
        radii: [f32::INFINITY, 0.0],
        layers: 0,
        is_forced: false,
        changed_at: 0,
        tally: Tally {
            sums: [0; 3],
            without_numbers: 0,
        },
    };

    fn around(nodes: &[Self]) -> Self {
        let bounds = nodes.iter().map(|node| node.bounds);
        Self {
            bounds: ErrorBounds::around(bounds).unwrap_or(ErrorBounds::EMPTY),
            occluder_radius: nodes
                .iter()
                .fold(0.0, |most, node| most.max(node.occluder_radius)),
            surface_box: nodes
                .iter()
                .fold(AxisBox::EMPTY, |all, node| all.and(&node.surface_box)),
            radii: nodes.iter().fold(Self::EMPTY.radii, |[min, max], node| {
                [min.min(node.radii[0]), max.max(node.radii[1])]
            }),
            layers: nodes.iter().fold(0, |all, node| all | node.layers),
            is_forced: nodes.iter().any(|node| node.is_forced),
            changed_at: nodes.iter().map(|n| n.changed_at).max().unwrap_or(0),
            tally: nodes.iter().fold(Tally::default(), |mut all, node| {
                all.add(&node.tally);
                all
            }),
        }
    }
}

/// Ten bits of each coordinate in the box of all centres, interleaved.
fn morton_keys(items: &[Node]) -> impl Iterator<Item = u32> {
    let centers = || {
        items
            .iter()
            .filter(|item| !item.bounds.is_empty())
            .map(|item| item.bounds.sphere.center)
            .filter(|c| c.is_finite())
    };
    // Cells of the box, 1024 along its longest side.
    let min = centers().fold(Vec3::splat(f32::MAX), Vec3::min);
    let max = centers().fold(Vec3::splat(f32::MIN), Vec3::max);
    let extent = (max - min).max_element().max(f32::MIN_POSITIVE);
    items.iter().map(move |item| {
        let cell = (item.bounds.sphere.center - min) * (1023.0 / extent);
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
