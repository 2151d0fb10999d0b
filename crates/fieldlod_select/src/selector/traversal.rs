//! The traversal of the tree: whole nodes and instances where that can be told, the rest left pending.

use std::ops::Range;

use super::hidden_test::HiddenTest;
use super::memory::{Below, InstanceState, NodeMemory, Pending};
use super::scene_cuts::SceneCuts;
use super::share_memory::LevelShare;
use crate::object_test::ObjectTest;
use crate::scene::{MeshId, Scene};
use crate::size_test::SizeTest;
use crate::tree::{FAN, Node};
use crate::validity::{CameraTravel, Validity};
use crate::view::View;
use crate::view_parts::ViewParts;

/// What a frame traverses with.
pub(super) struct TraversalContext<'a> {
    pub(super) scene: &'a Scene,
    /// The layers that the view sees.
    pub(super) layers: u64,
    pub(super) test: &'a ObjectTest<'a>,
    /// `None` if all sizes are drawn.
    pub(super) size: Option<SizeTest>,
    /// The level that everything is drawn at, if that is forced.
    pub(super) forced_level: Option<u32>,
    pub(super) now: CameraTravel,
    /// Changes of the scene up to here were taken into account before.
    pub(super) seen_revision: u64,
    /// Nothing is remembered: what is at its coarsest is listed in the end, in one go.
    pub(super) is_first: bool,
    /// What is visible, if hidden things count less.
    pub(super) hidden: Option<HiddenTest<'a>>,
    /// Whether this frame has taken notice of that before.
    pub(super) are_shares_known: bool,
    pub(super) view: &'a View,
    pub(super) parts: &'a ViewParts<'a>,
    /// The camera's travel since the last frame.
    pub(super) last_step: CameraTravel,
}

impl TraversalContext<'_> {
    /// What all instances below a node have in common, and for how long; `None` if that cannot be told. So far
    /// they had `was` in common.
    fn answer(&self, node: &Node, was: Below) -> Option<(Below, Validity)> {
        // What the view sees nothing of is as good as at its coarsest, wherever it is.
        if node.layers & self.layers == 0 {
            return Some((Below::Coarsest, Validity::forever(&self.now)));
        }
        // Too small, all of them, or none of them.
        let were_drawn = match was {
            Below::Coarsest => Some(!self.is_first),
            Below::Culled => Some(false),
            Below::Mixed => None,
        };
        let always = (true, Validity::forever(&self.now));
        let (is_drawn, size_validity) = match &self.size {
            Some(size) => size.of_node(node, were_drawn)?,
            None => always,
        };
        if !is_drawn {
            return Some((Below::Culled, size_validity));
        }
        // All at their coarsest.
        if node.is_forced || self.forced_level.is_some() {
            return None;
        }
        match self.test.coarsest(&node.bounds, was != Below::Mixed) {
            Some(validity) => Some((Below::Coarsest, validity.and(&size_validity, &self.now))),
            None if was == Below::Coarsest && self.hides(node) => {
                Some((Below::Coarsest, Validity::NONE))
            }
            None => None,
        }
    }

    /// Whether all below a node is hidden, and stays at its coarsest so.
    fn hides(&self, node: &Node) -> bool {
        let step = |hidden: &HiddenTest| hidden.buffer.hides(&node.surface_box);
        let step = self.hidden.as_ref().and_then(step);
        self.coarsest_by_share(node, step).is_some()
    }

    /// For how long what is visible by a share stays at its coarsest, if it does and no more of it becomes visible.
    fn coarsest_by_share(&self, node: &Node, share: Option<u8>) -> Option<Validity> {
        let (hidden, share) = (self.hidden.as_ref()?, share?);
        let seen = node.bounds.seen_by(hidden.counted(share));
        self.test.coarsest(&seen, true)
    }
}

impl SceneCuts {
    /// Visits all nodes whose answers are not valid any more.
    pub(super) fn traverse(&mut self, context: &TraversalContext) {
        let tree = &context.scene.tree;
        if !tree.order.is_empty() {
            self.visit(context, tree.levels.len() - 1, 0, true);
        }
    }

