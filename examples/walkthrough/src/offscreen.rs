//! Pictures of the path, without a window.

use std::path::{Path, PathBuf};
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
use image::RgbImage;

use crate::animation::Animation;
use crate::args::Args;
use crate::cameras::{self, CameraTarget, MainCamera};
use crate::contact_sheet::ContactSheet;
use crate::guests::Guests;
use crate::path::{CameraPath, DURATION_IN_S, Pose};
use crate::report::{self, FrameNumbers, SceneNumbers};
use crate::stage::{self, SceneSize};
use crate::{flight, hud};

/// Most updates to wait for a picture that the GPU has been asked for.
const CAPTURE_UPDATES: u32 = 100;

/// The app, driven update by update, each of which ends when the GPU is done.
struct Studio {
    app: App,
    target: Handle<Image>,
    pictures: Receiver<(u32, Image)>,
    camera_shutter: Sender<(u32, Image)>,
}

/// Renders the frames of the path to `directory`, then prints the summary.
pub(crate) fn run(args: &Args, directory: &Path) -> Result<(), String> {
    let frames = args.frames()?;
    prepare_directory(directory)?;
    let mut studio = Studio::new(args);
    let bake_time = studio.wait_for_the_scene();

    let path = CameraPath::new();
    studio.warm_up(path.pose(frames.first().map_or(0.0, |(_, round)| *round)));
    let mut album = Album::new(directory, &frames, args);
    let mut numbers = Vec::new();
    for &(number, round) in &frames {
        numbers.push(studio.shoot(number, path.pose(round)));
        for (number, picture) in studio.pictures.try_iter() {
            album.add(number, picture)?;
        }
        eprintln!("walkthrough: frame {} of {}", numbers.len(), frames.len());
    }
    for _ in 0..CAPTURE_UPDATES {
        if album.is_complete() {
            break;
        }
        studio.update();
        for (number, picture) in studio.pictures.try_iter() {
            album.add(number, picture)?;
        }
    }
    album.finish()?;
    report::print(args, &studio.scene_numbers(bake_time), &numbers);
    Ok(())
}

fn prepare_directory(directory: &Path) -> Result<(), String> {
    let cannot_write = |fault| format!("{}: cannot write here: {fault}", directory.display());
    std::fs::create_dir_all(directory).map_err(cannot_write)?;
    let probe = directory.join(".walkthrough-probe");
    std::fs::write(&probe, []).map_err(cannot_write)?;
    std::fs::remove_file(&probe).map_err(cannot_write)
}

impl Studio {
    fn new(args: &Args) -> Self {
        let mut app = App::new();
        let plugins = stage::default_plugins()
            .set(WindowPlugin {
                primary_window: None,
                exit_condition: ExitCondition::DontExit,
                ..default()
            })
            .set(RenderPlugin {
                // A frame shows all its meshes only if their pipelines are compiled in it.
                synchronous_pipeline_compilation: true,
                ..default()
            })
            .disable::<WinitPlugin>()
            // An update then renders the very frame that it has prepared.
            .disable::<PipelinedRenderingPlugin>();
        app.add_plugins(plugins);
        let target = Image::new_target_texture(
            args.size.width,
            args.size.height,
            TextureFormat::Rgba8UnormSrgb,
            None,
        );
        let target = app.world_mut().resource_mut::<Assets<Image>>().add(target);
        let camera_target = RenderTarget::Image(target.clone().into());
        app.insert_resource(CameraTarget(Some(camera_target)));
        stage::set(&mut app, args);
        app.add_plugins(hud::labels_plugin);
        while app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();
        let (camera_shutter, pictures) = channel();
        Self {
            app,
            target,
            pictures,
            camera_shutter,
        }
    }

    /// One update, until the GPU has drawn it.
    fn update(&mut self) {
        self.app.update();
        let device = self.app.world().resource::<RenderDevice>();
        let done = device.poll(PollType::wait_indefinitely());
        done.expect("the graphics device answers");
    }

    /// Updates until every mesh has its levels of detail and every pipeline is compiled; returns
    /// how long the levels took. The camera still sees nothing: baking gets the processor.
    fn wait_for_the_scene(&mut self) -> Duration {
        let start = Instant::now();
        let mut last_line = Instant::now();
        loop {
            self.update();
            let status = *self.app.world().resource::<FieldLodProgress>();
            let settled = status.waiting == 0 && status.ready + status.plain > 0;
            if settled && self.app.world().resource::<Guests>().awaited == 0 {
                break;
            }
            if last_line.elapsed() > Duration::from_secs(2) {
                last_line = Instant::now();
                let FieldLodProgress { waiting, ready, .. } = status;
                eprintln!("walkthrough: levels of detail: {ready} meshes ready, {waiting} waiting");
            }
        }
        let bake_time = start.elapsed();
        eprintln!(
            "walkthrough: levels of detail ready after {:.1} s",
            bake_time.as_secs_f32()
        );
        bake_time
    }

