//! A number for every entity that this plugin draws, so that the lists of visible entities can be
//! edited with plain look-ups.

use bevy::prelude::*;

/// What an entity is to the plugin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SlotKind {
    /// Nobody's: to be given again.
    Free,
    /// A chain: draws what it wears, in all views.
    Whole,
    /// The source of units: drawn only where a view wants no cut.
    Source,
    /// A unit: drawn by the views whose cut it is in.
    Unit,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    pub(crate) kind: SlotKind,
    /// That the entity draws.
    pub(crate) triangles: u32,
    /// That it stands for, at full detail; 0 for units.
    pub(crate) triangles_full: u32,
    /// `None` until a unit is spawned.
    entity: Option<Entity>,
    /// How many views draw this unit.
    views: u32,
    /// The frame in which the last of them left.
    idle_since: u32,
    /// Of a unit: its instance's index and its index in the hierarchy.
    unit: (u32, u32),
}

/// All slots.
#[derive(Default)]
pub(crate) struct Slots {
    slots: Vec<Slot>,
    /// By entity index; `NO_SLOT` for all other entities.
    slot_of_entity: Vec<u32>,
    /// Freed, but perhaps still marked by a view.
    freed: Vec<u32>,
    free: Vec<u32>,
}

const NO_SLOT: u32 = u32::MAX;

impl Slots {
    /// A slot for `entity`, which stands for `triangles_full`.
    pub(crate) fn add_entity(&mut self, entity: Entity, kind: SlotKind, triangles_full: u32) {
        let slot = self.add(Slot {
            kind,
            triangles: triangles_full,
            triangles_full,
            entity: None,
            views: 0,
            idle_since: 0,
            unit: (u32::MAX, u32::MAX),
        });
        self.give_entity(slot, entity);
    }

    /// A slot for a unit that has no entity yet, by the index of its instance and its own.
    pub(crate) fn add_unit(&mut self, instance: u32, unit: u32, triangles: u32) -> u32 {
        self.add(Slot {
            kind: SlotKind::Unit,
            triangles,
            triangles_full: 0,
            entity: None,
            views: 0,
            idle_since: 0,
            unit: (instance, unit),
        })
    }

    fn add(&mut self, slot: Slot) -> u32 {
        if let Some(index) = self.free.pop() {
            self.slots[index as usize] = slot;
            return index;
        }
        self.slots.push(slot);
        self.slots.len() as u32 - 1
    }

    /// The slot of an entity, with its number.
    pub(crate) fn of(&self, entity: Entity) -> Option<(u32, &Slot)> {
        let slot = *self.slot_of_entity.get(entity.index_u32() as usize)?;
        (slot != NO_SLOT).then(|| (slot, &self.slots[slot as usize]))
    }

    pub(crate) fn give_entity(&mut self, slot: u32, entity: Entity) {
        let index = entity.index_u32() as usize;
        if self.slot_of_entity.len() <= index {
            self.slot_of_entity.resize(index + 1, NO_SLOT);
        }
        self.slot_of_entity[index] = slot;
        self.slots[slot as usize].entity = Some(entity);
    }

    /// The instance's index and the unit's.
    pub(crate) fn unit(&self, slot: u32) -> Option<(u32, u32)> {
        let slot = &self.slots[slot as usize];
        (slot.kind == SlotKind::Unit).then_some(slot.unit)
    }

    /// The entity that draws a unit, if it was spawned.
    pub(crate) fn entity(&self, slot: u32) -> Option<Entity> {
        self.slots[slot as usize].entity
    }

    /// Notes that `entity` draws so many triangles now.
    pub(crate) fn set_triangles(&mut self, entity: Entity, triangles: u32) {
        if let Some((slot, _)) = self.of(entity) {
            self.slots[slot as usize].triangles = triangles;
        }
    }

    /// The entity of a unit is gone, though its slot is not: what to spawn again.
    pub(crate) fn lose_entity(&mut self, entity: Entity) -> Option<u32> {
        let (slot, data) = self.of(entity)?;
        if data.kind != SlotKind::Unit || data.entity != Some(entity) {
            return None;
        }
        self.slots[slot as usize].entity = None;
        self.slot_of_entity[entity.index_u32() as usize] = NO_SLOT;
        Some(slot)
    }

    /// One more view draws this unit.
    pub(crate) fn enter(&mut self, slot: u32) {
        self.slots[slot as usize].views += 1;
    }

    /// One view less draws this unit; whether it was the last.
    pub(crate) fn leave(&mut self, slot: u32, frame: u32) -> bool {
        let slot = &mut self.slots[slot as usize];
        if slot.kind != SlotKind::Unit {
            return false;
        }
        slot.views = slot.views.saturating_sub(1);
        slot.idle_since = frame;
        slot.views == 0
    }

    pub(crate) fn is_idle_since(&self, slot: u32, frame: u32) -> bool {
        let slot = &self.slots[slot as usize];
        slot.kind == SlotKind::Unit && slot.views == 0 && slot.idle_since == frame
    }

    /// Takes a slot back, and the entity from it.
    pub(crate) fn free(&mut self, slot: u32) -> Option<Entity> {
        let data = &mut self.slots[slot as usize];
        data.kind = SlotKind::Free;
        self.freed.push(slot);
        let entity = data.entity.take()?;
        let of_entity = &mut self.slot_of_entity[entity.index_u32() as usize];
        if *of_entity == slot {
            *of_entity = NO_SLOT;
        }
        Some(entity)
    }

    /// Takes back the slot of an entity.
    pub(crate) fn free_entity(&mut self, entity: Entity) {
        if let Some((slot, _)) = self.of(entity) {
            self.free(slot);
        }
    }

    pub(crate) fn has_freed(&self) -> bool {
        !self.freed.is_empty()
    }

    /// The slots that views must forget before [`Slots::recycle`].
    pub(crate) fn freed(&self) -> &[u32] {
        &self.freed
    }

    pub(crate) fn recycle(&mut self) {
        self.free.append(&mut self.freed);
    }
}
