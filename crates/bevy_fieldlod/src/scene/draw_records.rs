//! A numbered record for every entity that the plugin draws. Filtering the lists of visible entities is then a
//! look-up by index.

use bevy::prelude::*;

/// How an entity is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum DrawKind {
    /// The record is not in use.
    #[default]
    Free,
    /// A whole mesh at one level, drawn in all views.
    WholeMesh,
    /// The source of units: drawn by the views without a cut.
    Source,
    /// A unit: drawn by the views whose cut it is in.
    Unit {
        /// The index of its instance.
        instance: u32,
        /// Its index in the hierarchy.
        unit: u32,
    },
}

/// How one entity is drawn.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DrawRecord {
    pub(crate) kind: DrawKind,
    /// `None` until a unit is spawned.
    entity: Option<Entity>,
    /// Number of views that draw this unit.
    view_count: u32,
    /// The frame in which the last view stopped drawing this unit.
    idle_since: u32,
}

/// All records.
#[derive(Default)]
pub(crate) struct DrawRecords {
    records: Vec<DrawRecord>,
    /// Indexed by [`Entity::index_u32`]; `NO_RECORD` for entities without a record.
    record_of_entity: Vec<u32>,
    /// Freed records whose numbers some view may still count as visible.
    freed: Vec<u32>,
    /// Records to reuse.
    free: Vec<u32>,
    /// How many units have a record, and how many of these units no view draws.
    unit_count: usize,
    idle_count: usize,
    /// Records of units and of their sources that got an entity, and entities that lost their record, since the
    /// last call of [`DrawRecords::take_moves`].
    placed: Vec<u32>,
    dropped: Vec<Entity>,
}

const NO_RECORD: u32 = u32::MAX;

impl DrawRecords {
    /// Adds a record for `entity`.
    pub(crate) fn add_entity(&mut self, entity: Entity, kind: DrawKind) {
        let record = self.add(DrawRecord { kind, ..default() });
        self.set_entity(record, entity);
    }

    /// Adds a record for a unit that has no entity yet, and returns its number.
    pub(crate) fn add_unit(&mut self, instance: u32, unit: u32) -> u32 {
        self.unit_count += 1;
        self.idle_count += 1;
        self.add(DrawRecord {
            kind: DrawKind::Unit { instance, unit },
            ..default()
        })
    }

    fn add(&mut self, record: DrawRecord) -> u32 {
        // Reusing numbers bounds the length of the lists of views.
        if let Some(index) = self.free.pop() {
            self.records[index as usize] = record;
            return index;
        }
        self.records.push(record);
        self.records.len() as u32 - 1
    }

    /// The number and the record of an entity.
    pub(crate) fn find(&self, entity: Entity) -> Option<(u32, &DrawRecord)> {
        let index = *self.record_of_entity.get(entity.index_u32() as usize)?;
        let record = self.records.get(index as usize)?;
        // Bevy reuses the indices of despawned entities.
        (record.entity == Some(entity)).then_some((index, record))
    }

    /// Sets the entity that draws a record.
    pub(crate) fn set_entity(&mut self, record: u32, entity: Entity) {
        let index = entity.index_u32() as usize;
        if self.record_of_entity.len() <= index {
            self.record_of_entity.resize(index + 1, NO_RECORD);
        }
        self.record_of_entity[index] = record;
        self.records[record as usize].entity = Some(entity);
        // All views draw whole meshes, so their lists need no changes by this crate.
        if self.records[record as usize].kind != DrawKind::WholeMesh {
            self.placed.push(record);
        }
    }

    /// Returns the records of units and of their sources that got an entity since the last call, and the entities
    /// that lost their record.
    pub(crate) fn take_moves(&mut self) -> (Vec<u32>, Vec<Entity>) {
        (
            std::mem::take(&mut self.placed),
            std::mem::take(&mut self.dropped),
        )
    }

    /// The indices of the instance and of the unit; `None` unless the record is that of a unit.
    pub(crate) fn unit(&self, record: u32) -> Option<(u32, u32)> {
        match self.records[record as usize].kind {
            DrawKind::Unit { instance, unit } => Some((instance, unit)),
            _ => None,
        }
    }

    /// Whether the record is that of a source of units.
    pub(crate) fn is_source(&self, record: u32) -> bool {
        self.records[record as usize].kind == DrawKind::Source
    }

    /// The entity of a record, if it was spawned.
    pub(crate) fn entity(&self, record: u32) -> Option<Entity> {
        self.records[record as usize].entity
    }

    /// Detaches the despawned entity of a unit from its record, and returns the record.
    pub(crate) fn detach_entity(&mut self, entity: Entity) -> Option<u32> {
        let (index, _) = self.find(entity)?;
        // Only units are spawned again.
        self.unit(index)?;
        self.records[index as usize].entity = None;
        self.dropped.push(entity);
        self.record_of_entity[entity.index_u32() as usize] = NO_RECORD;
        Some(index)
    }

    /// Counts one more view that draws this unit.
    pub(crate) fn enter_view(&mut self, record: u32) {
        let record = &mut self.records[record as usize];
        self.idle_count -= usize::from(record.view_count == 0);
        record.view_count += 1;
    }

    /// Counts one view fewer that draws this unit, and returns whether it was the last.
    pub(crate) fn leave_view(&mut self, record: u32, frame: u32) -> bool {
        let record = &mut self.records[record as usize];
        record.view_count -= 1;
        record.idle_since = frame;
        // A view may leave a unit after its object was removed.
        let is_idle = record.view_count == 0 && matches!(record.kind, DrawKind::Unit { .. });
        self.idle_count += usize::from(is_idle);
        is_idle
    }

    /// The number of units that views draw, and of those that no view draws.
    pub(crate) fn drawn_and_idle(&self) -> (usize, usize) {
        (self.unit_count - self.idle_count, self.idle_count)
    }

    /// Whether the record is that of a unit that no view draws.
    pub(crate) fn is_idle(&self, record: u32) -> bool {
        self.unit(record).is_some() && self.records[record as usize].view_count == 0
    }

    /// Whether no view has drawn this unit since `frame`.
    pub(crate) fn is_idle_since(&self, record: u32, frame: u32) -> bool {
        self.is_idle(record) && self.records[record as usize].idle_since == frame
    }

    /// Frees a record and returns the entity that it had.
    pub(crate) fn free(&mut self, index: u32) -> Option<Entity> {
        let record = &mut self.records[index as usize];
        if let DrawKind::Unit { .. } = record.kind {
            self.unit_count -= 1;
            self.idle_count -= usize::from(record.view_count == 0);
        }
        record.kind = DrawKind::Free;
        self.freed.push(index);
        let entity = record.entity.take()?;
        self.dropped.push(entity);
        // A later entity may have reused the index.
        let record_of_entity = &mut self.record_of_entity[entity.index_u32() as usize];
        if *record_of_entity == index {
            *record_of_entity = NO_RECORD;
        }
        Some(entity)
    }

    /// Frees the record of an entity.
    pub(crate) fn free_entity(&mut self, entity: Entity) {
        if let Some((record, _)) = self.find(entity) {
            self.free(record);
        }
    }

    /// The records that views must clear before [`DrawRecords::recycle`].
    pub(crate) fn freed(&self) -> &[u32] {
        &self.freed
    }

    /// Makes freed records available for reuse.
    pub(crate) fn recycle(&mut self) {
        self.free.append(&mut self.freed);
    }
}
