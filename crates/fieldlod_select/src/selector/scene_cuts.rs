//! The cuts of all instances of a scene, and what changes them.

use super::changes::Changes;
use super::decide_context::DecideContext;
use super::instance_cut::InstanceCut;
use super::memory::{Below, InstanceMemory, InstanceState, NodeMemory, Pending};
use super::pool::Pool;
use super::visible_shares::VisibleShares;
use crate::scene::{InstanceId, MeshId, Scene};
use crate::settings::LodSettings;
use crate::tree::FAN;
use crate::validity::Validity;
use crate::view::View;

/// What the last selection did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Nodes of the tree whose answer had to be looked at again.
    pub nodes_visited: usize,
    /// Instances tested as a whole.
    pub instances_tested: usize,
    /// Instances decided group by group.
    pub instances_decided: usize,
    /// Groups of those whose answers were not valid any more.
    pub groups_decided: usize,
    /// Searches for the threshold that keeps to the triangle budget, each of which goes through all groups.
    pub budget_searches: usize,
}

#[derive(Debug, Default)]
pub(super) struct SceneCuts {
    pub(super) memories: Vec<InstanceMemory>,
    /// What was found of each instance, by its position in the tree, and for how long.
    pub(super) leaves: Vec<NodeMemory>,
    /// What was found of nodes, by level of the tree.
    pub(super) nodes: Vec<Vec<NodeMemory>>,
    pub(super) pending: Vec<Pending>,
    pub(super) pool: Pool,
    pub(super) visible: VisibleShares,
    /// Whether the next frame may see less of something than it counts for now.
    pub(super) has_unsettled_shares: bool,
    available_revision: u64,
    pub(super) changes: Changes,
    pub(super) triangle_count: u64,
    pub(super) statistics: Statistics,
}

/// Instances of one mesh with indices that follow each other.
struct Run {
    first: InstanceId,
    count: u32,
    mesh: MeshId,
}

impl Run {
    fn continues_with(&self, next: InstanceId, mesh: MeshId) -> bool {
        self.mesh == mesh
            && self.first.index + self.count == next.index
            && self.first.generation == next.generation
    }
}

impl SceneCuts {
    /// Gets ready for a selection: no changes yet.
    pub(super) fn begin(&mut self) {
        self.changes.clear();
        self.statistics = Statistics::default();
    }

    /// Makes room for a scene. A new tree has new nodes, and does not lead to instances that were
    /// removed.
    pub(super) fn resize(&mut self, scene: &Scene, is_first: bool, is_new_tree: bool) {
        let count = scene.instances.len();
        self.memories.resize(count, InstanceMemory::default());
        if is_new_tree {
            self.nodes.iter_mut().for_each(Vec::clear);
            self.leaves.clear();
            self.drop_removed(scene);
        }
        let (memories, positions) = (&self.memories, &scene.tree.order);
        let new = positions.iter().skip(self.leaves.len());
        let new = new.map(|&instance| NodeMemory::new(memories[instance as usize].state.below()));
        self.leaves.extend(new);
        let levels = &scene.tree.levels;
        let level_count = levels.len().max(self.nodes.len());
        self.nodes.resize_with(level_count, Vec::new);
        for (memories, nodes) in self.nodes.iter_mut().zip(levels) {
            let below = match is_first {
                true => Below::Coarsest,
                false => Below::Mixed,
            };
            memories.resize(nodes.len(), NodeMemory::new(below));
        }
    }

    fn drop_removed(&mut self, scene: &Scene) {
        for (index, entry) in (0..).zip(&scene.entries) {
            let is_drawn = self.memories[index as usize].state != InstanceState::Empty;
            if entry.mesh.is_none() && is_drawn {
                self.change_state(scene, index, InstanceState::Empty);
            }
        }
    }

