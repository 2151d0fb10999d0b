//! What a selector keeps between frames.

use std::ops::Range;

use super::slot::{Slot, entered_and_left};
use crate::hold::Hold;
use crate::scene::Scene;
use crate::{InstanceId, LodSettings, MeshId, View};

/// All that a cut depends on, but for its memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) view: View,
    pub(super) settings: LodSettings,
    pub(super) revision: u64,
    pub(super) tree_revision: u64,
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
    pub(super) slot: Slot,
}

#[derive(Clone, Debug)]
pub(super) struct RawChange {
    pub(super) instance: InstanceId,
    pub(super) entered: Range<u32>,
    pub(super) left: Range<u32>,
}

/// What changed in the cut of one instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change<'a> {
    /// The instance.
    pub instance: InstanceId,
    /// Units drawn now and not before, ascending.
    pub entered: &'a [u32],
    /// Units drawn before and not now, ascending.
    pub left: &'a [u32],
}

impl State {
    pub(super) fn slot(self) -> Option<usize> {
        match self {
            Self::Mixed(slot) => Some(slot as usize),
            _ => None,
        }
    }
}

impl Default for NodeMemory {
    fn default() -> Self {
        Self {
            hold: Hold::NONE,
            is_coarsest: false,
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

pub(super) fn record(
    changes: &mut Vec<RawChange>,
    entered: &mut Vec<u32>,
    left: &mut Vec<u32>,
    instance: InstanceId,
    before: &[u32],
    now: &[u32],
) {
    let (first_entered, first_left) = (entered.len(), left.len());
    if before.is_empty() {
        entered.extend_from_slice(now);
    } else {
        entered_and_left(before, now, entered, left);
    }
    if entered.len() > first_entered || left.len() > first_left {
        changes.push(RawChange {
            instance,
            entered: first_entered as u32..entered.len() as u32,
            left: first_left as u32..left.len() as u32,
        });
    }
}
