//! Follows the path without a window. It renders pictures and prints numbers; without an adapter, it only prints
//! numbers.

use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use bevy::app::PluginsState;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::{PipelineCache, PollType, TextureFormat};
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice};
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::render::{RenderApp, RenderPlugin};
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_fieldlod::prelude::*;

use super::hud;
use super::report::{self, FrameNumbers, SceneNumbers};
use crate::args::Args;
use crate::cameras::path::{CameraPath, Pose};
use crate::cameras::{self, CameraTarget, MainCamera};
use crate::quality::Quality;
use crate::scene::models::Models;
use crate::{adapter, scene};

/// Number of updates after which a requested picture counts as lost. A picture arrives a few updates after its frame; a
/// larger number only delays the error.
const CAPTURE_UPDATES: u32 = 100;

/// Follows the path and prints the summary. Renders pictures into `directory`, if it is given.
pub(crate) fn run(args: &Args, quality: &Quality, directory: Option<&Path>) -> Result<(), String> {
    let start = Instant::now();
    let frames = args.frames(quality.frames)?;
    // An unwritable directory must fail before the long bakes.
    directory.map_or(Ok(()), check_writable)?;
    let mut renderer = Renderer::new(args, quality, directory.is_some());
    let bake_s = renderer.wait_for_levels();

    let path = CameraPath::new();
    renderer.warm_up(path.pose(frames.first().map_or(0.0, |(_, round)| *round)));
    let first_picture_s = start.elapsed().as_secs_f32();
    let mut numbers = Vec::new();
    let mut missing_pictures = 0;
    for &(number, round) in &frames {
        renderer.place_camera(path.pose(round));
        if directory.is_some() {
            renderer.request_picture(number);
            missing_pictures += 1;
        }
        numbers.push(renderer.render());
        if let Some(directory) = directory {
            missing_pictures -= renderer.write_pictures(directory)?;
            eprintln!("walkthrough: frame {} of {}", numbers.len(), frames.len());
        }
    }
    // Pictures arrive a few updates after their frame.
    for _ in 0..CAPTURE_UPDATES {
        if let Some(directory) = directory.filter(|_| missing_pictures > 0) {
            renderer.update();
            missing_pictures -= renderer.write_pictures(directory)?;
        }
    }
    if missing_pictures > 0 {
        return Err(format!("could not capture {missing_pictures} pictures"));
    }
    let world = renderer.app.world();
    let adapter = world.get_resource::<RenderAdapterInfo>();
    let scene = SceneNumbers {
        adapter: adapter.map(|adapter| adapter.name.clone()),
        bake_s,
        first_picture_s,
        ..world.resource::<SceneNumbers>().clone()
    };
    report::print(quality, &scene, &numbers);
    Ok(())
}

/// The app. Each update waits for the GPU.
struct Renderer {
    app: App,
    target: Handle<Image>,
    pictures: Receiver<(u32, Image)>,
    picture_sender: Sender<(u32, Image)>,
}

impl Renderer {
    fn new(args: &Args, quality: &Quality, draws: bool) -> Self {
        let mut app = App::new();
        app.add_plugins(plugins(draws));
        let UVec2 { x, y } = quality.size_in_px;
        let target = Image::new_target_texture(x, y, TextureFormat::Rgba8UnormSrgb, None);
        let target = app.world_mut().resource_mut::<Assets<Image>>().add(target);
        let camera_target = RenderTarget::Image(target.clone().into());
        app.insert_resource(CameraTarget(camera_target));
        scene::add_to(&mut app, args, quality);
        app.add_plugins(hud::labels_plugin);

        // Bevy's runners do the same before the first update.
        while app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();
        let (picture_sender, pictures) = channel();
        Self {
            app,
            target,
            pictures,
            picture_sender,
        }
    }

    /// Runs one update, as [`App::update`] does, and waits for the GPU. Returns the times of the main world, of the
    /// extraction and the render world, and of the wait.
    fn update(&mut self) -> [Duration; 3] {
        let apps = self.app.sub_apps_mut();
        let start = Instant::now();
        apps.main.run_default_schedule();
        let main = start.elapsed();
        for sub_app in apps.sub_apps.values_mut() {
            sub_app.extract(apps.main.world_mut());
            sub_app.update();
        }
        apps.main.world_mut().clear_trackers();
        let render = start.elapsed() - main;
        if let Some(device) = self.app.world().get_resource::<RenderDevice>() {
            let done = device.poll(PollType::wait_indefinitely());
            done.expect("the graphics device is not lost");
        }
        [main, render, start.elapsed() - main - render]
    }

