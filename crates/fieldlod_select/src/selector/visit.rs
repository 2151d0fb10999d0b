//! The walk over the tree: whole nodes and instances where that can be told, the rest left pending.

use std::ops::Range;

use super::Selector;
use super::memory::{NodeMemory, Pending, State, coarsest_of};
use crate::hold::{Hold, Odometer, WholeTest};
use crate::scene::Scene;
use crate::tree::FAN;
use crate::{InstanceId, MeshId};

/// What a frame asks with.
pub(super) struct Context<'a> {
    pub(super) scene: &'a Scene,
    pub(super) test: WholeTest<'a>,
    pub(super) now: Odometer,
    /// Changes of the scene up to here were taken into account before.
    pub(super) seen_revision: u64,
    /// Nothing is remembered: what is at its coarsest is listed in the end, in one go.
    pub(super) is_first: bool,
}

/// Instances of one mesh with indices that follow each other.
struct Run {
    first: InstanceId,
    count: u32,
    mesh: MeshId,
}

impl Run {
    fn goes_on_with(&self, index: u32, generation: u32, mesh: MeshId) -> bool {
        self.mesh == mesh
            && self.first.index + self.count == index
            && self.first.generation == generation
    }
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
        let is_coarsest = (unchanged || context.is_first) && memory.is_coarsest;
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
        if !context.is_first {
            self.welcome(context, instance);
        }
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
            State::Mixed(slot) => self.pool.take(slot),
            _ => self.pool.make(context.scene.table(mesh)),
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
        let forgets = changed_at > context.seen_revision;
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
        let memory = NodeMemory {
            hold,
            is_coarsest: true,
        };
        if context.is_first {
            return memory;
        }
        self.welcome(context, instance);
        let state = match context.scene.occupants[instance as usize].mesh {
            Some(mesh) => State::Coarsest(mesh),
            None => State::Empty,
        };
        if self.memories[instance as usize].state != state {
            self.change_state(context.scene, instance, state);
        }
        memory
    }

    /// After a first visit: what has no cut of its own enters at its coarsest.
    pub(super) fn settle_rest(&mut self, scene: &Scene) {
        let mut run: Option<Run> = None;
        for (index, occupant) in (0..).zip(&scene.occupants) {
            let generation = occupant.generation;
            let memory = &mut self.memories[index as usize];
            memory.generation = generation;
            let (State::Empty, Some(mesh)) = (memory.state, occupant.mesh) else {
                continue;
            };
            memory.state = State::Coarsest(mesh);
            match &mut run {
                Some(run) if run.goes_on_with(index, generation, mesh) => run.count += 1,
                _ => {
                    let first = InstanceId { index, generation };
                    let next = Run {
                        first,
                        count: 1,
                        mesh,
                    };
                    self.enter(scene, run.replace(next));
                }
            }
        }
        self.enter(scene, run);
    }

    fn enter(&mut self, scene: &Scene, run: Option<Run>) {
        let Some(Run { first, count, mesh }) = run else {
            return;
        };
        let table = scene.table(mesh);
        self.changes.enter(first, count, mesh, table);
        self.triangle_count += u64::from(count) * table.coarsest_triangle_count;
    }

    /// If `index` has gone to another instance, what the last one drew leaves.
    fn welcome(&mut self, context: &Context, index: u32) {
        let generation = context.scene.occupants[index as usize].generation;
        let memory = &mut self.memories[index as usize];
        if memory.generation != generation {
            if memory.state != State::Empty {
                self.change_state(context.scene, index, State::Empty);
            }
            self.memories[index as usize].generation = generation;
            self.holds[index as usize] = Hold::NONE;
        }
    }

    /// Goes over to a state without a slot.
    pub(super) fn change_state(&mut self, scene: &Scene, index: u32, state: State) {
        let memory = &mut self.memories[index as usize];
        let was = std::mem::replace(&mut memory.state, state);
        let (now, triangles) = coarsest_of(scene, state);
        let (before, before_triangles) = match was {
            State::Mixed(slot) => {
                let slot = self.pool.at(slot);
                (slot.units(), slot.triangle_count())
            }
            other => coarsest_of(scene, other),
        };
        let instance = InstanceId {
            index,
            generation: memory.generation,
        };
        self.changes.record(instance, before, now);
        self.triangle_count = self.triangle_count + triangles - before_triangles;
        if let State::Mixed(slot) = was {
            self.pool.free(slot);
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