    fn place_camera(&mut self, pose: Pose) {
        let world = self.app.world_mut();
        let mut cameras =
            world.query_filtered::<(&mut Transform, &mut Projection), With<MainCamera>>();
        for (mut place, mut projection) in cameras.iter_mut(world) {
            *place = flight::at_pose(pose);
            cameras::zoom(&mut projection, pose.fov_in_rad);
        }
    }

    /// Renders until every pipeline is compiled, so that the first frame is timed like the others.
    fn warm_up(&mut self, pose: Pose) {
        self.place_camera(pose);
        self.update();
        while self.compiles_pipelines() {
            self.update();
        }
    }

    /// Renders one frame; its picture arrives during a later update.
    fn shoot(&mut self, number: u32, pose: Pose) -> FrameNumbers {
        self.place_camera(pose);
        let start = Instant::now();
        self.ask_for_picture(number);
        self.update();
        self.frame_numbers(start.elapsed())
    }

    fn compiles_pipelines(&self) -> bool {
        let render_app = self.app.get_sub_app(RenderApp);
        let cache = render_app.and_then(|app| app.world().get_resource::<PipelineCache>());
        cache.is_some_and(|cache| cache.waiting_pipelines().next().is_some())
    }

    fn ask_for_picture(&mut self, number: u32) {
        let shutter = self.camera_shutter.clone();
        let send = move |captured: On<ScreenshotCaptured>| {
            // Nobody listens any more once the run has failed.
            shutter.send((number, captured.image.clone())).ok();
        };
        let screenshot = Screenshot::image(self.target.clone());
        self.app.world_mut().spawn(screenshot).observe(send);
    }

    fn frame_numbers(&mut self, frame_time: Duration) -> FrameNumbers {
        let world = self.app.world_mut();
        let mut views = world.query_filtered::<&FieldLodViewStats, With<MainCamera>>();
        let stats = views.single(world).copied().unwrap_or_default();
        FrameNumbers {
            triangles_drawn: stats.triangles_drawn,
            triangles_full: stats.triangles_full,
            units_drawn: u64::from(stats.units_drawn),
            selection_time: stats.selection_time,
            frame_time: Some(frame_time),
        }
    }

    fn scene_numbers(&self, bake_time: Duration) -> SceneNumbers {
        let world = self.app.world();
        let own = world.resource::<SceneSize>();
        let guests = world.resource::<Guests>();
        SceneNumbers {
            adapter: Some(world.resource::<RenderAdapterInfo>().name.clone()),
            instances: own.instances + guests.instances,
            source_triangles: own.source_triangles + guests.source_triangles,
            generation_time: own.generation_time,
            bake_time,
        }
    }
}

/// Writes pictures as they come.
struct Album {
    directory: PathBuf,
    numbers: Vec<u32>,
    sheet: ContactSheet,
    animation: Option<Animation>,
    missing: usize,
}

impl Album {
    fn new(directory: &Path, frames: &[(u32, f32)], args: &Args) -> Self {
        let size = (args.size.width, args.size.height);
        Self {
            directory: directory.to_owned(),
            numbers: frames.iter().map(|(number, _)| *number).collect(),
            sheet: ContactSheet::new(frames.len() as u32, size),
            animation: args.animation.as_deref().map(|file| {
                let stretch = args.stretch();
                let duration_in_s = (stretch.to - stretch.from) * DURATION_IN_S;
                Animation::new(file, frames.len(), duration_in_s)
            }),
            missing: frames.len(),
        }
    }

    fn add(&mut self, number: u32, picture: Image) -> Result<(), String> {
        let picture = picture
            .try_into_dynamic()
            .map_err(|fault| fault.to_string())?;
        let picture = picture.to_rgb8();
        self.save(&format!("frame_{number:03}.png"), &picture)?;
        if let Some(index) = self.numbers.iter().position(|n| *n == number) {
            self.sheet.put(index as u32, &picture);
            if let Some(animation) = &mut self.animation {
                animation.put(index, &picture);
            }
        }
        self.missing -= 1;
        Ok(())
    }

    fn is_complete(&self) -> bool {
        self.missing == 0
    }

    /// Writes the contact sheet; a single picture needs none.
    fn finish(mut self) -> Result<(), String> {
        if self.missing > 0 {
            return Err(format!(
                "{} pictures never came back from the GPU",
                self.missing
            ));
        }
        if self.numbers.len() > 1 {
            let sheet = std::mem::replace(&mut self.sheet, ContactSheet::new(1, (1, 1)));
            self.save("contact_sheet.png", &sheet.into_image())?;
        }
        self.animation.take().map_or(Ok(()), Animation::save)
    }

    fn save(&self, name: &str, picture: &RgbImage) -> Result<(), String> {
        let file = self.directory.join(name);
        let written = picture.save(&file);
        written.map_err(|fault| format!("{}: {fault}", file.display()))
    }
}
