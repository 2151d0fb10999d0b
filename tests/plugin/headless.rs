//! Apps without a window or renderer, and the lines that they log.

use std::any::TypeId;
use std::fmt::{Debug, Write};
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::{Mutex, Once};
use std::time::{Duration, Instant};

use bevy::camera::visibility::VisibleEntities;
use bevy::camera::{CameraPlugin, CameraUpdateSystems};
use bevy::ecs::schedule::SingleThreadedExecutor;
use bevy::ecs::system::RunSystemOnce;
use bevy::gizmos::GizmoPlugin;
use bevy::light::LightPlugin;
use bevy::log::tracing::field::{Field, Visit};
use bevy::log::tracing::{Event, Level, Subscriber};
use bevy::log::tracing_subscriber::layer::{Context, SubscriberExt};
use bevy::log::tracing_subscriber::util::SubscriberInitExt;
use bevy::log::tracing_subscriber::{Layer, registry};
use bevy::mesh::MeshPlugin;
use bevy::prelude::*;
use bevy::render::camera::camera_system;
use bevy::render::texture::ManualTextureViews;
use bevy::window::ExitCondition;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{LodError, LodOrigin, LodUnit};
use fieldlod_tests::apps::{self, bevy_mesh, finish, rendererless};

/// An app with the plugin. It shares its bakes with the apps of other tests.
pub(crate) fn app() -> App {
    let mut app = app_without_cache();
    share_bakes(&mut app);
    app
}

/// An app with the plugin and without a cache of bakes.
pub(crate) fn app_without_cache() -> App {
    app_in(Path::new("."))
}

/// An app with the plugin. The app reads assets from `folder`.
pub(crate) fn app_in(folder: &Path) -> App {
    let mut app = unfinished(AssetPlugin {
        file_path: folder.display().to_string(),
        ..default()
    });
    finish(&mut app);
    app
}

/// [`app`] with another plugin.
pub(crate) fn app_with(plugin: impl Plugin) -> App {
    let mut app = unfinished(AssetPlugin::default());
    app.add_plugins(plugin);
    finish(&mut app);
    share_bakes(&mut app);
    app
}

fn share_bakes(app: &mut App) {
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.cache_folder = Some(apps::shared_cache());
}

/// An app with a camera at `distance` from the origin, and a rock with its levels of detail at the origin. A rock
/// of 4 subdivisions is a prop; one of 5 or more has units.
pub(crate) fn before_a_camera(subdivisions: u32, distance: f32) -> (App, Entity, Entity) {
    let mut app = app();
    let camera = spawn_camera(&mut app, distance);
    let rock = spawn_rock(&mut app, subdivisions);
    ready(&mut app, 1);
    (app, camera, rock)
}

/// An app with the plugin, to which more plugins can be added before [`finish`].
pub(crate) fn unfinished(assets: AssetPlugin) -> App {
    unfinished_in(App::new(), assets)
}

/// [`unfinished`] with an existing app.
pub(crate) fn unfinished_in(mut app: App, assets: AssetPlugin) -> App {
    app.add_plugins(rendererless().set(assets));
    add_plugin(&mut app);
    app
}

/// An app with only those plugins of Bevy that `FieldLodPlugin` needs. Frames take less time than those of [`app`].
pub(crate) fn minimal_app() -> App {
    let mut app = minimal(AssetPlugin::default());
    finish(&mut app);
    app
}

/// [`minimal_app`] with the folder of assets, materials, and the bakes of other tests. Cameras may lose components: with
/// Bevy's render plugins and without a renderer, that panics in Bevy 0.19.1.
pub(crate) fn app_without_render_plugins(folder: &Path) -> App {
    let mut app = minimal(AssetPlugin {
        file_path: folder.display().to_string(),
        ..default()
    });
    let no_window = WindowPlugin {
        primary_window: None,
        exit_condition: ExitCondition::DontExit,
        ..default()
    };
    app.add_plugins((no_window, ImagePlugin::default(), GizmoPlugin, LightPlugin))
        .init_asset::<StandardMaterial>()
        .init_resource::<ManualTextureViews>()
        .add_systems(PostUpdate, camera_system.in_set(CameraUpdateSystems));
    finish(&mut app);
    share_bakes(&mut app);
    // Threads cost more than they save in small worlds.
    let mut schedules = app.world_mut().resource_mut::<Schedules>();
    for (_, schedule) in schedules.iter_mut() {
        schedule.set_executor(SingleThreadedExecutor::new());
    }
    app
}

/// [`minimal_app`], to which more plugins can be added before [`finish`].
fn minimal(assets: AssetPlugin) -> App {
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        assets,
        TransformPlugin,
        MeshPlugin,
        CameraPlugin,
    ));
    add_plugin(&mut app);
    app
}

fn add_plugin(app: &mut App) {
    listen();
    app.add_plugins((FieldLodPlugin, FieldLodVisibleFluxPlugin))
        .init_resource::<Events>()
        .init_resource::<Failures>()
        .add_observer(note_failure)
        .add_systems(Last, note_events);
}

/// More frames than the 60 after which unused units are despawned.
pub(crate) const IDLE_FRAMES: u32 = 64;

/// All events so far.
#[derive(Resource, Default)]
pub(crate) struct Events(pub(crate) Vec<FieldLodEvent>);

fn note_events(mut events: MessageReader<FieldLodEvent>, mut noted: ResMut<Events>) {
    noted.0.extend(events.read().cloned());
}

/// The errors of entities.
#[derive(Resource, Default)]
struct Failures(Vec<LodError>);

