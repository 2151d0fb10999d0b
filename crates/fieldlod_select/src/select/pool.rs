//! Storage for the cuts of instances that are decided group by group.

use super::instance_cut::InstanceCut;
use crate::scene::table::GroupTable;

/// Cuts by key, and the keys that no instance has by the size class of their cuts: a cut that is used
/// again has as much room as any of its class, so that a frame allocates only where more instances of a
/// size are decided group by group than ever before.
#[derive(Debug, Default)]
pub(crate) struct Pool {
    cuts: Vec<InstanceCut>,
    free: Vec<Vec<u32>>,
}

impl Pool {
    /// The key of a cut with room for any of a mesh.
    pub(crate) fn make(&mut self, table: &GroupTable) -> u32 {
        let class = table.size_class();
        let free = self.free.get_mut(class as usize).and_then(Vec::pop);
        free.unwrap_or_else(|| {
            self.cuts.push(InstanceCut::of_class(class));
            self.cuts.len() as u32 - 1
        })
    }

    pub(crate) fn at(&self, key: u32) -> &InstanceCut {
        &self.cuts[key as usize]
    }

    pub(crate) fn at_mut(&mut self, key: u32) -> &mut InstanceCut {
        &mut self.cuts[key as usize]
    }

    /// Frees a key; its cut is used again.
    pub(crate) fn free(&mut self, key: u32) {
        let class = self.at(key).class() as usize;
        if self.free.len() <= class {
            self.free.resize_with(class + 1, Vec::new);
        }
        self.free[class].push(key);
    }

    /// Frees all keys.
    pub(crate) fn clear(&mut self) {
        self.free.iter_mut().for_each(Vec::clear);
        (0..self.cuts.len() as u32).for_each(|key| self.free(key));
    }

    #[cfg(test)]
    pub(crate) fn capacity(&self) -> usize {
        let free: usize = self.free.iter().map(Vec::capacity).sum();
        let cuts: usize = self.cuts.iter().map(InstanceCut::capacity).sum();
        self.cuts.capacity() + free + cuts
    }
}
