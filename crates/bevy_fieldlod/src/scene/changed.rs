//! Finds entities on which a component has changed, many at a time.
//!
//! Bevy's `Changed` filter checks entity by entity. In most frames nearly all entities are unchanged, and checking a
//! row of change ticks at once is several times faster.

use bevy::ecs::change_detection::{ContiguousComponentTicksRef, ContiguousRef, Tick};
use bevy::ecs::query::{ArchetypeFilter, QueryFilter};
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;

/// Entities that are checked at once: four cache lines of ticks. A row with a change is then checked entity by entity,
/// which costs more with longer rows. Shorter rows gain less from vector instructions.
const ROW: usize = 64;

/// Finds the entities on which a component has changed since the system last ran.
#[derive(SystemParam)]
pub(crate) struct ChangedOn<'w, 's, C: Component, F: QueryFilter + 'static = ()> {
    all: Query<'w, 's, (Entity, Ref<'static, C>), F>,
}

impl<C: Component, F: ArchetypeFilter + 'static> ChangedOn<'_, '_, C, F> {
    /// Appends the entities on which the component has changed.
    pub(crate) fn add_to(&self, changed: &mut Vec<Entity>) {
        let Ok(tables) = self.all.contiguous_iter() else {
            // Only tables have change ticks in rows: this is a component with sparse storage.
            let all = self.all.iter().filter(|(_, one)| one.is_changed());
            return changed.extend(all.map(|(entity, _)| entity));
        };
        for (entities, components) in tables {
            let (_, ticks) = ContiguousRef::split(components);
            for_each_changed(&ticks, |index| changed.push(entities[index]));
        }
    }

    /// The entities on which the component has changed.
    pub(crate) fn entities(&self) -> Vec<Entity> {
        let mut changed = Vec::new();
        self.add_to(&mut changed);
        changed
    }
}

/// Calls `visit` with the index of each component of a table that has changed.
pub(crate) fn for_each_changed(ticks: &ContiguousComponentTicksRef, mut visit: impl FnMut(usize)) {
    let is_new = |tick: &Tick| tick.is_newer_than(ticks.last_run(), ticks.this_run());
    for (row, ticks) in ticks.changed().chunks(ROW).enumerate() {
        // Without an early exit, the compiler vectorises the loop.
        if ticks.iter().fold(false, |any, tick| any | is_new(tick)) {
            let changed = ticks.iter().enumerate().filter(|(_, tick)| is_new(tick));
            changed.for_each(|(index, _)| visit(row * ROW + index));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Component)]
    struct Number(u32);

    #[derive(Component)]
    struct Marked;

    #[derive(Resource, Default)]
    struct Found([Vec<Entity>; 2]);

    fn find(
        rows: ChangedOn<Number, Without<Marked>>,
        filtered: Query<Entity, (Changed<Number>, Without<Marked>)>,
        mut found: ResMut<Found>,
    ) {
        found.0 = [rows.entities(), filtered.iter().collect()];
    }

    #[test]
    fn finds_same_entities_as_changed_filter() {
        let mut app = App::new();
        app.init_resource::<Found>().add_systems(Update, find);
        let world = app.world_mut();
        let numbers: Vec<Entity> = (0..500).map(|i| world.spawn(Number(i)).id()).collect();
        for &entity in numbers.iter().step_by(11) {
            world.entity_mut(entity).insert(Marked);
        }
        // All are new, then some change, of which every eleventh is filtered out.
        let steps: [(&[usize], usize); 3] = [(&[], 454), (&[], 0), (&[1, 2, 11, 64, 200, 499], 5)];
        for (changed, expected) in steps {
            for &index in changed {
                app.world_mut().get_mut::<Number>(numbers[index]).unwrap().0 += 1;
            }
            app.update();
            let [rows, filtered] = &app.world().resource::<Found>().0;
            assert_eq!(rows, filtered);
            assert_eq!(rows.len(), expected);
        }
    }
}
