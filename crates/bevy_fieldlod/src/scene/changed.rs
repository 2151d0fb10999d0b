//! Finds entities on which a component has changed, many at a time.
//!
//! A filter asks entity by entity. Where nothing has changed, as is so for nearly all entities in nearly all
//! frames, it is several times faster to ask a row of them for any change.

use bevy::ecs::change_detection::{ContiguousRef, Tick};
use bevy::ecs::query::{ArchetypeFilter, QueryFilter};
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;

/// Entities that are asked at once.
const ROW: usize = 64;

/// Entities with a component, of which those are found on which it has changed since the system last ran.
#[derive(SystemParam)]
pub(crate) struct ChangedOn<'w, 's, C: Component, F: QueryFilter + 'static = ()> {
    all: Query<'w, 's, (Entity, Ref<'static, C>), F>,
}

impl<C: Component, F: ArchetypeFilter + 'static> ChangedOn<'_, '_, C, F> {
    /// Appends the entities on which the component has changed.
    pub(crate) fn add_to(&self, changed: &mut Vec<Entity>) {
        let Ok(tables) = self.all.contiguous_iter() else {
            // Components that do not lie in rows.
            let all = self.all.iter().filter(|(_, one)| one.is_changed());
            return changed.extend(all.map(|(entity, _)| entity));
        };
        for (entities, components) in tables {
            let (_, ticks) = ContiguousRef::split(components);
            let is_new = |tick: &Tick| tick.is_newer_than(ticks.last_run(), ticks.this_run());
            let rows = entities.chunks(ROW).zip(ticks.changed().chunks(ROW));
            for (entities, ticks) in rows {
                // No early end: all at once are faster than one by one.
                if ticks.iter().fold(false, |any, tick| any | is_new(tick)) {
                    let pairs = entities.iter().zip(ticks);
                    changed.extend(pairs.filter(|(_, tick)| is_new(tick)).map(|(one, _)| *one));
                }
            }
        }
    }

    /// The entities on which the component has changed.
    pub(crate) fn entities(&self) -> Vec<Entity> {
        let mut changed = Vec::new();
        self.add_to(&mut changed);
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Component)]
    struct Number(u32);

    #[derive(Component)]
    #[component(storage = "SparseSet")]
    struct Apart(u32);

    #[derive(Component)]
    struct Marked;

    #[derive(Resource, Default)]
    struct Found(Vec<Vec<Entity>>);

    fn find(
        rows: ChangedOn<Number, Without<Marked>>,
        apart: ChangedOn<Apart>,
        filtered: Query<Entity, (Changed<Number>, Without<Marked>)>,
        filtered_apart: Query<Entity, Changed<Apart>>,
        mut found: ResMut<Found>,
    ) {
        found.0 = vec![
            rows.entities(),
            filtered.iter().collect(),
            apart.entities(),
            filtered_apart.iter().collect(),
        ];
    }

    #[test]
    fn finds_what_a_filter_finds() {
        let mut app = App::new();
        app.init_resource::<Found>().add_systems(Update, find);
        let world = app.world_mut();
        let numbers: Vec<Entity> = (0..500).map(|i| world.spawn(Number(i)).id()).collect();
        let apart: Vec<Entity> = (0..50).map(|i| world.spawn(Apart(i)).id()).collect();
        for &entity in numbers.iter().step_by(11) {
            world.entity_mut(entity).insert(Marked);
        }
        let mut expect = |changed: &[usize], of_apart: &[usize]| {
            for &index in changed {
                app.world_mut().get_mut::<Number>(numbers[index]).unwrap().0 += 1;
            }
            for &index in of_apart {
                app.world_mut().get_mut::<Apart>(apart[index]).unwrap().0 += 1;
            }
            app.update();
            let [rows, filtered, sparse, filtered_sparse] = &app.world().resource::<Found>().0[..]
            else {
                panic!("four lists were found");
            };
            assert_eq!((rows, sparse), (filtered, filtered_sparse));
            [rows.len(), sparse.len()]
        };
        // All are new, then some change, of which every eleventh does not count.
        assert_eq!(expect(&[], &[]), [454, 50]);
        assert_eq!(expect(&[], &[]), [0, 0]);
        assert_eq!(expect(&[1, 2, 11, 64, 200, 499], &[7]), [5, 1]);
        assert_eq!(expect(&[], &[]), [0, 0]);
    }
}