    /// Runs updates until every mesh has its levels of detail. Returns the elapsed time in seconds. The camera is
    /// inactive, so that bakes do not wait for pictures.
    fn wait_for_levels(&mut self) -> f32 {
        let start = Instant::now();
        let mut last_line = Instant::now();
        loop {
            self.update();
            let world = self.app.world();
            let FieldLodProgress {
                waiting,
                ready,
                plain,
                ..
            } = *world.resource();
            let loading = world.resource::<Models>().loading;
            if loading == 0 && waiting == 0 && ready + plain > 0 {
                break;
            }
            if last_line.elapsed() > Duration::from_secs(2) {
                last_line = Instant::now();
                eprintln!("walkthrough: levels of detail: {ready} meshes ready, {waiting} waiting");
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let bake_s = start.elapsed().as_secs_f32();
        eprintln!("walkthrough: levels of detail ready after {bake_s:.1} s");
        bake_s
    }

    fn place_camera(&mut self, pose: Pose) {
        let world = self.app.world_mut();
        let mut cameras = world
            .query_filtered::<(&mut Camera, &mut Transform, &mut Projection), With<MainCamera>>();
        for (mut camera, mut place, mut projection) in cameras.iter_mut(world) {
            camera.is_active = true;
            *place = pose.transform();
            cameras::zoom(&mut projection, pose.fov_in_rad);
        }
    }

    /// Renders until every pipeline is compiled. Otherwise the time of the first frame would include the compilation.
    fn warm_up(&mut self, pose: Pose) {
        self.place_camera(pose);
        self.update();
        while self.compiles_pipelines() {
            self.update();
        }
    }

    fn compiles_pipelines(&self) -> bool {
        let render_app = self.app.get_sub_app(RenderApp);
        let cache = render_app.and_then(|app| app.world().get_resource::<PipelineCache>());
        cache.is_some_and(|cache| cache.waiting_pipelines().next().is_some())
    }

    /// Renders one frame of the path. A requested picture arrives during a later update.
    fn render(&mut self) -> FrameNumbers {
        let [main_time, render_time, wait_time] = self.update();
        let world = self.app.world_mut();
        let mut views = world.query_filtered::<&FieldLodViewStats, With<MainCamera>>();
        FrameNumbers {
            stats: views.single(world).copied().unwrap_or_default(),
            main_time,
            render_time,
            wait_time,
        }
    }

    fn request_picture(&mut self, number: u32) {
        let sender = self.picture_sender.clone();
        let send = move |captured: On<ScreenshotCaptured>| {
            // Sending fails if the run has failed and dropped the receiver.
            sender.send((number, captured.image.clone())).ok();
        };
        let screenshot = Screenshot::image(self.target.clone());
        self.app.world_mut().spawn(screenshot).observe(send);
    }

    /// Writes the pictures that have arrived. Returns their count.
    fn write_pictures(&self, directory: &Path) -> Result<usize, String> {
        let mut count = 0;
        for (number, picture) in self.pictures.try_iter() {
            let file = directory.join(format!("frame_{number:03}.png"));
            let could_not = |error: &dyn std::fmt::Display| {
                format!("could not write the picture {}: {error}", file.display())
            };
            let picture = picture.try_into_dynamic();
            let picture = picture.map_err(|error| could_not(&error))?.to_rgb8();
            picture.save(&file).map_err(|error| could_not(&error))?;
            count += 1;
        }
        Ok(count)
    }
}

/// Creates the directory, and checks that files can be written to it.
fn check_writable(directory: &Path) -> Result<(), String> {
    let could_not = |error| {
        format!(
            "could not write pictures to {}: {error}",
            directory.display()
        )
    };
    std::fs::create_dir_all(directory).map_err(could_not)?;
    let probe = directory.join(".walkthrough-probe");
    std::fs::write(&probe, []).map_err(could_not)?;
    std::fs::remove_file(&probe).map_err(could_not)
}

/// Bevy's plugins without a window. If `draws` is false, they have no renderer.
fn plugins(draws: bool) -> impl PluginGroup {
    scene::default_plugins(draws)
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
        .set(RenderPlugin {
            // Otherwise meshes would be missing until their pipelines are compiled.
            synchronous_pipeline_compilation: true,
            ..adapter::render_plugin(draws)
        })
        .disable::<WinitPlugin>()
        // Otherwise an update would render the frame of the previous update.
        .disable::<PipelinedRenderingPlugin>()
}