    /// Visits a node, which `may_have_changed` unless the one above has not.
    fn visit(
        &mut self,
        context: &TraversalContext,
        level: usize,
        index: usize,
        may_have_changed: bool,
    ) -> NodeMemory {
        let node = &context.scene.tree.levels[level][index];
        let memory = self.nodes[level][index];
        let is_unchanged = !may_have_changed || node.changed_at <= context.seen_revision;
        if is_unchanged && memory.validity.lasts(&context.now) {
            return memory;
        }
        // An answer for all instances below at once, or one for each child.
        self.statistics.nodes_visited += 1;
        let was = match is_unchanged || context.is_first {
            true => memory.below,
            false => Below::Mixed,
        };
        let found = match context.answer(node, was) {
            Some((below, validity)) if below == was => NodeMemory { validity, below },
            Some((below, validity)) => return self.mark(context, level, index, below, validity),
            None => self.visit_children(context, level, index, !is_unchanged),
        };
        self.nodes[level][index] = found;
        found
    }

    fn visit_children(
        &mut self,
        context: &TraversalContext,
        level: usize,
        index: usize,
        may_have_changed: bool,
    ) -> NodeMemory {
        let (mut validity, mut below) = (Validity::forever(&context.now), None);
        for child in children(context.scene, level, index) {
            let one = if level > 0 {
                self.visit(context, level - 1, child, may_have_changed)
            } else {
                self.visit_instance(context, child, may_have_changed)
            };
            validity = validity.and(&one.validity, &context.now);
            below = match below {
                Some(below) if below != one.below => Some(Below::Mixed),
                _ => Some(one.below),
            };
        }
        NodeMemory {
            validity,
            below: below.unwrap_or(Below::Coarsest),
        }
    }

    fn visit_instance(
        &mut self,
        context: &TraversalContext,
        position: usize,
        may_have_changed: bool,
    ) -> NodeMemory {
        // An answer that is valid still.
        let last = self.leaves[position];
        let lasts = last.validity.lasts(&context.now);
        if lasts && !may_have_changed && context.hidden.is_none() {
            return last;
        }
        let instance = context.scene.tree.order[position];
        let index = instance as usize;
        if !context.is_first {
            self.drop_previous_instance(context.scene, instance);
        }
        let counts_otherwise = self.update_level_share(context, instance);
        let memory = self.memories[index];
        let instance_data = &context.scene.instances[index];
        let node = &instance_data.node;
        let is_unchanged = node.changed_at <= context.seen_revision;
        if lasts && is_unchanged && !counts_otherwise {
            return memory.for_node(last);
        }
        // What no view of these layers sees, or is too small, is not drawn.
        self.statistics.instances_tested += 1;
        let forever = Validity::forever(&context.now);
        let entry = &context.scene.entries[index];
        let Some(mesh) = entry.seen_mesh(context.layers) else {
            return self.mark_tested(context, position, Below::Coarsest, forever, None);
        };
        let (is_drawn, size_validity) = match &context.size {
            Some(size) => size.of_instance(node, memory.state.is_drawn()),
            None => (true, forever),
        };
        if !is_drawn {
            return self.mark_tested(context, position, Below::Culled, size_validity, None);
        }
        // An answer for the instance as a whole.
        let forced_level = context.forced_level.or(instance_data.forced_level);
        let was_coarsest = memory.state.below() != Below::Mixed;
        let coarsest = match forced_level {
            Some(_) => None,
            None => context.test.coarsest(&node.bounds, was_coarsest),
        };
        if let Some(coarsest) = coarsest {
            let validity = coarsest.and(&size_validity, &context.now);
            return self.mark_tested(context, position, Below::Coarsest, validity, None);
        }
        // The same by what is visible of it, unless something was refined.
        let share = match forced_level {
            Some(_) => None,
            None => self.share_if_coarsest(context, instance, mesh),
        };
        if let Some(coarsest) = context.coarsest_by_share(node, share) {
            let validity = coarsest.and(&size_validity, &context.now);
            return self.mark_tested(context, position, Below::Coarsest, validity, share);
        }
        // One level of a mesh as a whole.
        let table = context.scene.table(mesh);
        if forced_level.is_none() && table.is_chain() {
            let found = self.decide_level(context, instance, mesh, share, &size_validity);
            self.leaves[position] = found;
            return self.memories[index].for_node(found);
        }
        // Its groups have to be decided.
        self.memories[index].share = None;
        self.leaves[position] = NodeMemory::new(Below::Mixed);
        let cut = match memory.state {
            InstanceState::Mixed(key) => key,
            _ => self.pool.make(table),
        };
        self.pending.push(Pending {
            instance,
            position,
            was: memory.state,
            has_moved: !is_unchanged,
            share,
            forced_level,
            size_validity,
            cut,
        });
        NodeMemory::new(Below::Mixed)
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
        let memory = &self.memories[instance as usize];
        match memory.state {
            InstanceState::Mixed(key) => {
                let cut = self.pool.at(key);
                let share = cut.shares().last_of_all();
                share.filter(|_| cut.is_coarsest(table))
            }
            InstanceState::AtLevel(..) => None,
            InstanceState::Coarsest(_) if memory.share.is_some() => memory.share.map(|it| it.now()),
            _ => {
                let placed = &context.scene.instances[instance as usize];
                hidden.buffer.share_of_all(table, instance, placed)
            }
        }
    }

