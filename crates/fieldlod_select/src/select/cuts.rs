//! The cuts of all instances of a scene in one view, and the steps that bring them up to date.

use super::changes::{Change, Changes};
use super::frame::Frame;
use super::instance_cut::{InstanceCut, Pool};
use super::limits::keep_test::{Looked, Near};
use super::limits::limit_columns::LimitColumns;
use super::memory::{InstanceMemory, InstanceState};
use super::weights::Weights;
use crate::lanes::bits::{CHUNK, LANES};
use crate::scene::table::level_unit;
use crate::scene::{InstanceId, Scene};

/// Counters of the last selection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Instances whose levels or groups were decided.
    pub instances_decided: usize,
    /// How many more thresholds the search tried for the triangle budget. Each try runs one selection.
    pub budget_tries: usize,
}

#[derive(Debug, Default)]
pub(crate) struct SceneCuts {
    pub(super) memories: Vec<InstanceMemory>,
    pub(super) limits: LimitColumns,
    /// Revision of the journal up to which changes are applied.
    pub(super) journal_revision: u64,
    pub(super) pool: Pool,
    /// Reused buffers: results of the tests of chunks and of instances.
    looked: [Vec<Looked>; 2],
    pub(super) changes: Changes,
    pub(crate) triangle_count: u64,
    pub(crate) statistics: Statistics,
}

impl SceneCuts {
    /// Clears the changes and counters before a selection.
    pub(crate) fn begin(&mut self) {
        self.changes.clear();
        self.statistics = Statistics::default();
    }

    /// Tests all instances, and decides those whose cut may change.
    pub(crate) fn decide_near(&mut self, frame: &Frame, weights: &mut impl Weights) {
        let (columns, test) = (&frame.scene.columns, &frame.test);
        let [mut chunks, mut instances] = std::mem::take(&mut self.looked);
        test.look(&columns.chunks, &self.limits.chunks, &mut chunks);
        for chunk in chunks.iter().flat_map(Looked::near) {
            // Decisions since the last pass left the limits of the chunk unknown.
            self.limits.refit(chunk.slot);
            let first = chunk.slot * (CHUNK / LANES);
            let end = self.limits.instances.len().min(first + CHUNK / LANES);
            let spheres = &columns.spheres[first..end];
            test.look(spheres, &self.limits.instances[first..end], &mut instances);
            for near in instances.iter().flat_map(Looked::near) {
                let slot = first * LANES + near.slot;
                self.decide(frame, &Near { slot, ..near }, weights);
            }
        }
        self.looked = [chunks, instances];
    }

    /// Changes an instance to a state without a cut of its own.
    pub(super) fn change_state(&mut self, frame: &Frame, slot: usize, state: InstanceState) {
        let scene = frame.scene;
        let memory = &mut self.memories[slot];
        let was = std::mem::replace(&mut memory.state, state);
        if was == state {
            return;
        }
        let instance = memory.instance;
        let (now, triangles) = state.drawn_whole(scene);
        let (before, triangles_before) = match was {
            InstanceState::Mixed(key) => self.pool.at(key).drawn(),
            other => other.drawn_whole(scene),
        };
        self.changes.record(instance, before, now);
        self.triangle_count = self.triangle_count + triangles - triangles_before;
        // Only now, because `before` borrows its units.
        if let InstanceState::Mixed(key) = was {
            self.pool.free.push(key);
        }
    }

    /// Changes of the last selection. After the first frame, these are the cuts of all instances.
    pub(crate) fn changes(&self) -> impl Iterator<Item = Change<'_>> {
        let coarsest = self.changes.coarsest.as_deref();
        let memories = coarsest.map_or(&[][..], |_| &self.memories);
        let entered = memories.iter().map(move |memory| Change {
            instance: memory.instance,
            entered: match memory.state {
                InstanceState::Empty => &[],
                InstanceState::Coarsest(mesh) => coarsest.map_or(&[], |of| &of[mesh.index()]),
                InstanceState::AtLevel(_, level) => level_unit(usize::from(level)),
                InstanceState::Mixed(key) => self.pool.at(key).drawn().0,
            },
            left: &[],
        });
        let entered = entered.filter(|change| !change.entered.is_empty());
        entered.chain(self.changes.iter())
    }

    pub(crate) fn units<'a>(&'a self, scene: &'a Scene, instance: InstanceId) -> &'a [u32] {
        let slot = scene.slot_of(instance);
        let Some(memory) = slot.and_then(|slot| self.memories.get(slot)) else {
            return &[];
        };
        match memory.state {
            _ if memory.instance != instance => &[],
            InstanceState::Mixed(key) => self.pool.at(key).drawn().0,
            other => other.drawn_whole(scene).0,
        }
    }

    /// The cuts of all present instances that are drawn group by group. The order depends on earlier selections.
    pub(crate) fn mixed(&self, scene: &Scene) -> impl Iterator<Item = (InstanceId, &InstanceCut)> {
        let present = self.pool.owners().filter(|&(key, instance)| {
            let state = InstanceState::Mixed(key);
            let slot = scene.slot_of(instance);
            let memory = slot.and_then(|slot| self.memories.get(slot));
            memory.is_some_and(|memory| (memory.instance, memory.state) == (instance, state))
        });
        present.map(|(key, instance)| (instance, self.pool.at(key)))
    }
}
