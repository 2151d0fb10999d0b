//! Apps without a window, and fixtures for them.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bevy::app::PluginGroupBuilder;
use bevy::asset::RenderAssetUsages;
use bevy::camera::RenderTarget;
use bevy::ecs::system::RunSystemOnce;
use bevy::log::LogPlugin;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::render_resource::TextureFormat;
use bevy::render::settings::WgpuSettings;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::SourceMesh;

/// Bevy's default plugins without a window and without its log, which only one app of a process can
/// have.
pub fn windowless() -> PluginGroupBuilder {
    DefaultPlugins
        .build()
        .disable::<WinitPlugin>()
        .disable::<LogPlugin>()
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
}

/// [`windowless`] without a renderer: frames are prepared and not drawn.
pub fn rendererless() -> PluginGroupBuilder {
    windowless().set(RenderPlugin {
        render_creation: WgpuSettings {
            backends: None,
            ..default()
        }
        .into(),
        ..default()
    })
}

/// An app with the [`rendererless`] plugins and [`FieldLodPlugin`].
pub fn rendererless_app() -> App {
    let mut app = App::new();
    app.add_plugins((rendererless(), FieldLodPlugin));
    finish(&mut app);
    app
}

/// A cache of bakes for all tests of this program, beside the program. Entries of an older build are removed.
///
/// # Panics
/// If the program has no path.
#[must_use]
pub fn shared_cache() -> PathBuf {
    let program = std::env::current_exe().expect("the path of this program");
    let folder = program.with_extension("bakes");
    let changed = |path: &Path| path.metadata().and_then(|data| data.modified()).ok();
    if changed(&folder) < changed(&program) {
        // Fails if there is no folder.
        let _ = fs::remove_dir_all(&folder);
    }
    folder
}

/// Finishes the plugins of an app.
pub fn finish(app: &mut App) {
    app.finish();
    app.cleanup();
}

/// Runs frames until `ready` entities have levels of detail or are plain, and five more.
///
/// # Panics
/// After two minutes.
pub fn run_until_ready(app: &mut App, ready: u32) {
    let deadline = Instant::now() + Duration::from_secs(120);
    let progress = |app: &App| *app.world().resource::<FieldLodProgress>();
    while progress(app).ready + progress(app).plain < ready {
        assert!(Instant::now() < deadline, "entities are not ready");
        app.update();
    }
    (0..5).for_each(|_| app.update());
}

/// The level of a prop that is drawn; `None` if `camera` does not draw the prop or it has no levels.
///
/// # Panics
/// If the cut of the camera has more than one level of the prop.
pub fn drawn_level(world: &mut World, prop: Entity, camera: Entity) -> Option<u32> {
    let find = move |levels: LodLevels| levels.in_view(prop, camera);
    let levels = world.run_system_once(find).unwrap()?;
    assert_eq!(levels.start(), levels.end());
    Some(*levels.start())
}

/// A camera that draws to its own image.
pub fn spawn_camera(world: &mut World, size_px: UVec2, pose: Transform) -> Entity {
    let format = TextureFormat::Rgba8UnormSrgb;
    let image = Image::new_target_texture(size_px.x, size_px.y, format, None);
    let image = world.resource_mut::<Assets<Image>>().add(image);
    let target = RenderTarget::Image(image.into());
    world.spawn((Camera3d::default(), target, pose)).id()
}

/// A fixture as a Bevy mesh.
pub fn bevy_mesh(source: &SourceMesh) -> Mesh {
    let to_arrays = |values: &[Vec3]| values.iter().map(Vec3::to_array).collect::<Vec<_>>();
    let usage = RenderAssetUsages::default();
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, usage)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, to_arrays(&source.positions))
        .with_inserted_indices(Indices::U32(source.indices.clone()));
    if !source.normals.is_empty() {
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, to_arrays(&source.normals));
    }
    mesh
}
