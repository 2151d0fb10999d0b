//! Settings of cameras, of `AutoLod` and of bakes.

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{BakeConfig, LodUnit};

use crate::headless::{
    add, app, before_a_camera, insert, levels, ready, rock, spawn_camera, spawn_rock, spawn_sun,
    stats, units, visible,
};

fn settings(app: &mut App, camera: Entity, settings: FieldLodCamera) {
    insert(app, camera, settings);
    app.update();
}

#[test]
fn view_draws_forced_level() {
    for subdivisions in [4, 6] {
        let (mut app, near, rock) = before_a_camera(subdivisions, 3.0);
        let far = spawn_camera(&mut app, 300.0);
        for camera in [near, far] {
            let forced = FieldLodCamera::at_level(1);
            settings(&mut app, camera, forced);
        }
        app.update();
        assert_eq!(levels(&mut app, rock, far), Some(1..=1));
        // Level 0 of a view is the source.
        let full = FieldLodCamera::at_level(0);
        settings(&mut app, far, full);
        app.update();
        assert_eq!(visible(&app, far), [rock]);
        assert_eq!(levels(&mut app, rock, far), Some(0..=0));
        let drawn = stats(&app, far);
        assert_eq!(drawn.triangles_drawn, drawn.triangles_full);
    }
}

#[test]
fn lod_levels_reports_drawn_levels() {
    let (mut app, near, rock) = before_a_camera(6, 3.0);
    let far = spawn_camera(&mut app, 300.0);
    let plain = spawn_rock(&mut app, 1);
    app.update();
    app.update();
    let [fine, coarse] = [near, far].map(|camera| levels(&mut app, rock, camera).unwrap());
    assert_eq!(*fine.start(), 0);
    assert!(fine.end() < coarse.start(), "{fine:?} {coarse:?}");
    assert_eq!(levels(&mut app, plain, near), None);
    insert(&mut app, rock, Visibility::Hidden);
    app.update();
    assert_eq!(levels(&mut app, rock, near), None);
}

#[test]
fn auto_lod_overrides_bake_settings() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 3.0);
    let source = add(&mut app, rock(6, 1));
    let mut spawn = |bake: Option<BakeConfig>| {
        let auto_lod = AutoLod { bake, ..default() };
        let bundle = (Mesh3d(source.clone()), auto_lod);
        app.world_mut().spawn(bundle).id()
    };
    let [default, fine] = [None, Some(BakeConfig::fine_grained())].map(&mut spawn);
    ready(&mut app, 2);
    app.update();
    let count = |app: &mut App, object: Entity| {
        let units = units(app).into_iter();
        let of = |unit: &Entity| app.world().get::<LodUnit>(*unit).unwrap().object == object;
        units.filter(of).count()
    };
    let [few, many] = [default, fine].map(|object| count(&mut app, object));
    assert!(few > 0 && many > 2 * few, "{few} {many}");
    // Changed settings bake the mesh again.
    let auto_lod = AutoLod {
        bake: Some(BakeConfig::fine_grained()),
        ..Default::default()
    };
    insert(&mut app, default, auto_lod);
    app.update();
    ready(&mut app, 2);
    app.update();
    assert_eq!(count(&mut app, default), many);
    assert!(!visible(&app, camera).is_empty());
}

#[test]
fn shadow_bias_controls_offscreen_casters() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 10.0);
    spawn_sun(&mut app);
    let rock = spawn_rock(&mut app, 6);
    // Right of the image, towards the sun.
    insert(&mut app, rock, Transform::from_xyz(22.0, 12.0, 0.0));
    ready(&mut app, 1);
    let finest_at = |app: &mut App, shadow_bias: f32| {
        let biased = FieldLodCamera {
            shadow_bias,
            ..default()
        };
        settings(app, camera, biased);
        *levels(app, rock, camera).unwrap().start()
    };
    let levels = [1.0, 0.3, 0.0].map(|bias| finest_at(&mut app, bias));
    assert!(
        levels.is_sorted() && levels[0] < levels[1] && levels[1] < levels[2],
        "{levels:?}"
    );
    // Objects in the image are not affected.
    insert(&mut app, rock, Transform::default());
    assert_eq!(finest_at(&mut app, 0.3), finest_at(&mut app, 1.0));
}
