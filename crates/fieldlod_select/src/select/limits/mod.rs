//! The limits within which instances keep their cuts, in columns, and the changes that reset them.

pub(crate) mod keep_test;
pub(crate) mod limit_columns;

use crate::criterion::limits::Limits;
use crate::scene::InstanceId;
use crate::scene::columns::truncate;
use crate::select::cuts::SceneCuts;
use crate::select::frame::Frame;
use crate::select::memory::{InstanceMemory, InstanceState};

impl SceneCuts {
    /// Updates the limits after changes of the scene and the settings.
    pub(crate) fn update_limits(&mut self, frame: &Frame) {
        let journal = &frame.scene.journal;
        let count = frame.scene.columns.occupants.len();
        self.limits.resize(count);
        let changed = journal.since(self.journal_revision);
        self.journal_revision = journal.revision();
        if frame.last.is_none() {
            return self.enter_all(frame);
        }
        let nothing = InstanceMemory {
            instance: InstanceId::NONE,
            state: InstanceState::Empty,
        };
        // The scene dropped free slots.
        for slot in count..self.memories.len() {
            self.change_state(frame, slot, InstanceState::Empty);
        }
        truncate(&mut self.memories, count);
        self.memories.resize(count, nothing);
        let keeps_states = frame.keeps_states();
        // Limits depend on the ratio of both thresholds, which a zoom does not change.
        match changed.filter(|_| keeps_states && frame.keeps_units()) {
            Some(changed) => {
                for &slot in changed.iter().filter(|&&slot| (slot as usize) < count) {
                    self.update_limits_of(frame, slot as usize, true);
                }
            }
            None => (0..count).for_each(|slot| self.update_limits_of(frame, slot, keeps_states)),
        }
    }

    /// Starts a first frame with all instances at their coarsest levels.
    fn enter_all(&mut self, frame: &Frame) {
        self.changes.begin_first(frame.scene);
        let columns = &frame.scene.columns;
        self.memories.reserve(columns.occupants.len());
        // Most instances have the same mesh as the previous instance.
        let (mut last_seen, mut limits, mut triangles) = (None, Limits::EMPTY, 0);
        for (slot, occupant) in columns.occupants.iter().enumerate() {
            let seen = occupant.seen_mesh(frame.view.layers);
            let state = seen.map_or(InstanceState::Empty, InstanceState::Coarsest);
            if seen != last_seen {
                last_seen = seen;
                limits = state.limits_in_local(frame);
                triangles = state.drawn_whole(frame.scene).1;
            }
            let instance = occupant.id;
            self.memories.push(InstanceMemory { instance, state });
            self.triangle_count += triangles;
            let limits = match seen {
                // The pass of this frame brings every instance to the level.
                _ if frame.settings.forced_level.is_some() => Limits::UNKNOWN,
                Some(_) => limits.scaled(columns.error_scales[slot]),
                None => Limits::EMPTY,
            };
            self.limits.set(slot, limits);
        }
    }

    fn update_limits_of(&mut self, frame: &Frame, slot: usize, keeps_states: bool) {
        let occupant = &frame.scene.columns.occupants[slot];
        if self.memories[slot].instance != occupant.id {
            // The units of the previous instance in the slot leave.
            self.change_state(frame, slot, InstanceState::Empty);
            self.memories[slot].instance = occupant.id;
        }
        let seen = occupant.seen_mesh(frame.view.layers);
        let state = self.memories[slot].state;
        let is_free = frame.settings.forced_level.is_none();
        let limits = if keeps_states && is_free && state.mesh() == seen {
            state.limits(frame, slot)
        } else {
            Limits::UNKNOWN
        };
        self.limits.set(slot, limits);
    }
}
