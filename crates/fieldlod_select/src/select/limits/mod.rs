//! The limits within which instances keep their cuts, in columns, and the changes that reset them.

pub(crate) mod columns;
pub(crate) mod keep_test;

use columns::LimitsKey;

use crate::criterion::limits::Limits;
use crate::select::cuts::SceneCuts;
use crate::select::frame::Frame;
use crate::select::memory::{InstanceMemory, InstanceState};

impl SceneCuts {
    /// Updates the limits after changes of the scene and the settings.
    pub(crate) fn update_limits(&mut self, frame: &Frame) {
        let (scene, settings) = (frame.scene, frame.settings);
        let key = LimitsKey {
            units: frame.units,
            layers: frame.view.layers,
            forced_level: settings.forced_level,
            hides: settings.visible_flux.is_some(),
            available_revision: scene.available_revision,
        };
        let count = scene.instances.len();
        self.memories.resize(count, InstanceMemory::default());
        self.limits.resize(count);
        let last_key = self.limits_of.replace(key);
        let changed = scene.journal.since(self.journal_revision);
        self.journal_revision = scene.journal.revision();
        match changed.filter(|_| last_key == Some(key)) {
            Some(changed) => {
                for &index in changed {
                    self.update_limits_of(frame, index as usize, &key);
                }
            }
            None => {
                // Other units change the limits only; other changes require new decisions.
                let is_same = |last: LimitsKey| {
                    LimitsKey {
                        units: key.units,
                        ..last
                    } == key
                };
                let keeps_states = frame.is_first || last_key.is_some_and(is_same);
                for index in 0..count {
                    match keeps_states {
                        true => self.update_limits_of(frame, index, &key),
                        false => self.limits.set(index, Limits::UNKNOWN),
                    }
                }
            }
        }
    }

    fn update_limits_of(&mut self, frame: &Frame, index: usize, key: &LimitsKey) {
        let (memory, entry) = (&mut self.memories[index], &frame.scene.entries[index]);
        let forced_level = entry.forced_level;
        if let InstanceState::Mixed(key) = memory.state {
            self.pool.at_mut(key).hold = None;
        }
        let mut state = memory.state;
        let mut is_known = memory.version == entry.version && memory.generation == entry.generation;
        if frame.is_first {
            // Every instance starts at its coarsest level, and is listed at the end of the frame.
            (memory.version, memory.generation) = (entry.version, entry.generation);
            let seen = entry.seen_mesh(key.layers);
            state = seen.map_or(InstanceState::Empty, InstanceState::Coarsest);
            is_known = true;
        }
        let is_forced =
            forced_level.or(key.forced_level).is_some() && state != InstanceState::Empty;
        let limits = match is_known && !is_forced {
            true => state.limits(frame.scene, index, &key.units, key.hides),
            false => Limits::UNKNOWN,
        };
        self.limits.set(index, limits);
    }

    /// Sets the limits within which an instance keeps the cut just decided.
    pub(in crate::select) fn set_limits(&mut self, frame: &Frame, index: u32, is_forced: bool) {
        let Some(key) = &self.limits_of else {
            return;
        };
        let index = index as usize;
        let state = match self.memories[index].state {
            // A first frame lists it at its end.
            InstanceState::Empty if frame.is_first => {
                let seen = frame.scene.entries[index].seen_mesh(key.layers);
                seen.map_or(InstanceState::Empty, InstanceState::Coarsest)
            }
            state => state,
        };
        let limits = match is_forced && state.is_drawn() {
            true => Limits::FIXED,
            false => state.limits(frame.scene, index, &key.units, key.hides),
        };
        self.limits.set(index, limits);
    }
}
