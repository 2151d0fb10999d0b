//! Shared by the examples: Bevy's plugins with a window or without, and some meshes.
//!
//! With a display an example opens a window. With `--picture FILE`, or without a display, it draws to an image, waits
//! for the levels of detail, writes one picture and exits. A game uses `DefaultPlugins` in place of this module.

#![allow(dead_code, reason = "an example uses a part of it")]

pub(crate) mod characters;
pub(crate) mod meshes;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bevy::app::{PluginGroupBuilder, ScheduleRunnerPlugin};
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_fieldlod::prelude::*;

/// Bevy's default plugins, with assets from `examples/assets`.
pub(crate) fn plugins() -> PluginGroupBuilder {
    plugins_with_assets_in(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/assets"))
}

/// Bevy's default plugins, with assets from `folder`.
pub(crate) fn plugins_with_assets_in(folder: PathBuf) -> PluginGroupBuilder {
    let file_path = folder.display().to_string();
    let plugins = DefaultPlugins.set(AssetPlugin {
        file_path,
        ..default()
    });
    let Some(file) = picture_file() else {
        return plugins;
    };
    plugins
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
        // Otherwise meshes are missing until their pipelines are compiled.
        .set(RenderPlugin {
            synchronous_pipeline_compilation: true,
            ..default()
        })
        .disable::<WinitPlugin>()
        .disable::<PipelinedRenderingPlugin>()
        .add(ScheduleRunnerPlugin::run_loop(Duration::ZERO))
        .add(PicturePlugin(file))
}

/// The file after `--picture`; `picture.png` without a display; `None` to open a window.
fn picture_file() -> Option<PathBuf> {
    let mut args = std::env::args_os().skip_while(|arg| arg != "--picture");
    let has_display = !cfg!(target_os = "linux")
        || ["DISPLAY", "WAYLAND_DISPLAY"].map(std::env::var_os) != [None, None];
    let fallback = (!has_display).then(|| "picture.png".into());
    args.nth(1).map(PathBuf::from).or(fallback)
}

/// Redirects cameras from the window to an image, and writes it once all levels of detail are ready.
struct PicturePlugin(PathBuf);

#[derive(Resource)]
struct Picture {
    file: PathBuf,
    target: Handle<Image>,
    begun: Instant,
}

impl Plugin for PicturePlugin {
    fn build(&self, app: &mut App) {
        let target = Image::new_target_texture(640, 360, TextureFormat::Rgba8UnormSrgb, None);
        let target = app.world_mut().resource_mut::<Assets<Image>>().add(target);
        let (file, begun) = (self.0.clone(), Instant::now());
        app.insert_resource(Picture {
            file,
            target,
            begun,
        })
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO))
        .add_systems(PreUpdate, redirect_cameras)
        .add_systems(Last, take_picture);
    }
}

fn redirect_cameras(
    mut commands: Commands,
    picture: Res<Picture>,
    mut cameras: Query<(Entity, &Camera, &mut RenderTarget), Added<Camera>>,
) {
    for (entity, camera, mut target) in &mut cameras {
        *target = RenderTarget::Image(picture.target.clone().into());
        if camera.order == 0 {
            commands.entity(entity).insert(IsDefaultUiCamera);
        }
    }
}

fn take_picture(
    mut commands: Commands,
    picture: Res<Picture>,
    progress: Res<FieldLodProgress>,
    memory: Res<FieldLodMemory>,
    mut time: ResMut<TimeUpdateStrategy>,
    mut ready_frames: Local<u32>,
    mut exit: MessageWriter<AppExit>,
) {
    let is_ready = progress.ready > 0 && progress.waiting == 0 && memory.missing_pages == 0;
    // Time starts with the levels: a picture does not depend on how long they took.
    let frame = Duration::from_millis(if is_ready { 16 } else { 0 });
    *time = TimeUpdateStrategy::ManualDuration(frame);
    // Waits a few frames, because uploaded meshes are drawn in the next frame.
    *ready_frames += u32::from(is_ready);
    if is_ready && *ready_frames == 6 {
        let screenshot = Screenshot::image(picture.target.clone());
        let exit = |_: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
            exit.write(AppExit::Success);
        };
        let save = save_to_disk(picture.file.clone());
        commands.spawn(screenshot).observe(save).observe(exit);
    } else if picture.begun.elapsed() > Duration::from_secs(300) {
        error!("no picture after 300 s: {:?}", *progress);
        exit.write(AppExit::error());
    }
}