    /// Takes notice of what is at hand.
    pub(super) fn update_available(&mut self, scene: &Scene) {
        if std::mem::replace(&mut self.available_revision, scene.available_revision)
            == scene.available_revision
        {
            return;
        }
        self.give_cuts_to_loaded_levels(scene);
        for key in self.pool.keys() {
            let cut = self.pool.at_mut(key);
            let Some(index) = cut.instance() else {
                continue;
            };
            // Of what was removed, everything leaves soon.
            let id = scene.instance_at(index);
            let is_same = self.memories[index as usize].generation == id.generation;
            let mesh = scene.entries[index as usize].mesh.filter(|_| is_same);
            if let Some(mesh) = mesh
                && cut.update_available(scene.table(mesh))
            {
                let (before, triangles_before) = cut.drawn_before();
                let (now, triangles) = cut.drawn();
                self.changes.record(id, before, now);
                self.triangle_count = self.triangle_count + triangles - triangles_before;
            }
        }
    }

    /// Takes notice of what is visible in a frame, and wakes the instances that count for more or less
    /// than they did.
    pub(super) fn update_shares(&mut self, scene: &Scene, view: &View, settings: &LodSettings) {
        let flux = settings.visible_flux;
        let is_redrawn = match &flux {
            Some(flux) => self.visible.draw(scene, view, settings, flux),
            None => self.visible.clear(),
        };
        if !(is_redrawn || self.has_unsettled_shares) {
            return;
        }
        self.has_unsettled_shares = false;
        for key in self.pool.keys() {
            let cut = self.pool.at_mut(key);
            let Some(index) = cut.instance() else {
                continue;
            };
            let Some(mesh) = scene.entries[index as usize].mesh else {
                continue;
            };
            let (table, instance) = (scene.table(mesh), &scene.instances[index as usize]);
            let seen = flux.map(|_| self.visible.seen(table, index, instance, None));
            let hold_frames = flux.map_or(0, |flux| flux.hold_frames);
            let has_changed = cut.update_shares(seen, hold_frames);
            self.has_unsettled_shares |= flux.is_some() && !cut.shares().is_settled();
            if has_changed {
                self.wake(scene, index);
            }
        }
    }

    /// Ends what is known of an instance and of the nodes above it.
    fn wake(&mut self, scene: &Scene, instance: u32) {
        let Some(mut node) = scene.tree.position(instance) else {
            return;
        };
        if let Some(leaf) = self.leaves.get_mut(node) {
            leaf.validity = Validity::NONE;
        }
        for level in &mut self.nodes {
            node /= FAN;
            if let Some(memory) = level.get_mut(node) {
                memory.validity = Validity::NONE;
            }
        }
    }

    /// Decides what is pending, group by group.
    pub(super) fn decide_pending(&mut self, scene: &Scene, context: &DecideContext) {
        let mut pending = std::mem::take(&mut self.pending);
        for one in pending.drain(..) {
            self.decide(scene, &one, context);
        }
        self.pending = pending;
    }

    fn decide(&mut self, scene: &Scene, pending: &Pending, context: &DecideContext) {
        let (was, index) = (pending.was, pending.instance as usize);
        let Some(mesh) = scene.entries[index].mesh else {
            return;
        };
        // The cut, after that of the last frame if there was one.
        let (table, instance) = (scene.table(mesh), &scene.instances[index]);
        let cut = self.pool.at_mut(pending.cut);
        let is_mixed = matches!(was, InstanceState::Mixed(_));
        if let Some(level) = pending.forced_level {
            if !is_mixed {
                cut.begin_shares(pending.instance, table.terminal.len(), None);
            }
            cut.decide_forced(table, level, is_mixed, &context.now);
            self.memories[index].state = InstanceState::Mixed(pending.cut);
        } else if is_mixed {
            cut.decide_again(table, instance, context, pending.has_moved);
        } else {
            let flux = context.parts.settings.visible_flux;
            let (visible, share) = (&mut self.visible, pending.share);
            let seen = flux
                .is_some()
                .then(|| visible.seen(table, pending.instance, instance, share));
            cut.begin_shares(pending.instance, table.terminal.len(), seen);
            match was {
                InstanceState::AtLevel(_, level) => cut.begin_at_level(table, usize::from(level)),
                _ => cut.begin_at_coarsest(table),
            }
            cut.decide_again(table, instance, context, true);
            self.memories[index].state = InstanceState::Mixed(pending.cut);
        }
        self.statistics.instances_decided += 1;
        self.statistics.groups_decided += cut.groups_decided();
        // The next visit tells whether it needs a cut of its own any more.
        let is_free = pending.forced_level.is_none();
        let may_end = is_free && cut.has_changed() && cut.is_coarsest(table);
        self.leaves[pending.position] = NodeMemory {
            validity: if may_end {
                Validity::NONE
            } else {
                cut.validity().and(&pending.size_validity, &context.now)
            },
            below: Below::Mixed,
        };
        // What that changes.
        if !is_mixed || cut.has_changed() {
            let (before, triangles_before) = if is_mixed {
                cut.drawn_before()
            } else {
                was.drawn_whole(scene)
            };
            let (now, triangles) = cut.drawn();
            let id = scene.instance_at(pending.instance);
            self.changes.record(id, before, now);
            self.triangle_count = self.triangle_count + triangles - triangles_before;
        }
    }

