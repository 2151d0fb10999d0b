//! An app without window and renderer, and what it logs.

use std::fmt::{Debug, Write};
use std::path::Path;
use std::sync::{Mutex, Once};
use std::time::{Duration, Instant};

use bevy::log::tracing::field::{Field, Visit};
use bevy::log::tracing::{Event, Level, Subscriber};
use bevy::log::tracing_subscriber::layer::{Context, SubscriberExt};
use bevy::log::tracing_subscriber::util::SubscriberInitExt;
use bevy::log::tracing_subscriber::{Layer, registry};
use bevy::prelude::*;
use bevy_fieldlod::LodOrigin;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::{self, finish, rendererless};

/// An app with the plugin that reads assets from `folder`.
pub(crate) fn app(folder: &Path) -> App {
    let mut app = unfinished(AssetPlugin {
        file_path: folder.display().to_string(),
        ..default()
    });
    finish(&mut app);
    app
}

/// An app with the plugin that may get more plugins before [`finish`].
pub(crate) fn unfinished(assets: AssetPlugin) -> App {
    listen();
    let mut app = App::new();
    app.add_plugins((rendererless().set(assets), FieldLodPlugin))
        .init_resource::<Told>()
        .add_systems(Last, note_events);
    app
}

/// All events so far.
#[derive(Resource, Default)]
pub(crate) struct Told(pub(crate) Vec<FieldLodEvent>);

fn note_events(mut events: MessageReader<FieldLodEvent>, mut told: ResMut<Told>) {
    told.0.extend(events.read().cloned());
}

/// Where the hierarchies came from, in order.
pub(crate) fn origins(app: &App) -> Vec<LodOrigin> {
    let events = app.world().resource::<Told>().0.iter();
    events
        .filter_map(|event| match event {
            FieldLodEvent::Ready { origin, .. } => Some(*origin),
            _ => None,
        })
        .collect()
}

/// Runs frames until `done`.
pub(crate) fn run_until(app: &mut App, what: &str, mut done: impl FnMut(&mut App) -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !done(app) {
        assert!(Instant::now() < deadline, "never: {what}");
        app.update();
        std::thread::sleep(Duration::from_millis(1));
    }
}

pub(crate) fn status(app: &App) -> FieldLodProgress {
    *app.world().resource::<FieldLodProgress>()
}

/// Runs frames until `count` objects are drawn with levels of detail, and one more.
pub(crate) fn ready(app: &mut App, count: u32) {
    run_until(app, "objects are ready", |app| status(app).ready == count);
    app.update();
}

pub(crate) fn stats(app: &App, camera: Entity) -> FieldLodViewStats {
    *app.world().get::<FieldLodViewStats>(camera).unwrap()
}

pub(crate) fn entity_count(app: &mut App) -> usize {
    app.world_mut().query::<&Mesh3d>().iter(app.world()).len()
}

/// Moves a camera of [`spawn_camera`] to another distance and runs a frame.
pub(crate) fn move_camera(app: &mut App, camera: Entity, distance: f32) {
    let mut pose = app.world_mut().get_mut::<Transform>(camera).unwrap();
    pose.translation.z = distance;
    app.update();
}

/// Spawns a mesh under the plugin's care.
pub(crate) fn spawn_object(app: &mut App, mesh: Mesh) -> Entity {
    let world = app.world_mut();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
    let material = world
        .resource_mut::<Assets<StandardMaterial>>()
        .add(StandardMaterial::default());
    world
        .spawn((Mesh3d(mesh), MeshMaterial3d(material), AutoLod::default()))
        .id()
}

/// A camera at `distance` from the origin.
pub(crate) fn spawn_camera(app: &mut App, distance: f32) -> Entity {
    let pose = Transform::from_xyz(0.0, 0.0, distance).looking_at(Vec3::ZERO, Vec3::Y);
    apps::spawn_camera(app.world_mut(), UVec2::new(1280, 720), pose)
}

/// Whether a line at `level` was logged that holds all of `words`.
pub(crate) fn logged(level: Level, words: &[&str]) -> bool {
    let lines = LINES.lock().unwrap();
    lines
        .iter()
        .any(|(at, line)| *at == level && words.iter().all(|word| line.contains(word)))
}

static LINES: Mutex<Vec<(Level, String)>> = Mutex::new(Vec::new());

fn listen() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| registry().with(Listener).init());
}

struct Listener;

impl<S: Subscriber> Layer<S> for Listener {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        if *event.metadata().level() <= Level::INFO {
            let mut line = Line(String::new());
            event.record(&mut line);
            LINES
                .lock()
                .unwrap()
                .push((*event.metadata().level(), line.0));
        }
    }
}

struct Line(String);

impl Visit for Line {
    fn record_debug(&mut self, _: &Field, value: &dyn Debug) {
        write!(self.0, "{value:?} ").unwrap();
    }
}