fn note_failure(failed: On<LodFailed>, mut failures: ResMut<Failures>) {
    if failed.entity == failed.original_event_target() {
        failures.0.push(failed.error.clone());
    }
}

/// The errors of entities so far.
pub(crate) fn failures(app: &App) -> &[LodError] {
    &app.world().resource::<Failures>().0
}

/// The origins of levels of detail, in the order of their events.
pub(crate) fn origins(app: &App) -> Vec<LodOrigin> {
    let events = app.world().resource::<Events>().0.iter();
    events
        .filter_map(|event| match event {
            FieldLodEvent::Ready { origin, .. } => Some(*origin),
            _ => None,
        })
        .collect()
}

/// Runs frames until `done` returns `true`. Panics after two minutes and names `what`.
pub(crate) fn run_until(app: &mut App, what: &str, mut done: impl FnMut(&mut App) -> bool) {
    let deadline = Instant::now() + Duration::from_secs(120);
    while !done(app) {
        assert!(Instant::now() < deadline, "timed out: {what}");
        app.update();
        // Leaves CPU time for bakes.
        std::thread::sleep(Duration::from_millis(4));
    }
}

/// The number of entities in each state.
pub(crate) fn progress(app: &App) -> FieldLodProgress {
    *app.world().resource::<FieldLodProgress>()
}

/// Runs frames until `count` objects have levels of detail, and one more frame.
pub(crate) fn ready(app: &mut App, count: u32) {
    run_until(app, "objects are ready", |app| progress(app).ready == count);
    app.update();
}

/// Statistics of the last frame of a camera.
pub(crate) fn stats(app: &App, camera: Entity) -> FieldLodViewStats {
    *app.world().get::<FieldLodViewStats>(camera).unwrap()
}

/// The level at which `camera` draws a prop; `None` if it does not draw the prop.
pub(crate) fn level(app: &mut App, prop: Entity, camera: Entity) -> Option<u32> {
    apps::drawn_level(app.world_mut(), prop, camera)
}

/// The levels of an object in the cut of `camera`.
pub(crate) fn levels(app: &mut App, object: Entity, camera: Entity) -> Option<RangeInclusive<u32>> {
    let find = move |levels: LodLevels| levels.in_view(object, camera);
    app.world_mut().run_system_once(find).unwrap()
}

/// The mesh entities that a camera draws.
pub(crate) fn visible(app: &App, camera: Entity) -> Vec<Entity> {
    let visible = app.world().get::<VisibleEntities>(camera).unwrap();
    visible.get(TypeId::of::<Mesh3d>()).to_vec()
}

/// The entities of all units.
pub(crate) fn units(app: &mut App) -> Vec<Entity> {
    let mut units = app.world_mut().query_filtered::<Entity, With<LodUnit>>();
    units.iter(app.world()).collect()
}

/// The number of entities with a mesh.
pub(crate) fn entity_count(app: &mut App) -> usize {
    app.world_mut().query::<&Mesh3d>().iter(app.world()).len()
}

/// Moves a camera of [`spawn_camera`] to another distance and runs a frame.
pub(crate) fn move_camera(app: &mut App, camera: Entity, distance: f32) {
    let mut pose = app.world_mut().get_mut::<Transform>(camera).unwrap();
    pose.translation.z = distance;
    app.update();
}

/// Adds an asset.
pub(crate) fn add<A: Asset>(app: &mut App, asset: A) -> Handle<A> {
    app.world_mut().resource_mut::<Assets<A>>().add(asset)
}

/// Inserts into an entity.
pub(crate) fn insert(app: &mut App, entity: Entity, bundle: impl Bundle) {
    app.world_mut().entity_mut(entity).insert(bundle);
}

/// A rock of 20 triangles, each subdivided this many times.
pub(crate) fn rock(subdivisions: u32, seed: u32) -> Mesh {
    bevy_mesh(&fieldlod_tests::rock(subdivisions, seed))
}

/// Spawns a rock with an [`AutoLod`].
pub(crate) fn spawn_rock(app: &mut App, subdivisions: u32) -> Entity {
    spawn_object(app, rock(subdivisions, 1))
}

/// Spawns a mesh with an [`AutoLod`].
pub(crate) fn spawn_object(app: &mut App, mesh: Mesh) -> Entity {
    let mesh = Mesh3d(add(app, mesh));
    let material = MeshMaterial3d(add(app, StandardMaterial::default()));
    let world = app.world_mut();
    world.spawn((mesh, material, AutoLod::default())).id()
}

/// A camera at `distance` from the origin.
pub(crate) fn spawn_camera(app: &mut App, distance: f32) -> Entity {
    let pose = Transform::from_xyz(0.0, 0.0, distance);
    apps::spawn_camera(app.world_mut(), UVec2::new(1280, 720), pose)
}

/// Spawns a sun with shadows, in the direction of positive x and y.
pub(crate) fn spawn_sun(app: &mut App) {
    app.world_mut().spawn((
        DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::default().looking_to(Vec3::new(-1.0, -1.0, 0.0), Vec3::Y),
    ));
}

/// Whether any app of this process logged a line at `level` with all of `words`.
pub(crate) fn logged(level: Level, words: &[&str]) -> bool {
    logged_times(level, words) > 0
}

/// The number of lines at `level` with all of `words` that the apps of this process logged.
pub(crate) fn logged_times(level: Level, words: &[&str]) -> usize {
    let lines = LINES.lock().unwrap();
    let has_all = |line: &str| words.iter().all(|word| line.contains(word));
    let lines = lines.iter();
    lines
        .filter(|(at, line)| *at == level && has_all(line))
        .count()
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
