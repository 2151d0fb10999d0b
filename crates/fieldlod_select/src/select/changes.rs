//! Changes of the last selection.

use std::ops::Range;

use crate::lanes::bits::CHUNK;
use crate::scene::table::GroupTable;
use crate::scene::{InstanceId, MeshId};

/// Change of the cut of one instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change<'a> {
    /// The instance.
    pub instance: InstanceId,
    /// Units drawn now and not before, ascending.
    pub entered: &'a [u32],
    /// Units drawn before and not now, ascending.
    pub left: &'a [u32],
}

/// The same change of `count` instances with indices that follow each other.
#[derive(Clone, Debug)]
struct RawChange {
    instance: InstanceId,
    count: u32,
    entered: Range<u32>,
    left: Range<u32>,
}

/// All changes of one selection.
#[derive(Debug, Default)]
pub(crate) struct Changes {
    all: Vec<RawChange>,
    /// The units of all changes. The first are 0, 1, 2 …: those of whole meshes by their levels.
    units: Vec<u32>,
    /// By mesh, where in `units` its coarsest units stand, if an instance has entered with them:
    /// one copy is enough for all.
    coarsest: Vec<Range<u32>>,
}

impl Changes {
    pub(crate) fn clear(&mut self) {
        self.all.clear();
        self.units.truncate(CHUNK);
        if self.units.is_empty() {
            self.units.extend(0..CHUNK as u32);
        }
        self.coarsest.clear();
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Change<'_>> {
        self.all.iter().flat_map(move |change| {
            let InstanceId { index, generation } = change.instance;
            let part = |range: &Range<u32>| &self.units[range.start as usize..range.end as usize];
            (index..index + change.count).map(move |index| Change {
                instance: InstanceId { index, generation },
                entered: part(&change.entered),
                left: part(&change.left),
            })
        })
    }

    /// `count` instances enter with the coarsest units of their mesh: `first`, and those that follow it.
    pub(crate) fn enter(
        &mut self,
        first: InstanceId,
        count: u32,
        mesh: MeshId,
        table: &GroupTable,
    ) {
        // The first instance of a mesh brings the list of units, the others share it.
        let entered = match self.coarsest.get(mesh.index()) {
            Some(range) if !range.is_empty() => range.clone(),
            _ => self.copy_coarsest(mesh, &table.coarsest_units),
        };
        if count > 0 && !entered.is_empty() {
            self.all.push(RawChange {
                instance: first,
                count,
                entered,
                left: 0..0,
            });
        }
    }

    fn copy_coarsest(&mut self, mesh: MeshId, coarsest: &[u32]) -> Range<u32> {
        let first = self.units.len() as u32;
        self.units.extend_from_slice(coarsest);
        let range = first..self.units.len() as u32;
        let count = self.coarsest.len().max(mesh.index() + 1);
        self.coarsest.resize(count, 0..0);
        self.coarsest[mesh.index()] = range.clone();
        range
    }

    /// A whole mesh went from one level to another.
    pub(crate) fn change_level(&mut self, instance: InstanceId, before: u32, now: u32) {
        self.all.push(RawChange {
            instance,
            count: 1,
            entered: now..now + 1,
            left: before..before + 1,
        });
    }

    /// The cut of an instance went from `before` to `now`, both ascending.
    pub(crate) fn record(&mut self, instance: InstanceId, before: &[u32], now: &[u32]) {
        let entered = self.append_difference(now, before);
        let left = self.append_difference(before, now);
        if !(entered.is_empty() && left.is_empty()) {
            self.all.push(RawChange {
                instance,
                count: 1,
                entered,
                left,
            });
        }
    }

    /// Appends the numbers of one ascending list that are not in another one.
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
