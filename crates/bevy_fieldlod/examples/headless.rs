//! Levels of detail without a renderer, as on a server or in a test: levels are selected, and nothing is drawn.
//!
//! Run with `cargo run -p bevy_fieldlod --example headless`. It prints the triangles of a ball at three distances. Bevy
//! logs that there is no renderer.

use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::settings::WgpuSettings;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_fieldlod::prelude::*;

fn main() {
    let no_renderer = RenderPlugin {
        render_creation: WgpuSettings {
            backends: None,
            ..default()
        }
        .into(),
        ..default()
    };
    let no_window = WindowPlugin {
        primary_window: None,
        exit_condition: ExitCondition::DontExit,
        ..default()
    };
    let plugins = DefaultPlugins.set(no_renderer).set(no_window);
    let mut app = App::new();
    app.add_plugins((plugins.disable::<WinitPlugin>(), FieldLodPlugin));
    app.finish();
    app.cleanup();

    let ball = Sphere::new(1.0).mesh().ico(63).expect("few vertices");
    let ball = app.world_mut().resource_mut::<Assets<Mesh>>().add(ball);
    app.world_mut().spawn((Mesh3d(ball), AutoLod::default()));
    // The size of the target gives the length of a pixel.
    let size = UVec2::new(1280, 720);
    let camera = (Camera3d::default(), RenderTarget::None { size });
    let camera = app.world_mut().spawn(camera).id();

    // Threads bake the mesh.
    app.update();
    while app.world().resource::<FieldLodProgress>().ready == 0 {
        app.update();
    }
    for distance in [5.0, 20.0, 80.0] {
        let at = Transform::from_xyz(0.0, 0.0, distance);
        app.world_mut().entity_mut(camera).insert(at);
        app.update();
        let stats = app.world().get::<FieldLodViewStats>(camera);
        let stats = stats.expect("the plugin adds it");
        let (drawn, full) = (stats.triangles_drawn, stats.triangles_full);
        println!("{distance} m: {drawn} of {full} triangles");
    }
}