    /// After a first traversal: what has no cut of its own enters at its coarsest.
    pub(super) fn emit_coarsest(&mut self, scene: &Scene, layers: u64) {
        let mut run: Option<Run> = None;
        for (index, entry) in (0..).zip(&scene.entries) {
            let generation = entry.generation;
            let memory = &mut self.memories[index as usize];
            memory.generation = generation;
            let (InstanceState::Empty, Some(mesh)) = (memory.state, entry.seen_mesh(layers)) else {
                continue;
            };
            memory.state = InstanceState::Coarsest(mesh);
            // Instances that follow each other are one change.
            let first = InstanceId { index, generation };
            match &mut run {
                Some(run) if run.continues_with(first, mesh) => run.count += 1,
                _ => {
                    let count = 1;
                    self.enter(scene, run.replace(Run { first, count, mesh }));
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
    pub(super) fn drop_previous_instance(&mut self, scene: &Scene, index: u32) {
        let generation = scene.entries[index as usize].generation;
        let memory = &mut self.memories[index as usize];
        if memory.generation != generation {
            if memory.state != InstanceState::Empty {
                self.change_state(scene, index, InstanceState::Empty);
            }
            self.memories[index as usize].generation = generation;
        }
    }

    /// Goes over to a state without a cut of its own.
    pub(super) fn change_state(&mut self, scene: &Scene, index: u32, state: InstanceState) {
        let memory = &mut self.memories[index as usize];
        let was = std::mem::replace(&mut memory.state, state);
        let (now, triangles) = state.drawn_whole(scene);
        let (before, triangles_before) = match was {
            InstanceState::Mixed(key) => self.pool.at(key).drawn(),
            other => other.drawn_whole(scene),
        };
        // What that changes.
        let instance = InstanceId {
            index,
            generation: memory.generation,
        };
        self.changes.record(instance, before, now);
        self.triangle_count = self.triangle_count + triangles - triangles_before;
        if let InstanceState::Mixed(key) = was {
            self.pool.free(key);
        }
    }

    pub(super) fn units<'a>(&'a self, scene: &'a Scene, instance: InstanceId) -> &'a [u32] {
        let Some(memory) = self.memories.get(instance.index()) else {
            return &[];
        };
        match memory.state {
            _ if memory.generation != instance.generation => &[],
            InstanceState::Mixed(key) => self.pool.at(key).drawn().0,
            other => other.drawn_whole(scene).0,
        }
    }

    /// Whether an instance is too small to be drawn.
    pub(super) fn is_culled(&self, index: usize) -> bool {
        let memory = self.memories.get(index);
        memory.is_some_and(|memory| memory.state == InstanceState::Culled)
    }

    /// The cut of an instance, if it has one of its own.
    pub(super) fn cut(&self, index: usize) -> Option<&InstanceCut> {
        match self.memories.get(index)?.state {
            InstanceState::Mixed(key) => Some(self.pool.at(key)),
            _ => None,
        }
    }

    /// Forgets all cuts.
    pub(super) fn clear(&mut self) {
        self.memories.clear();
        self.leaves.clear();
        self.nodes.iter_mut().for_each(Vec::clear);
        self.pool.clear();
        self.changes.clear();
        self.visible.clear();
        self.has_unsettled_shares = false;
        self.triangle_count = 0;
    }

    /// What all storage could hold without growing.
    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        self.memories.capacity()
            + self.leaves.capacity()
            + self.nodes.iter().map(Vec::capacity).sum::<usize>()
            + self.pending.capacity()
            + self.changes.capacity()
            + self.pool.capacity()
    }
}
