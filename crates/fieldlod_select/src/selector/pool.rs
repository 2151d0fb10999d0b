//! Slots that no instance has.

use super::slot::Slot;
use crate::table::GroupTable;

/// By size class: a slot that is used again is as large as any of its class, so that a frame allocates
/// only where more instances of a size are decided group by group than ever before.
#[derive(Debug, Default)]
pub(super) struct Pool {
    classes: Vec<Vec<Slot>>,
}

impl Pool {
    /// A slot with room for any cut of a mesh.
    pub(super) fn take(&mut self, table: &GroupTable) -> Slot {
        let class = table.size_class();
        let spare = self.classes.get_mut(class as usize).and_then(Vec::pop);
        spare.unwrap_or_else(|| Slot::of_class(class))
    }

    /// Takes a slot back, unless it is but the place of one that was taken out.
    pub(super) fn put(&mut self, slot: Slot) {
        if !slot.has_room() {
            return;
        }
        let class = slot.class() as usize;
        if self.classes.len() <= class {
            self.classes.resize_with(class + 1, Vec::new);
        }
        self.classes[class].push(slot);
    }

    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        let of_class =
            |slots: &Vec<Slot>| slots.capacity() + slots.iter().map(Slot::capacity).sum::<usize>();
        self.classes.iter().map(of_class).sum()
    }
}
