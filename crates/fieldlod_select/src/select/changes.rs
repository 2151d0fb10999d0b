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
    /// Instances that enter with the coarsest units of their meshes, before all other changes.
    at_coarsest: Vec<(InstanceId, MeshId)>,
    others: Vec<RawChange>,
    /// The units of all changes. The first are 0, 1, 2 …: those of whole meshes by their levels.
    units: Vec<u32>,
    /// By mesh, the range of its coarsest units in `units`: one copy is enough for all instances.
    coarsest: Vec<Range<u32>>,
}

impl Changes {
    pub(crate) fn clear(&mut self) {
        self.at_coarsest.clear();
        self.others.clear();
        self.units.truncate(CHUNK);
        if self.units.is_empty() {
            self.units.extend(0..CHUNK as u32);
        }
        self.coarsest.clear();
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Change<'_>> {
        let part = |range: &Range<u32>| &self.units[range.start as usize..range.end as usize];
        let at_coarsest = self
            .at_coarsest
            .iter()
            .map(move |&(instance, mesh)| Change {
                instance,
                entered: part(&self.coarsest[mesh.index()]),
                left: &[],
            });
        let others = self.others.iter().map(move |change| Change {
            instance: change.instance,
            entered: part(&change.entered),
            left: part(&change.left),
        });
        at_coarsest.chain(others)
    }

    /// An instance enters with the coarsest units of its mesh. No other change of it may come before.
    pub(crate) fn enter(&mut self, instance: InstanceId, mesh: MeshId, table: &GroupTable) {
        let index = mesh.index();
        if self.coarsest.len() <= index {
            self.coarsest.resize(index + 1, 0..0);
        }
        if self.coarsest[index].is_empty() {
            let first = self.units.len() as u32;
            self.units.extend_from_slice(&table.coarsest_units);
            self.coarsest[index] = first..self.units.len() as u32;
        }
        if !table.coarsest_units.is_empty() {
            self.at_coarsest.push((instance, mesh));
        }
    }

    /// A whole mesh went from one level to another.
    pub(crate) fn change_level(&mut self, instance: InstanceId, before: u32, now: u32) {
        self.others.push(RawChange {
            instance,
            entered: now..now + 1,
            left: before..before + 1,
        });
    }

    /// The cut of an instance went from `before` to `now`, both ascending.
    pub(crate) fn record(&mut self, instance: InstanceId, before: &[u32], now: &[u32]) {
        let entered = self.append_difference(now, before);
        let left = self.append_difference(before, now);
        if !(entered.is_empty() && left.is_empty()) {
            self.others.push(RawChange {
                instance,
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