    /// Everything below has `below` in common, as long as `validity` lasts.
    ///
    /// The validities of instances tested by themselves stay, but for those that have changed or whose answer
    /// is another one: `validity` ends when the node is visited again, and they may last.
    fn mark(
        &mut self,
        context: &TraversalContext,
        level: usize,
        index: usize,
        below: Below,
        validity: Validity,
    ) -> NodeMemory {
        let changed_at = context.scene.tree.levels[level][index].changed_at;
        let has_changed = changed_at > context.seen_revision;
        let memory = NodeMemory { validity, below };
        for child in children(context.scene, level, index) {
            if level > 0 {
                // What was so before, and has not changed, needs no visit.
                let changed_at = context.scene.tree.levels[level - 1][child].changed_at;
                let of_child = &mut self.nodes[level - 1][child];
                if of_child.below == below && changed_at <= context.seen_revision {
                    *of_child = memory;
                } else {
                    self.mark(context, level - 1, child, below, validity);
                }
            } else {
                let instance = context.scene.tree.order[child];
                self.mark_instance(context, instance, below);
                let leaf = &mut self.leaves[child];
                if has_changed || leaf.below != below {
                    *leaf = NodeMemory::new(below);
                }
            }
        }
        self.nodes[level][index] = memory;
        memory
    }

    /// As [`Self::mark_instance`], of an instance that was tested by itself, by its position in the tree, and of which
    /// no more may become visible than the `share` on which that rests.
    fn mark_tested(
        &mut self,
        context: &TraversalContext,
        position: usize,
        below: Below,
        validity: Validity,
        share: Option<u8>,
    ) -> NodeMemory {
        let instance = context.scene.tree.order[position];
        self.mark_instance(context, instance, below);
        self.leaves[position] = NodeMemory { validity, below };
        let memory = &mut self.memories[instance as usize];
        memory.share = share.map(LevelShare::seen);
        memory.for_node(self.leaves[position])
    }

    fn mark_instance(&mut self, context: &TraversalContext, instance: u32, below: Below) {
        let entry = &context.scene.entries[instance as usize];
        let state = match entry.seen_mesh(context.layers) {
            None => InstanceState::Empty,
            Some(_) if below == Below::Culled => InstanceState::Culled,
            Some(mesh) => InstanceState::Coarsest(mesh),
        };
        if !context.is_first {
            self.drop_previous_instance(context.scene, instance);
            if self.memories[instance as usize].state != state {
                self.change_state(context.scene, instance, state);
            }
        } else if state == InstanceState::Culled {
            self.memories[instance as usize].state = state;
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
