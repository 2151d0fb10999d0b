//! The cuts of all instances of a scene in one view, and the four steps that bring them up to date.

use super::changes::Changes;
use super::frame::Frame;
use super::instance_cut::{InstanceCut, Pool};
use super::limits::columns::{LimitColumns, LimitsKey};
use super::limits::keep_test::Near;
use super::memory::{InstanceMemory, InstanceState};
use super::motion::Odometer;
use crate::hidden::visible_shares::VisibleShares;
use crate::lanes::bits::{CHUNK, LANES, set_bits_of};
use crate::scene::{InstanceId, MeshId, Scene};

/// Counters of the last selection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Instances tested eight at a time, outside chunks of 64 that were skipped.
    pub instances_tested: usize,
    /// Instances whose levels or groups were decided.
    pub instances_decided: usize,
    /// Groups of those.
    pub groups_decided: usize,
    /// Thresholds tried to keep to the triangle budget, after the first one; each is a selection.
    pub budget_tries: usize,
}

#[derive(Debug, Default)]
pub(crate) struct SceneCuts {
    pub(super) memories: Vec<InstanceMemory>,
    pub(super) limits: LimitColumns,
    /// Input of the limits.
    pub(super) limits_of: Option<LimitsKey>,
    /// Revision of the journal up to which changes are applied.
    pub(super) journal_revision: u64,
    /// Instances whose cuts may change in this frame.
    near: Vec<Near>,
    pub(super) pool: Pool,
    pub(crate) odometer: Odometer,
    /// Bits of groups, for tests of cuts.
    pub(super) own_throughout: Vec<u64>,
    pub(crate) visible: VisibleShares,
    /// Whether a visible share is held above its current value, so that a later frame may lower it.
    pub(crate) has_unsettled_shares: bool,
    pub(crate) changes: Changes,
    pub(crate) triangle_count: u64,
    pub(crate) statistics: Statistics,
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
    /// Starts a selection without changes.
    pub(crate) fn begin(&mut self) {
        self.changes.clear();
        self.statistics = Statistics::default();
    }

    /// Draws the depth image of a frame, once per selection.
    pub(crate) fn update_shares(&mut self, frame: &Frame) {
        if frame.are_shares_known {
            return;
        }
        self.has_unsettled_shares = false;
        match &frame.settings.visible_flux {
            Some(flux) => self.visible.draw(frame.scene, frame.view, flux),
            None => self.visible.clear(),
        }
    }

    /// One pass over all instances: lists those that do not certainly keep their cuts.
    pub(crate) fn find_near(&mut self, frame: &Frame) {
        self.near.clear();
        let (columns, test) = (&frame.scene.columns, &frame.test);
        let chunk_count = self.limits.instances.len().div_ceil(CHUNK / LANES);
        for element in 0..self.limits.chunks.len() {
            let looked = test.look(&columns.chunks[element], &self.limits.chunks[element]);
            let kept = looked.map_or(0xff, |looked| looked.kept);
            for lane in set_bits_of(!kept & 0xff) {
                let chunk = element * LANES + lane;
                if chunk < chunk_count {
                    self.find_near_in(frame, chunk);
                }
            }
        }
    }

    fn find_near_in(&mut self, frame: &Frame, chunk: usize) {
        let (columns, test) = (&frame.scene.columns, &frame.test);
        let first = chunk * (CHUNK / LANES);
        let end = self.limits.instances.len().min(first + CHUNK / LANES);
        self.limits.refit(chunk);
        self.statistics.instances_tested += (end - first) * LANES;
        for element in first..end {
            let (spheres, limits) = (&columns.spheres[element], &self.limits.instances[element]);
            let Some(looked) = test.look(spheres, limits) else {
                continue;
            };
            let near = set_bits_of(!looked.kept & 0xff);
            let near = near.filter(|lane| element * LANES + lane < self.memories.len());
            let allowed = looked.allowed();
            self.near.extend(near.map(|lane| Near {
                slot: (element * LANES + lane) as u32,
                is_dark: looked.dark >> lane & 1 == 1,
                allowed: allowed[lane],
            }));
        }
    }

    /// Decides the levels and groups of near instances, and records the changes.
    pub(crate) fn decide_near(&mut self, frame: &Frame) {
        let near = std::mem::take(&mut self.near);
        near.iter().for_each(|near| self.decide(frame, near));
        self.near = near;
    }

    /// In a first frame, adds all other instances at their coarsest levels.
    pub(crate) fn enter_rest(&mut self, frame: &Frame) {
        if !frame.is_first {
            return;
        }
        let (scene, layers) = (frame.scene, frame.view.layers);
        let mut run: Option<Run> = None;
        for (index, entry) in (0..).zip(&scene.entries) {
            let Some(slot) = entry.slot else {
                continue;
            };
            let generation = entry.generation;
            let memory = &mut self.memories[slot as usize];
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

    /// Changes an instance to a state without a cut of its own.
    pub(super) fn change_state(&mut self, frame: &Frame, slot: usize, state: InstanceState) {
        let scene = frame.scene;
        let memory = &mut self.memories[slot];
        let was = std::mem::replace(&mut memory.state, state);
        // A first frame lists instances at their coarsest levels at its end.
        let is_listed_later = frame.is_first && matches!(state, InstanceState::Coarsest(_));
        if is_listed_later && was == InstanceState::Empty {
            memory.state = was;
            return;
        }
        let (Some(instance), true) = (memory.instance, was != state) else {
            return;
        };
        let (now, triangles) = state.drawn_whole(scene);
        let (before, triangles_before) = match was {
            InstanceState::Mixed(key) => self.pool.at(key).drawn(),
            other => other.drawn_whole(scene),
        };
        match (before, now) {
            (&[before], &[now]) if before != now && before.max(now) < CHUNK as u32 => {
                self.changes.change_level(instance, before, now);
            }
            _ => self.changes.record(instance, before, now),
        }
        self.triangle_count = self.triangle_count + triangles - triangles_before;
        if let InstanceState::Mixed(key) = was {
            self.pool.free(key);
        }
    }

    pub(crate) fn units<'a>(&'a self, scene: &'a Scene, instance: InstanceId) -> &'a [u32] {
        let slot = scene.slot_of(instance);
        let Some(memory) = slot.and_then(|slot| self.memories.get(slot)) else {
            return &[];
        };
        match memory.state {
            _ if memory.instance != Some(instance) => &[],
            InstanceState::Mixed(key) => self.pool.at(key).drawn().0,
            other => other.drawn_whole(scene).0,
        }
    }

    /// The cut of an instance, if it has one of its own.
    pub(crate) fn cut(&self, slot: usize) -> Option<&InstanceCut> {
        match self.memories.get(slot)?.state {
            InstanceState::Mixed(key) => Some(self.pool.at(key)),
            _ => None,
        }
    }

    /// Removes all cuts.
    pub(crate) fn clear(&mut self) {
        self.memories.clear();
        self.limits.clear();
        self.limits_of = None;
        self.pool.clear();
        self.changes.clear();
        self.visible.clear();
        self.has_unsettled_shares = false;
        self.triangle_count = 0;
    }
}
