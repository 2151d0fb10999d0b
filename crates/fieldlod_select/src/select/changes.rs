//! Changes of the last selection.

use std::ops::Range;

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
    entered: Vec<u32>,
    left: Vec<u32>,
    /// By mesh, where in `entered` its coarsest units stand, if an instance has entered with them:
    /// one copy is enough for all.
    coarsest: Vec<Range<u32>>,
}

impl Changes {
    pub(crate) fn clear(&mut self) {
        self.all.clear();
        self.entered.clear();
        self.left.clear();
        self.coarsest.clear();
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Change<'_>> {
        self.all.iter().flat_map(move |change| {
            let InstanceId { index, generation } = change.instance;
            let part = |range: &Range<u32>| range.start as usize..range.end as usize;
            let (entered, left) = (part(&change.entered), part(&change.left));
            (index..index + change.count).map(move |index| Change {
                instance: InstanceId { index, generation },
                entered: &self.entered[entered.clone()],
                left: &self.left[left.clone()],
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
        let first = self.entered.len() as u32;
        self.entered.extend_from_slice(coarsest);
        let range = first..self.entered.len() as u32;
        let count = self.coarsest.len().max(mesh.index() + 1);
        self.coarsest.resize(count, 0..0);
        self.coarsest[mesh.index()] = range.clone();
        range
    }

    /// The cut of an instance went from `before` to `now`, both ascending.
    pub(crate) fn record(&mut self, instance: InstanceId, before: &[u32], now: &[u32]) {
        let Self {
            all, entered, left, ..
        } = self;
        // The two lists of units, and where in them this change begins.
        let (first_entered, first_left) = (entered.len(), left.len());
        if before.is_empty() {
            entered.extend_from_slice(now);
        } else {
            entered_and_left(before, now, entered, left);
        }
        if entered.len() > first_entered || left.len() > first_left {
            all.push(RawChange {
                instance,
                count: 1,
                entered: first_entered as u32..entered.len() as u32,
                left: first_left as u32..left.len() as u32,
            });
        }
    }
}

/// The two differences of two ascending lists, appended.
fn entered_and_left(before: &[u32], now: &[u32], entered: &mut Vec<u32>, left: &mut Vec<u32>) {
    let (mut before, mut now) = (before.iter().peekable(), now.iter().peekable());
    loop {
        match (before.peek(), now.peek()) {
            (Some(&&b), Some(&&n)) if b == n => {
                before.next();
                now.next();
            }
            (Some(&&b), Some(&&n)) if b < n => left.extend(before.next_if_eq(&&b)),
            (Some(_), None) => left.extend(before.next()),
            (_, Some(_)) => entered.extend(now.next()),
            (None, None) => return,
        }
    }
}
