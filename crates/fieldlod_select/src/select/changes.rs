//! Changes of the last selection.

use std::ops::Range;

use crate::lanes::bits::CHUNK;
use crate::scene::{InstanceId, Scene};

/// Change of the cut of one instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change<'a> {
    /// The instance.
    pub instance: InstanceId,
    /// Units that this change adds to the cut, ascending.
    pub entered: &'a [u32],
    /// Units that this change removes from the cut, ascending.
    pub left: &'a [u32],
}

/// The change of one instance, as ranges of `Changes::units`.
#[derive(Clone, Debug)]
struct RawChange {
    instance: InstanceId,
    entered: Range<u32>,
    left: Range<u32>,
}

/// All changes of one selection.
#[derive(Debug, Default)]
pub(crate) struct Changes {
    all: Vec<RawChange>,
    /// The units of all changes. The first units are 0, 1, 2 …; changes from one unit below 64 to another use these.
    units: Vec<u32>,
    /// The coarsest units of all meshes, only after a first frame, whose changes are the cuts.
    pub(super) coarsest: Option<Vec<Vec<u32>>>,
}

impl Changes {
    pub(crate) fn clear(&mut self) {
        self.all.clear();
        self.units.truncate(CHUNK);
        if self.units.is_empty() {
            self.units.extend(0..CHUNK as u32);
        }
        self.coarsest = None;
    }

    /// Starts a first frame.
    pub(crate) fn begin_first(&mut self, scene: &Scene) {
        // Copies, because the scene may have removed a mesh by the time the changes are read.
        let coarsest = scene.tables().map(|table| table.coarsest_units.clone());
        self.coarsest = Some(coarsest.collect());
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Change<'_>> {
        let part = |range: &Range<u32>| &self.units[range.start as usize..range.end as usize];
        self.all.iter().map(move |change| Change {
            instance: change.instance,
            entered: part(&change.entered),
            left: part(&change.left),
        })
    }

    /// Records that the cut of an instance changed from `before` to `now`, both ascending.
    pub(crate) fn record(&mut self, instance: InstanceId, before: &[u32], now: &[u32]) {
        if self.coarsest.is_some() {
            return;
        }
        let (entered, left) = match (before, now) {
            // A whole mesh changes its level.
            (&[before], &[now]) if before != now && before.max(now) < CHUNK as u32 => {
                (now..now + 1, before..before + 1)
            }
            _ => (
                self.append_difference(now, before),
                self.append_difference(before, now),
            ),
        };
        if !(entered.is_empty() && left.is_empty()) {
            self.all.push(RawChange {
                instance,
                entered,
                left,
            });
        }
    }

    /// Appends the numbers of one ascending list that are not in another ascending list.
    fn append_difference(&mut self, list: &[u32], other: &[u32]) -> Range<u32> {
        let first = self.units.len() as u32;
        let mut other = other.iter().peekable();
        let is_missing = |unit: &u32| {
            while other.next_if(|other| *other < unit).is_some() {}
            other.peek() != Some(&unit)
        };
        self.units.extend(list.iter().copied().filter(is_missing));
        first..self.units.len() as u32
    }
}
