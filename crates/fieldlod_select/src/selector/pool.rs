//! Storage for the cuts of instances that are decided group by group.

use super::instance_cut::InstanceCut;
use crate::table::GroupTable;

/// Cuts by key, and by size class those that no instance has: a cut that is used again has as much room
/// as any of its class, so that a frame allocates only where more instances of a size are decided group
/// by group than ever before.
///
/// Boxed, since they move in and out.
#[derive(Debug, Default)]
pub(super) struct Pool {
    /// `None` while an instance is being decided, and for free keys.
    cuts: Vec<Option<Box<InstanceCut>>>,
    free: Vec<usize>,
    spare: Vec<Spare>,
}

type Spare = Vec<Box<InstanceCut>>;

impl Pool {
    /// A cut with room for any of a mesh, and no key.
    pub(super) fn make(&mut self, table: &GroupTable) -> Box<InstanceCut> {
        let class = table.size_class();
        let spare = self.spare.get_mut(class as usize).and_then(Vec::pop);
        spare.unwrap_or_else(|| Box::new(InstanceCut::of_class(class)))
    }

    /// Gives a cut a key.
    pub(super) fn insert(&mut self, cut: Box<InstanceCut>) -> u32 {
        let key = self.free.pop().unwrap_or(self.cuts.len());
        if key == self.cuts.len() {
            self.cuts.push(None);
        }
        self.cuts[key] = Some(cut);
        key as u32
    }

    pub(super) fn at(&self, key: u32) -> &InstanceCut {
        let cut = self.cuts[key as usize].as_deref();
        cut.expect("a key in use has a cut between frames")
    }

    /// Takes a cut out for a while.
    pub(super) fn take(&mut self, key: u32) -> Box<InstanceCut> {
        let cut = self.cuts[key as usize].take();
        cut.expect("a key in use has a cut between frames")
    }

    pub(super) fn put_back(&mut self, key: u32, cut: Box<InstanceCut>) {
        self.cuts[key as usize] = Some(cut);
    }

    /// Frees a key; its cut is used again.
    pub(super) fn free(&mut self, key: u32) {
        let cut = self.take(key);
        self.free.push(key as usize);
        self.put_aside(cut);
    }

    fn put_aside(&mut self, cut: Box<InstanceCut>) {
        let class = cut.class() as usize;
        if self.spare.len() <= class {
            self.spare.resize_with(class + 1, Vec::new);
        }
        self.spare[class].push(cut);
    }

    /// Frees all keys.
    pub(super) fn clear(&mut self) {
        while let Some(cut) = self.cuts.pop() {
            cut.into_iter().for_each(|cut| self.put_aside(cut));
        }
        self.free.clear();
    }

    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        let in_use = self.cuts.iter().flatten();
        let cuts = in_use.chain(self.spare.iter().flatten());
        self.cuts.capacity()
            + self.free.capacity()
            + self.spare.iter().map(Vec::capacity).sum::<usize>()
            + cuts.map(|cut| cut.capacity()).sum::<usize>()
    }
}
