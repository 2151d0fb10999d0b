//! Entities that are despawned in any phase of a frame.

use std::collections::HashSet;

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{FieldLodSystems, LodUnit};

use crate::headless::{
    add, app, before_a_camera, entity_count, insert, move_camera, ready, rock, run_until,
    spawn_camera, spawn_rock, stats, units, visible,
};

#[cfg(not(bevy_0_20))]
type OnAdd<'w, 't, C> = On<'w, 't, Add, C>;
#[cfg(not(bevy_0_20))]
type OnInsert<'w, 't, C> = On<'w, 't, Insert, C>;
#[cfg(bevy_0_20)]
type OnAdd<'w, 't, C> = On<'w, 't, Add<C>>;
#[cfg(bevy_0_20)]
type OnInsert<'w, 't, C> = On<'w, 't, Insert<C>>;

/// Whether all objects and units are despawned in the next frame.
#[derive(Resource, Default)]
struct Doomed(bool);

fn despawn_all(
    mut commands: Commands,
    doomed: Res<Doomed>,
    all: Query<Entity, Or<(With<AutoLod>, With<LodUnit>)>>,
) {
    if doomed.0 {
        all.iter()
            .for_each(|entity| commands.entity(entity).try_despawn());
    }
}

#[test]
fn despawn_in_any_phase_does_not_panic() {
    use FieldLodSystems::{Filter, Prepare, Select, Track};
    for phase in [Track, Prepare, Select, Filter] {
        for frames in 0..2 {
            let mut app = app();
            // The commands of `despawn_all` and of the phase are applied together, the despawns first.
            let despawn_all = despawn_all.before_ignore_deferred(phase);
            app.init_resource::<Doomed>()
                .add_systems(PostUpdate, despawn_all);
            let mesh = add(&mut app, Sphere::new(1.0).mesh().uv(64, 32));
            let known = Mesh3d(mesh);
            app.world_mut().spawn((known.clone(), AutoLod::default()));
            ready(&mut app, 1);
            // The entities are new: they have been in no frame or in one frame.
            spawn_camera(&mut app, 3.0);
            app.world_mut().spawn((known, AutoLod::default()));
            let clusters = Mesh3d(add(&mut app, rock(5, 1)));
            app.world_mut()
                .spawn((clusters, AutoLod::of_kind(LodKind::Clusters)));
            (0..frames).for_each(|_| app.update());
            app.world_mut().resource_mut::<Doomed>().0 = true;
            app.update();
            app.update();
            assert!(units(&mut app).is_empty());
        }
    }
}

/// Units that were spawned so far.
#[derive(Resource, Default)]
struct Spawned(usize);

/// `FIELDLOD_TELEPORTED_UNITS` sets another number of units, for long runs by hand.
#[test]
fn teleporting_camera_leaves_few_units() {
    let wanted = std::env::var("FIELDLOD_TELEPORTED_UNITS");
    let wanted = wanted.map_or(10_000, |wanted| wanted.parse().unwrap());
    let mut app = app();
    app.init_resource::<Spawned>();
    app.add_observer(|_: OnAdd<LodUnit>, mut spawned: ResMut<Spawned>| spawned.0 += 1);
    let camera = spawn_camera(&mut app, 0.0);
    insert(&mut app, camera, FieldLodCamera::with_error_px(0.05));
    let mesh = Mesh3d(add(&mut app, rock(6, 1)));
    for place in 0..100u8 {
        let at = Transform::from_xyz(0.0, 0.0, -1_000.0 * f32::from(place));
        let clusters = AutoLod::of_kind(LodKind::Clusters);
        app.world_mut().spawn((mesh.clone(), at, clusters));
    }
    ready(&mut app, 100);
    let mut most = 0;
    for frame in 0u16.. {
        if app.world().resource::<Spawned>().0 >= wanted {
            break;
        }
        let at = -1_000.0 * f32::from(frame % 100) + 3.0;
        move_camera(&mut app, camera, at);
        let drawn = stats(&app, camera).units_drawn as usize;
        let units = units(&mut app).len();
        // As many idle units as are drawn, and 1,024.
        assert!(
            units <= 2 * drawn + 1_024,
            "{units} for {drawn} in frame {frame}"
        );
        most = most.max(units);
    }
    assert!(most > 1_024, "{most}");
}

#[test]
fn reused_record_spawns_one_entity() {
    let (mut app, camera, first) = before_a_camera(6, 3.0);
    let mesh = app.world().get::<Mesh3d>(first).unwrap().clone();
    for _ in 0..3 {
        let mut objects = app.world_mut().query_filtered::<Entity, With<AutoLod>>();
        let object = objects.single(app.world()).unwrap();
        // Another object is spawned in the frame in which units and object are despawned.
        app.world_mut().entity_mut(object).despawn_children();
        app.world_mut().entity_mut(object).despawn();
        app.world_mut().spawn((mesh.clone(), AutoLod::default()));
        run_until(&mut app, "the other is drawn", |app| {
            !visible(app, camera).is_empty()
        });
        app.update();
        let mut seen = HashSet::new();
        for unit in units(&mut app) {
            let entity = app.world().entity(unit);
            let object = entity.get::<LodUnit>().unwrap().object;
            let mesh = entity.get::<Mesh3d>().unwrap().id();
            assert!(seen.insert((object, mesh)), "two entities for one unit");
        }
    }
}

#[test]
fn despawn_in_observer_does_not_panic() {
    for subdivisions in [4, 5] {
        let mut app = app();
        app.add_observer(|ready: On<LodReady>, mut commands: Commands| {
            commands.entity(ready.entity).try_despawn();
        });
        app.add_observer(
            |changed: OnInsert<LodState>, states: Query<&LodState>, mut commands: Commands| {
                if let Ok(LodState::Ready(_)) = states.get(changed.entity) {
                    commands.entity(changed.entity).try_despawn();
                }
            },
        );
        spawn_rock(&mut app, subdivisions);
        run_until(&mut app, "it is despawned", |app| entity_count(app) == 0);
        app.update();
    }
}
