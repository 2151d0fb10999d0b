//! Slots whose instances have changed, in order. Each selector continues from the revision that it read last.

use super::columns::truncate;

/// Number of changes that are always kept. With fewer, selectors of small scenes often look at every instance.
const FEW: usize = 1024;

#[derive(Clone, Debug, Default)]
pub(crate) struct Journal {
    changed: Vec<u32>,
    /// Number of changes dropped from the front.
    dropped: u64,
}

impl Journal {
    pub(crate) fn push(&mut self, slot: u32) {
        self.changed.push(slot);
    }

    /// Keeps the last `instance_count` changes if there are twice as many. A selector that needs older changes looks at
    /// every instance, which is faster.
    pub(crate) fn trim(&mut self, instance_count: usize) {
        let most = instance_count.max(FEW);
        if self.changed.len() > most * 2 {
            let dropped = self.changed.len() - most;
            self.changed.drain(..dropped);
            truncate(&mut self.changed, most);
            self.dropped += dropped as u64;
        }
    }

    /// Number of changes so far.
    pub(crate) fn revision(&self) -> u64 {
        self.dropped + self.changed.len() as u64
    }

    /// The changes since a revision; `None` if some of them were dropped.
    pub(crate) fn since(&self, revision: u64) -> Option<&[u32]> {
        let first = revision.checked_sub(self.dropped)?;
        self.changed.get(first as usize..)
    }
}
