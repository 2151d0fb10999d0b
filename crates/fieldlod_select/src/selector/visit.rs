//! The walk over the tree: whole nodes and instances where that can be told, the rest left pending.

use std::ops::Range;

use super::Selector;
use super::memory::{NodeMemory, Pending, State, coarsest_of};
use crate::InstanceId;
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
        self.welcome(context, instance);
        let memory = self.memories[instance as usize];
        let is_coarsest = !matches!(memory.state, State::Mixed(_));
        let data = &context.scene.instances[instance as usize];
        let unchanged = data.node.changed_at <= context.seen_revision;
        let hold = self.holds[instance as usize];
        if unchanged && hold.lasts(&context.now) {
            return NodeMemory { hold, is_coarsest };
        }
        self.statistics.instances_tested += 1;
        let Some(mesh) = context.scene.occupants[instance as usize].mesh else {
            let hold = Hold::forever(&context.now);
            self.holds[instance as usize] = hold;
            return self.settle_instance(context, instance, hold);
        };
        if let Some(hold) = context.test.coarsest(&data.node.whole, is_coarsest) {
            self.holds[instance as usize] = hold;
            return self.settle_instance(context, instance, hold);
        }
        self.holds[instance as usize] = Hold::NONE;
        let slot = match memory.state {
            State::Mixed(slot) => std::mem::take(&mut self.slots[slot as usize]),
            _ => self.pool.take(context.scene.table(mesh)),
        };
        self.pending.push(Pending {
            instance,
            was: memory.state,
            has_moved: !unchanged,
            slot,
        });
        NodeMemory {
            hold: Hold::NONE,
            is_coarsest: false,
        }
    }

    /// Everything below is at its coarsest, as long as `hold` lasts.
    ///
    /// The holds of instances tested by themselves stay, but for those that have changed: `hold` ends
    /// when the node is visited again, and they may last.
    fn settle(&mut self, context: &Context, level: usize, index: usize, hold: Hold) -> NodeMemory {
        let changed_at = context.scene.tree.levels[level][index].changed_at;
        // All holds of the first selection are new.
        let forgets = context.seen_revision > 0 && changed_at > context.seen_revision;
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
                let instance = context.scene.tree.order[child];
                self.settle_instance(context, instance, hold);
                if forgets {
                    self.holds[instance as usize] = Hold::NONE;
                }
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
        self.welcome(context, instance);
        let state = match context.scene.occupants[instance as usize].mesh {
            Some(mesh) => State::Coarsest(mesh),
            None => State::Empty,
        };
        self.change_state(context.scene, instance, state);
        NodeMemory {
            hold,
            is_coarsest: true,
        }
    }

    /// If `index` has gone to another instance, what the last one drew leaves.
    fn welcome(&mut self, context: &Context, index: u32) {
        let generation = context.scene.occupants[index as usize].generation;
        if self.memories[index as usize].generation != generation {
            self.change_state(context.scene, index, State::Empty);
            self.memories[index as usize].generation = generation;
            self.holds[index as usize] = Hold::NONE;
        }
    }

    /// Goes over to a state without a slot.
    pub(super) fn change_state(&mut self, scene: &Scene, index: u32, state: State) {
        let memory = &mut self.memories[index as usize];
        let was = std::mem::replace(&mut memory.state, state);
        if was == state {
            return;
        }
        let (now, triangles) = coarsest_of(scene, state);
        let (before, before_triangles) = match was {
            State::Mixed(slot) => {
                let slot = &self.slots[slot as usize];
                (slot.units(), slot.triangle_count())
            }
            other => coarsest_of(scene, other),
        };
        let instance = InstanceId {
            index,
            generation: memory.generation,
        };
        match (was, state) {
            (State::Empty, State::Coarsest(mesh)) => self.changes.enter(instance, mesh, now),
            _ => self.changes.record(instance, before, now),
        }
        self.triangle_count = self.triangle_count + triangles - before_triangles;
        if let State::Mixed(slot) = was {
            let free = std::mem::take(&mut self.slots[slot as usize]);
            self.pool.put(free);
            self.free_slots.push(slot);
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
