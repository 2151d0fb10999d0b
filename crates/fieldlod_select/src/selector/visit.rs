//! The walk over the tree: whole nodes and instances where that can be told, the rest left pending.

use std::ops::Range;

use super::Selector;
use super::memory::{Memory, NodeMemory, Pending, State, coarsest_of, record};
use crate::hold::{Hold, Odometer, WholeTest};
use crate::scene::Scene;
use crate::tree::FAN;

/// What a frame asks with.
pub(super) struct Context<'a> {
    pub(super) scene: &'a Scene,
    pub(super) test: WholeTest<'a>,
    pub(super) now: Odometer,
    /// Changes of the scene up to here were taken into account before.
    pub(super) seen_revision: u64,
}

impl Selector {
    pub(super) fn visit(&mut self, context: &Context, level: usize, index: usize) -> NodeMemory {
        let node = &context.scene.tree.levels[level][index];
        let memory = self.nodes[level][index];
        let unchanged = node.changed_at <= context.seen_revision;
        if unchanged && memory.hold.lasts(&context.now) {
            return memory;
        }
        self.statistics.nodes_visited += 1;
        let is_coarsest = unchanged && memory.is_coarsest;
        let memory = match context.test.coarsest(&node.whole, is_coarsest) {
            Some(hold) if is_coarsest => NodeMemory { hold, is_coarsest },
            Some(hold) => return self.settle(context, level, index, hold),
            None => self.visit_below(context, level, index),
        };
        self.nodes[level][index] = memory;
        memory
    }

    fn visit_below(&mut self, context: &Context, level: usize, index: usize) -> NodeMemory {
        let mut all = NodeMemory {
            hold: Hold::forever(&context.now),
            is_coarsest: true,
        };
        for child in children(context.scene, level, index) {
            let one = if level > 0 {
                self.visit(context, level - 1, child)
            } else {
                self.visit_instance(context, context.scene.tree.order[child])
            };
            all.hold = all.hold.and(&one.hold, &context.now);
            all.is_coarsest &= one.is_coarsest;
        }
        all
    }

    fn visit_instance(&mut self, context: &Context, instance: u32) -> NodeMemory {
        let memory = self.memories[instance as usize];
        let is_coarsest = !matches!(memory.state, State::Mixed(_));
        let data = &context.scene.instances[instance as usize];
        let unchanged = data.node.changed_at <= context.seen_revision;
        if unchanged && memory.hold.lasts(&context.now) {
            return NodeMemory {
                hold: memory.hold,
                is_coarsest,
            };
        }
        self.statistics.instances_tested += 1;
        if data.mesh.is_none() {
            let hold = Hold::forever(&context.now);
            return self.settle_instance(context, instance, hold);
        }
        if let Some(hold) = context.test.coarsest(&data.node.whole, is_coarsest) {
            return self.settle_instance(context, instance, hold);
        }
        self.memories[instance as usize].hold = Hold::NONE;
        let slot = match memory.state {
            State::Mixed(slot) => std::mem::take(&mut self.slots[slot as usize]),
            _ => self.spare.pop().unwrap_or_default(),
        };
        let was = memory.state;
        self.pending.push(Pending {
            instance,
            was,
            slot,
        });
        NodeMemory {
            hold: Hold::NONE,
            is_coarsest: false,
        }
    }

    /// Everything below is at its coarsest, as long as `hold` lasts.
    fn settle(&mut self, context: &Context, level: usize, index: usize, hold: Hold) -> NodeMemory {
        for child in children(context.scene, level, index) {
            if level > 0 {
                let changed_at = context.scene.tree.levels[level - 1][child].changed_at;
                let memory = &mut self.nodes[level - 1][child];
                if memory.is_coarsest && changed_at <= context.seen_revision {
                    memory.hold = hold;
                } else {
                    self.settle(context, level - 1, child, hold);
                }
            } else {
                self.settle_instance(context, context.scene.tree.order[child], hold);
            }
        }
        let memory = NodeMemory {
            hold,
            is_coarsest: true,
        };
        self.nodes[level][index] = memory;
        memory
    }

    fn settle_instance(&mut self, context: &Context, instance: u32, hold: Hold) -> NodeMemory {
        let was = self.memories[instance as usize].state;
        let state = match context.scene.meshes[instance as usize] {
            Some(_) => State::Coarsest,
            None => State::Empty,
        };
        self.memories[instance as usize] = Memory { state, hold };
        if was != state {
            let (now, triangles) = coarsest_of(context.scene, instance, state);
            let Self {
                slots,
                changes,
                entered,
                left,
                ..
            } = self;
            let (before, before_triangles) = match was {
                State::Mixed(slot) => {
                    let slot = &slots[slot as usize];
                    (slot.units(), slot.triangle_count())
                }
                other => coarsest_of(context.scene, instance, other),
            };
            record(changes, entered, left, instance, before, now);
            self.triangle_count = self.triangle_count + triangles - before_triangles;
            if let State::Mixed(slot) = was {
                self.spare
                    .push(std::mem::take(&mut self.slots[slot as usize]));
                self.free_slots.push(slot);
            }
        }
        NodeMemory {
            hold,
            is_coarsest: true,
        }
    }
}

fn children(scene: &Scene, level: usize, index: usize) -> Range<usize> {
    let below = match level {
        0 => scene.tree.order.len(),
        _ => scene.tree.levels[level - 1].len(),
    };
    index * FAN..below.min((index + 1) * FAN)
}
