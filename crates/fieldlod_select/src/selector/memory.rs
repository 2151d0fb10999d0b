//! What a selector keeps between frames.

use super::slot::Slot;
use crate::decide::ViewParts;
use crate::hold::{Hold, Odometer, WholeTest};
use crate::scene::Scene;
use crate::{LodSettings, MeshId, View};

/// All that a cut depends on, but for its memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) view: View,
    pub(super) settings: LodSettings,
    pub(super) revision: u64,
    pub(super) tree_revision: u64,
}

/// What cuts are decided with in one frame.
#[derive(Clone, Copy)]
pub(super) struct Moment<'a> {
    pub(super) view: &'a View,
    pub(super) parts: &'a ViewParts,
    pub(super) settings: &'a LodSettings,
    pub(super) test: &'a WholeTest<'a>,
    pub(super) now: Odometer,
    /// What the odometer went last.
    pub(super) step: Odometer,
}

/// What an instance draws.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Memory {
    pub(super) state: State,
    /// Which of the instances that had the index one after the other.
    pub(super) generation: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum State {
    /// Not selected yet, or removed: draws nothing.
    #[default]
    Empty,
    /// Only what always is refined is refined. The scene may have removed the instance since.
    Coarsest(MeshId),
    /// A cut of its own, in a slot.
    Mixed(u32),
}

#[derive(Clone, Copy, Debug)]
pub(super) struct NodeMemory {
    pub(super) hold: Hold,
    /// All instances below are empty or at their coarsest.
    pub(super) is_coarsest: bool,
}

/// An instance to be decided group by group.
#[derive(Debug)]
pub(super) struct Pending {
    pub(super) instance: u32,
    pub(super) was: State,
    /// Whether the instance has changed since it was decided last.
    pub(super) has_moved: bool,
    pub(super) slot: Box<Slot>,
}

impl Pending {
    pub(super) fn decide(&mut self, scene: &Scene, moment: &Moment) {
        let index = self.instance as usize;
        let Some(mesh) = scene.occupants[index].mesh else {
            return;
        };
        let (table, instance) = (scene.table(mesh), &scene.instances[index]);
        match self.was {
            State::Mixed(_) => self
                .slot
                .decide_again(table, instance, moment, self.has_moved),
            _ => self.slot.decide(table, instance, moment),
        }
    }
}

impl State {
    pub(super) fn slot(self) -> Option<u32> {
        match self {
            Self::Mixed(slot) => Some(slot),
            _ => None,
        }
    }
}

impl NodeMemory {
    pub(super) fn new(is_coarsest: bool) -> Self {
        Self {
            hold: Hold::NONE,
            is_coarsest,
        }
    }
}

pub(super) fn coarsest_of(scene: &Scene, state: State) -> (&[u32], u64) {
    match state {
        State::Coarsest(mesh) => {
            let table = scene.table(mesh);
            (&table.coarsest_units, table.coarsest_triangle_count)
        }
        _ => (&[], 0),
    }
}
