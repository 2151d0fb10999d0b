//! The traversal of the tree: whole nodes and instances where that can be told, the rest left pending.

use std::ops::Range;

use super::hidden_test::HiddenTest;
use super::memory::{InstanceState, NodeMemory, Pending};
use super::scene_cuts::SceneCuts;
use crate::object_test::ObjectTest;
use crate::scene::{MeshId, Scene};
use crate::tree::{FAN, Node};
use crate::validity::{CameraTravel, Validity};

/// What a frame traverses with.
pub(super) struct TraversalContext<'a> {
    pub(super) scene: &'a Scene,
    /// The layers that the view sees.
    pub(super) layers: u64,
    pub(super) test: &'a ObjectTest<'a>,
    pub(super) now: CameraTravel,
    /// Changes of the scene up to here were taken into account before.
    pub(super) seen_revision: u64,
    /// Nothing is remembered: what is at its coarsest is listed in the end, in one go.
    pub(super) is_first: bool,
    /// What is visible, if hidden things count less.
    pub(super) hidden: Option<HiddenTest<'a>>,
}

impl SceneCuts {
    /// Visits all nodes whose answers are not valid any more.
    pub(super) fn traverse(&mut self, context: &TraversalContext) {
        let tree = &context.scene.tree;
        if !tree.order.is_empty() {
            self.visit(context, tree.levels.len() - 1, 0);
        }
    }

    fn visit(&mut self, context: &TraversalContext, level: usize, index: usize) -> NodeMemory {
        let node = &context.scene.tree.levels[level][index];
        let memory = self.nodes[level][index];
        let is_unchanged = node.changed_at <= context.seen_revision;
        if is_unchanged && memory.validity.lasts(&context.now) {
            return memory;
        }
        // An answer for all instances below at once, or one for each child.
        self.statistics.nodes_visited += 1;
        let is_coarsest = (is_unchanged || context.is_first) && memory.is_coarsest;
        let found = match context.test.coarsest(&node.bounds, is_coarsest) {
            Some(validity) if is_coarsest => NodeMemory {
                validity,
                is_coarsest,
            },
            Some(validity) => return self.mark_coarsest(context, level, index, validity),
            None if is_coarsest && context.hides(node) => NodeMemory::new(true),
            None => self.visit_children(context, level, index),
        };
        self.nodes[level][index] = found;
        found
    }

    fn visit_children(
        &mut self,
        context: &TraversalContext,
        level: usize,
        index: usize,
    ) -> NodeMemory {
        let mut all = NodeMemory {
            validity: Validity::forever(&context.now),
            is_coarsest: true,
        };
        for child in children(context.scene, level, index) {
            let one = if level > 0 {
                self.visit(context, level - 1, child)
            } else {
                self.visit_instance(context, context.scene.tree.order[child])
            };
            all.validity = all.validity.and(&one.validity, &context.now);
            all.is_coarsest &= one.is_coarsest;
        }
        all
    }

    fn visit_instance(&mut self, context: &TraversalContext, instance: u32) -> NodeMemory {
        let index = instance as usize;
        if !context.is_first {
            self.drop_previous_instance(context.scene, instance);
        }
        let memory = self.memories[index];
        let is_coarsest = !matches!(memory.state, InstanceState::Mixed(_));
        // An answer that is valid still.
        let node = &context.scene.instances[index].node;
        let is_unchanged = node.changed_at <= context.seen_revision;
        let validity = self.validities[index];
        if is_unchanged && validity.lasts(&context.now) {
            return NodeMemory {
                validity,
                is_coarsest,
            };
        }
        // An answer for the instance as a whole.
        self.statistics.instances_tested += 1;
        let mesh = context.scene.entries[index].seen_mesh(context.layers);
        let coarsest = match mesh {
            Some(_) => context.test.coarsest(&node.bounds, is_coarsest),
            None => Some(Validity::forever(&context.now)),
        };
        self.validities[index] = coarsest.unwrap_or(Validity::NONE);
        let (None, Some(mesh)) = (coarsest, mesh) else {
            return self.mark_instance_coarsest(context, instance, self.validities[index]);
        };
        // The same by what is visible of it, unless something was refined.
        let share = self.share_if_coarsest(context, instance, mesh);
        if context.stays_coarsest(node, share) {
            return self.mark_instance_coarsest(context, instance, Validity::NONE);
        }
        // Its groups have to be decided.
        let cut = match memory.state {
            InstanceState::Mixed(key) => key,
            _ => self.pool.make(context.scene.table(mesh)),
        };
        self.pending.push(Pending {
            instance,
            was: memory.state,
            has_moved: !is_unchanged,
            share,
            cut,
        });
        NodeMemory::new(false)
    }

