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
        let count = scene.columns.occupants.len();
        self.memories.resize(count, InstanceMemory::default());
        self.limits.resize(count);
        let last_key = self.limits_of.replace(key);
        let changed = scene.journal.since(self.journal_revision);
        self.journal_revision = scene.journal.revision();
        match changed.filter(|_| last_key == Some(key)) {
            Some(changed) => {
                for &slot in changed {
                    self.update_limits_of(frame, slot as usize, &key, true);
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
                for slot in 0..count {
                    self.update_limits_of(frame, slot, &key, keeps_states);
                }
            }
        }
    }

    fn update_limits_of(&mut self, frame: &Frame, slot: usize, key: &LimitsKey, keeps_state: bool) {
        let occupant = frame.scene.occupant(slot);
        if self.memories[slot].instance != occupant {
            // The units of the last instance in the slot leave.
            self.change_state(frame, slot, InstanceState::Empty);
            self.memories[slot] = InstanceMemory {
                instance: occupant,
                ..InstanceMemory::default()
            };
        }
        let Some(instance) = occupant else {
            return self.limits.set(slot, Limits::EMPTY);
        };
        let (memory, entry) = (
            &mut self.memories[slot],
            &frame.scene.entries[instance.index()],
        );
        if let InstanceState::Mixed(key) = memory.state {
            self.pool.at_mut(key).hold = None;
        }
        let mut state = memory.state;
        if frame.is_first {
            // Every instance starts at its coarsest level, and is listed at the end of the frame.
            memory.version = entry.version;
            let seen = entry.seen_mesh(key.layers);
            state = seen.map_or(InstanceState::Empty, InstanceState::Coarsest);
        }
        let is_forced = entry.forced_level.or(key.forced_level).is_some();
        let is_forced = is_forced && state != InstanceState::Empty;
        let limits = match keeps_state && memory.version == entry.version && !is_forced {
            true => state.limits(frame.scene, slot, &key.units, key.hides),
            false => Limits::UNKNOWN,
        };
        self.limits.set(slot, limits);
    }

    /// Sets the limits within which an instance keeps the cut just decided.
    pub(in crate::select) fn set_limits(
        &mut self,
        frame: &Frame,
        slot: usize,
        state: InstanceState,
        is_forced: bool,
    ) {
        let hides = frame.settings.visible_flux.is_some();
        let limits = match is_forced && state != InstanceState::Empty {
            true => Limits::FIXED,
            false => state.limits(frame.scene, slot, &frame.units, hides),
        };
        self.limits.set(slot, limits);
    }
}
