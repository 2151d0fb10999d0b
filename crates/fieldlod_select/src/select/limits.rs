//! The limits within which instances keep their cuts, in columns, and the changes that reset them.

use wide::f32x8;

use super::cuts::SceneCuts;
use super::frame::Frame;
use super::memory::{InstanceMemory, InstanceState};
use crate::criterion::limits::{ErrorUnits, Limits};
use crate::lanes::bits::{CHUNK, LANES};
use crate::lanes::{Lane, bits_of};

/// Input of the limits besides the instances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LimitsKey {
    units: ErrorUnits,
    layers: u64,
    forced_level: Option<u32>,
    hides: bool,
    available_revision: u64,
}

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
    pub(super) fn set_limits(&mut self, frame: &Frame, index: u32, is_forced: bool) {
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

/// Limits of all instances in columns, eight to an element, and of 64 at once.
#[derive(Debug, Default)]
pub(crate) struct LimitColumns {
    pub(crate) instances: Vec<EightLimits>,
    /// Of all instances of a chunk.
    pub(crate) chunks: Vec<EightLimits>,
}

/// The limits of eight instances.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EightLimits {
    pub(crate) lowest: [f32; LANES],
    pub(crate) highest: [f32; LANES],
}

impl EightLimits {
    const EMPTY: Self = Self {
        lowest: [Limits::EMPTY.lowest; LANES],
        highest: [Limits::EMPTY.highest; LANES],
    };

    fn set(&mut self, lane: usize, limits: Limits) {
        (self.lowest[lane], self.highest[lane]) = (limits.lowest, limits.highest);
    }
}

impl LimitColumns {
    /// Resizes the columns to `count` instances.
    pub(crate) fn resize(&mut self, count: usize) {
        let elements = count.div_ceil(LANES);
        self.instances.resize(elements, EightLimits::EMPTY);
        let chunks = elements.div_ceil(CHUNK / LANES).div_ceil(LANES);
        self.chunks.resize(chunks, EightLimits::EMPTY);
    }

    pub(crate) fn set(&mut self, index: usize, limits: Limits) {
        self.instances[index / LANES].set(index % LANES, limits);
        self.end_chunk(index / CHUNK);
    }

    /// Makes the next pass test a chunk instance by instance.
    fn end_chunk(&mut self, chunk: usize) {
        self.chunks[chunk / LANES].set(chunk % LANES, Limits::UNKNOWN);
    }

    /// Recomputes the limits of a chunk; they are known only if all its instances are at their coarsest levels.
    pub(crate) fn refit(&mut self, chunk: usize) {
        let first = chunk * (CHUNK / LANES);
        let end = self.instances.len().min(first + CHUNK / LANES);
        let mut highest = f32x8::splat(f32::NEG_INFINITY);
        let mut are_coarsest = f32x8::infinity().is_at_most(f32x8::infinity());
        for eight in &self.instances[first..end] {
            // NaN must not get lost.
            let (lowest, other) = (f32x8::new(eight.lowest), f32x8::new(eight.highest));
            highest = f32x8::choose(other.is_at_most(highest), highest, other);
            are_coarsest &= f32x8::infinity().is_at_most(lowest) & other.is_at_most(other);
        }
        let limits = match bits_of(are_coarsest) {
            0xff => Limits {
                lowest: f32::INFINITY,
                highest: highest
                    .to_array()
                    .into_iter()
                    .fold(f32::NEG_INFINITY, f32::max),
            },
            _ => Limits::UNKNOWN,
        };
        self.chunks[chunk / LANES].set(chunk % LANES, limits);
    }

    pub(crate) fn clear(&mut self) {
        self.instances.clear();
        self.chunks.clear();
    }
}
