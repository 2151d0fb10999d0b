//! Apps without a window and a renderer.

use std::time::{Duration, Instant};

use bevy::asset::RenderAssetUsages;
use bevy::camera::RenderTarget;
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

/// Bevy's default plugins and ours.
pub(crate) fn new_app() -> App {
    let mut app = App::new();
    let plugins = DefaultPlugins
        .build()
        .disable::<LogPlugin>()
        .disable::<WinitPlugin>()
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
        .set(RenderPlugin {
            render_creation: WgpuSettings {
                backends: None,
                ..default()
            }
            .into(),
            ..default()
        });
    app.add_plugins((plugins, FieldLodPlugin));
    app.finish();
    app.cleanup();
    app
}

/// Runs frames until so many entities have their levels of detail, and some more.
pub(crate) fn settle(app: &mut App, ready: u32) {
    let deadline = Instant::now() + Duration::from_secs(120);
    let progress = |app: &App| *app.world().resource::<FieldLodProgress>();
    while progress(app).ready + progress(app).plain < ready {
        assert!(Instant::now() < deadline, "never ready");
        app.update();
    }
    (0..5).for_each(|_| app.update());
}

/// A camera that draws to an image of 1920 by 1080.
pub(crate) fn spawn_camera(world: &mut World, pose: Transform) -> Entity {
    let image = Image::new_target_texture(1920, 1080, TextureFormat::Rgba8UnormSrgb, None);
    let image = world.resource_mut::<Assets<Image>>().add(image);
    let target = RenderTarget::Image(image.into());
    world.spawn((Camera3d::default(), target, pose)).id()
}

/// A fixture as a Bevy mesh.
pub(crate) fn bevy_mesh(source: &SourceMesh) -> Mesh {
    let to_arrays = |values: &[Vec3]| values.iter().map(Vec3::to_array).collect::<Vec<_>>();
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, to_arrays(&source.positions))
    .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, to_arrays(&source.normals))
    .with_inserted_indices(Indices::U32(source.indices.clone()))
}
