//! The slots of instances that are decided group by group.

use super::slot::Slot;
use crate::table::GroupTable;

/// Slots by place, and those that no instance has by size class: a slot that is used again is as large as
/// any of its class, so that a frame allocates only where more instances of a size are decided group by
/// group than ever before.
///
/// Boxed, since they move in and out.
#[derive(Debug, Default)]
pub(super) struct Pool {
    /// `None` where an instance is being decided, and at free places.
    places: Vec<Option<Box<Slot>>>,
    free: Vec<usize>,
    spare: Vec<Spare>,
}

type Spare = Vec<Box<Slot>>;

impl Pool {
    /// A slot with room for any cut of a mesh, and no place.
    pub(super) fn make(&mut self, table: &GroupTable) -> Box<Slot> {
        let class = table.size_class();
        let spare = self.spare.get_mut(class as usize).and_then(Vec::pop);
        spare.unwrap_or_else(|| Box::new(Slot::of_class(class)))
    }

    /// Gives a slot a place.
    pub(super) fn place(&mut self, slot: Box<Slot>) -> u32 {
        let place = self.free.pop().unwrap_or(self.places.len());
        if place == self.places.len() {
            self.places.push(None);
        }
        self.places[place] = Some(slot);
        place as u32
    }

    pub(super) fn at(&self, place: u32) -> &Slot {
        let slot = self.places[place as usize].as_deref();
        slot.expect("a place in use has a slot between frames")
    }

    /// Takes a slot out for a while.
    pub(super) fn take(&mut self, place: u32) -> Box<Slot> {
        let slot = self.places[place as usize].take();
        slot.expect("a place in use has a slot between frames")
    }

    pub(super) fn put_back(&mut self, place: u32, slot: Box<Slot>) {
        self.places[place as usize] = Some(slot);
    }

    /// Frees a place; its slot is used again.
    pub(super) fn free(&mut self, place: u32) {
        let slot = self.take(place);
        self.free.push(place as usize);
        self.put_aside(slot);
    }

    fn put_aside(&mut self, slot: Box<Slot>) {
        let class = slot.class() as usize;
        if self.spare.len() <= class {
            self.spare.resize_with(class + 1, Vec::new);
        }
        self.spare[class].push(slot);
    }

    /// Frees all places.
    pub(super) fn clear(&mut self) {
        while let Some(place) = self.places.pop() {
            place.into_iter().for_each(|slot| self.put_aside(slot));
        }
        self.free.clear();
    }

    #[cfg(test)]
    pub(super) fn capacity(&self) -> usize {
        let slots = self
            .places
            .iter()
            .flatten()
            .chain(self.spare.iter().flatten());
        self.places.capacity()
            + self.free.capacity()
            + self.spare.iter().map(Vec::capacity).sum::<usize>()
            + slots.map(|slot| slot.capacity()).sum::<usize>()
    }
}