    /// What is visible of all of an instance, if that matters and nothing of it was refined.
    fn share_if_coarsest(
        &self,
        context: &TraversalContext,
        instance: u32,
        mesh: MeshId,
    ) -> Option<u8> {
        let hidden = context.hidden.as_ref()?;
        let table = context.scene.table(mesh);
        match self.memories[instance as usize].state {
            InstanceState::Mixed(key) => {
                let cut = self.pool.at(key);
                let share = cut.shares().last_of_all();
                share.filter(|_| cut.is_coarsest(table))
            }
            _ => {
                let placed = &context.scene.instances[instance as usize];
                hidden.buffer.share_of_all(table, instance, placed)
            }
        }
    }

    /// Everything below is at its coarsest, as long as `validity` lasts.
    ///
    /// The validities of instances tested by themselves stay, but for those that have changed:
    /// `validity` ends when the node is visited again, and they may last.
    fn mark_coarsest(
        &mut self,
        context: &TraversalContext,
        level: usize,
        index: usize,
        validity: Validity,
    ) -> NodeMemory {
        let changed_at = context.scene.tree.levels[level][index].changed_at;
        let has_changed = changed_at > context.seen_revision;
        for child in children(context.scene, level, index) {
            if level > 0 {
                // What was at its coarsest, and has not changed, needs no visit.
                let changed_at = context.scene.tree.levels[level - 1][child].changed_at;
                let memory = &mut self.nodes[level - 1][child];
                if memory.is_coarsest && changed_at <= context.seen_revision {
                    memory.validity = validity;
                } else {
                    self.mark_coarsest(context, level - 1, child, validity);
                }
            } else {
                let instance = context.scene.tree.order[child];
                self.mark_instance_coarsest(context, instance, validity);
                if has_changed {
                    self.validities[instance as usize] = Validity::NONE;
                }
            }
        }
        let memory = NodeMemory {
            validity,
            is_coarsest: true,
        };
        self.nodes[level][index] = memory;
        memory
    }

    fn mark_instance_coarsest(
        &mut self,
        context: &TraversalContext,
        instance: u32,
        validity: Validity,
    ) -> NodeMemory {
        if !context.is_first {
            self.drop_previous_instance(context.scene, instance);
            let entry = &context.scene.entries[instance as usize];
            let state = match entry.seen_mesh(context.layers) {
                Some(mesh) => InstanceState::Coarsest(mesh),
                None => InstanceState::Empty,
            };
            if self.memories[instance as usize].state != state {
                self.change_state(context.scene, instance, state);
            }
        }
        NodeMemory {
            validity,
            is_coarsest: true,
        }
    }
}

impl TraversalContext<'_> {
    /// Whether all below a node is hidden, and stays at its coarsest so.
    fn hides(&self, node: &Node) -> bool {
        let is_hidden = |hidden: &HiddenTest| hidden.buffer.hides(&node.surface_box);
        self.hidden.as_ref().is_some_and(is_hidden) && self.stays_coarsest(node, Some(0))
    }

    /// Whether what is visible by a share stays at its coarsest.
    fn stays_coarsest(&self, node: &Node, share: Option<u8>) -> bool {
        let (Some(hidden), Some(share)) = (&self.hidden, share) else {
            return false;
        };
        let seen = node.bounds.seen_by(hidden.counted(share));
        self.test.coarsest(&seen, true).is_some()
    }
}

fn children(scene: &Scene, level: usize, index: usize) -> Range<usize> {
    let below = match level {
        0 => scene.tree.order.len(),
        _ => scene.tree.levels[level - 1].len(),
    };
    index * FAN..below.min((index + 1) * FAN)
}
