//! The path without a window: pictures of it, or without an adapter just its numbers.

use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use bevy::app::PluginsState;
use bevy::camera::RenderTarget;
use bevy::diagnostic::{Diagnostic, DiagnosticsStore};
use bevy::prelude::*;
use bevy::render::diagnostic::RenderDiagnosticsPlugin;
use bevy::render::mesh::allocator::MeshAllocator;
use bevy::render::mesh::{RenderMesh, RenderMeshBufferInfo};
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{PipelineCache, PollType, TextureFormat};
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice};
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::render::{RenderApp, RenderPlugin};
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_fieldlod::prelude::*;

use crate::args::Args;
use crate::cameras::{self, CameraTarget, MainCamera};
use crate::models::Models;
use crate::path::{CameraPath, DURATION_IN_S, Pose};
use crate::pictures::PictureWriter;
use crate::quality::Quality;
use crate::report::{self, FrameNumbers, SceneNumbers, Times};
use crate::scene::{self, SceneSize};
use crate::{adapter, hud};

/// Most updates to wait for a picture that the GPU has been asked for.
const CAPTURE_UPDATES: u32 = 100;

/// What comes of a way along the path, besides the summary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Output<'a> {
    /// Nothing is drawn.
    Numbers,
    /// Frames are drawn for their times.
    Times,
    /// Pictures in this directory.
    Pictures(&'a Path),
}

/// Goes along the path, then prints the summary.
pub(crate) fn run(args: &Args, quality: &Quality, output: Output) -> Result<(), String> {
    let begun = Instant::now();
    let frames = args.frames(quality.frames)?;
    let size_in_px = quality.size_in_px.into();
    let mut writer = match output {
        Output::Pictures(directory) => {
            let writer = PictureWriter::new(directory, &frames, size_in_px, args)?;
            Some(writer)
        }
        Output::Numbers | Output::Times => None,
    };
    let mut renderer = Renderer::new(args, quality, output);
    let bake_time = renderer.wait_for_levels()?;

    // Every frame, and pictures as they come.
    let path = CameraPath::new();
    renderer.warm_up(path.pose(frames.first().map_or(0.0, |(_, round)| *round)));
    let first_picture_time = begun.elapsed();
    renderer.sharpen();
    let times = Times {
        bake: bake_time,
        first_picture: first_picture_time,
        sharp: begun.elapsed(),
    };
    let mut numbers = Vec::new();
    let round_time = Duration::from_secs_f32(DURATION_IN_S);
    let stretch = args.stretch.end - args.stretch.start;
    renderer.time_between_frames = round_time.mul_f32(stretch) / quality.frames;
    for &(number, round) in &frames {
        renderer.go_to(path.pose(round));
        if writer.is_some() {
            renderer.ask_for_picture(number);
        }
        numbers.push(renderer.render());
        if let Some(writer) = &mut writer {
            renderer.write_pictures(writer)?;
            eprintln!("walkthrough: frame {} of {}", numbers.len(), frames.len());
        }
    }

    // The last pictures, and what shows all of them.
    if let Some(mut writer) = writer {
        for _ in 0..CAPTURE_UPDATES {
            if writer.is_complete() {
                break;
            }
            renderer.update();
            renderer.write_pictures(&mut writer)?;
        }
        writer.finish()?;
    }
    report::print(quality, &renderer.scene_numbers(times), &numbers);
    Ok(())
}

/// The app, driven update by update, each of which ends when the GPU is done.
struct Renderer {
    app: App,
    target: Handle<Image>,
    draws: bool,
    /// What passes on the app's clocks between frames of the path of a world in parts.
    time_between_frames: Duration,
    pictures: Receiver<(u32, Image)>,
    picture_sender: Sender<(u32, Image)>,
}

impl Renderer {
    fn new(args: &Args, quality: &Quality, output: Output) -> Self {
        let draws = output != Output::Numbers;
        let mut app = App::new();
        app.add_plugins(plugins(draws));
        if output == Output::Times {
            app.add_plugins(RenderDiagnosticsPlugin);
        }
        let UVec2 { x, y } = quality.size_in_px;
        let target = Image::new_target_texture(x, y, TextureFormat::Rgba8UnormSrgb, None);
        let target = app.world_mut().resource_mut::<Assets<Image>>().add(target);
        let camera_target = RenderTarget::Image(target.clone().into());
        app.insert_resource(CameraTarget(camera_target));
        scene::add_to(&mut app, args, quality);
        app.add_plugins(hud::labels_plugin);

        // What a runner does before the first update.
        while app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();
        let (picture_sender, pictures) = channel();
        Self {
            app,
            target,
            draws,
            time_between_frames: Duration::ZERO,
            pictures,
            picture_sender,
        }
    }

    /// Runs one update as [`App::update`] does, until the GPU has drawn it; returns what of it the main world took, what
    /// the render world, and what the GPU from then on.
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
            done.expect("the graphics device answers");
        }
        [main, render, start.elapsed() - main - render]
    }

    /// Runs updates until every mesh has its levels of detail; returns how long that took. Nothing is
    /// drawn meanwhile: baking gets the processor.
    fn wait_for_levels(&mut self) -> Result<Duration, String> {
        let start = Instant::now();
        let mut last_line = Instant::now();
        loop {
            self.update();
            let FieldLodProgress {
                waiting,
                ready,
                plain,
                ..
            } = *self.app.world().resource();
            let models_awaited = self.app.world().resource::<Models>().awaited;
            if waiting + models_awaited as u32 == 0 && ready + plain > 0 {
                break;
            }
            if models_awaited == 0 && self.scene_size().0 == 0 {
                return Err("there is nothing to walk through".into());
            }
            if last_line.elapsed() > Duration::from_secs(2) {
                last_line = Instant::now();
                eprintln!("walkthrough: levels of detail: {ready} meshes ready, {waiting} waiting");
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let bake_time = start.elapsed();
        let seconds = bake_time.as_secs_f32();
        eprintln!("walkthrough: levels of detail ready after {seconds:.1} s");
        Ok(bake_time)
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

    /// Renders until every pipeline is compiled, so that the first frame is timed like the others.
    fn warm_up(&mut self, pose: Pose) {
        self.place_camera(pose);
        self.update();
        while self.compiles_pipelines() || self.waits_for_cards() {
            self.update();
        }
    }

    /// Whether plants are drawn with triangles until the pipelines of cards are there; see the guide's "Plants far away
    /// as cards".
    fn waits_for_cards(&mut self) -> bool {
        let world = self.app.world_mut();
        let mut names = world.query::<&Name>();
        self.draws
            && names
                .iter(world)
                .any(|name| name.as_str() == "pipelines of cards")
    }

    fn compiles_pipelines(&self) -> bool {
        let render_app = self.app.get_sub_app(RenderApp);
        let cache = render_app.and_then(|app| app.world().get_resource::<PipelineCache>());
        cache.is_some_and(|cache| cache.waiting_pipelines().next().is_some())
    }

    /// Runs updates until a world that is read in parts is as fine as is wanted from here.
    fn sharpen(&mut self) {
        let memory = |app: &App| *app.world().resource::<FieldLodMemory>();
        let is_in_parts = memory(&self.app).wanted_bytes > 0;
        if !(is_in_parts && self.draws) {
            return;
        }
        let set_clock = |app: &mut App, step| {
            app.insert_resource(TimeUpdateStrategy::ManualDuration(step));
        };
        set_clock(&mut self.app, self.time_between_frames);
        self.update();
        // However long that takes.
        set_clock(&mut self.app, Duration::ZERO);
        while memory(&self.app).missing_pages > 0 {
            self.update();
        }
        self.update();
    }

    /// Places the camera, and waits for what is read in parts.
    fn go_to(&mut self, pose: Pose) {
        self.place_camera(pose);
        self.sharpen();
    }

    /// Renders one frame of the path; a picture that was asked for arrives during a later update.
    fn render(&mut self) -> FrameNumbers {
        let start = Instant::now();
        let [main_time, render_time, wait_time] = self.update();
        let frame_time = start.elapsed();

        let world = self.app.world_mut();
        let mut views = world.query_filtered::<&FieldLodViewStats, With<MainCamera>>();
        let stats = views.single(world).copied().unwrap_or_default();
        FrameNumbers {
            triangles_drawn: stats.triangles_drawn,
            triangles_full: stats.triangles_full,
            units_drawn: u64::from(stats.units_drawn),
            selection_time: stats.selection_time,
            frame_time,
            main_time,
            render_time,
            wait_time,
            passes_ms: self.passes_ms(),
            mesh_bytes: self.mesh_bytes(),
            buffer_bytes: self.buffer_bytes(),
            memory: *self.app.world().resource(),
        }
    }

    /// What the passes of the last frame whose times have come back took by the GPU's clock, together, but those of
    /// shadows, which Bevy does not time. `None` where it has no clock or nobody asked.
    fn passes_ms(&self) -> Option<f64> {
        let store = self.app.world().get_resource::<DiagnosticsStore>()?;
        // Passes alone, not what they are made of.
        let is_pass = |diagnostic: &&Diagnostic| {
            let path = diagnostic.path().as_str();
            path.ends_with("/elapsed_gpu") && path.matches('/').count() == 2
        };
        let passes = store.iter().filter(is_pass);
        passes.filter_map(Diagnostic::value).reduce(|a, b| a + b)
    }

    fn ask_for_picture(&mut self, number: u32) {
        let sender = self.picture_sender.clone();
        let send = move |captured: On<ScreenshotCaptured>| {
            // Nobody listens any more once the run has failed.
            sender.send((number, captured.image.clone())).ok();
        };
        let screenshot = Screenshot::image(self.target.clone());
        self.app.world_mut().spawn(screenshot).observe(send);
    }

    /// Writes the pictures that have come back.
    fn write_pictures(&self, writer: &mut PictureWriter) -> Result<(), String> {
        let mut pictures = self.pictures.try_iter();
        pictures.try_for_each(|(number, picture)| writer.add(number, picture))
    }

    /// What all meshes take on the GPU.
    fn mesh_bytes(&self) -> u64 {
        let render_world = self.app.get_sub_app(RenderApp).map(SubApp::world);
        let meshes =
            render_world.and_then(|world| world.get_resource::<RenderAssets<RenderMesh>>());
        let bytes = |mesh: &RenderMesh| {
            let indices = match mesh.buffer_info {
                RenderMeshBufferInfo::Indexed {
                    count,
                    index_format,
                } => u64::from(count) * index_format.byte_size() as u64,
                RenderMeshBufferInfo::NonIndexed => 0,
            };
            u64::from(mesh.vertex_count) * mesh.layout.0.layout().array_stride + indices
        };
        let meshes = meshes.into_iter().flat_map(RenderAssets::iter);
        meshes.map(|(_, mesh)| bytes(mesh)).sum()
    }

    /// What Bevy holds for meshes on the GPU: buffers grow by half, and go once they are empty.
    fn buffer_bytes(&self) -> u64 {
        let render_world = self.app.get_sub_app(RenderApp).map(SubApp::world);
        let allocator = render_world.and_then(|world| world.get_resource::<MeshAllocator>());
        allocator.map_or(0, |allocator| allocator.slabs_size())
    }

    /// Instances and their triangles.
    fn scene_size(&self) -> (u64, u64) {
        let world = self.app.world();
        let (own, models) = (world.resource::<SceneSize>(), world.resource::<Models>());
        (
            own.instances + models.instances,
            own.source_triangles + models.source_triangles,
        )
    }

    fn scene_numbers(&self, times: Times) -> SceneNumbers {
        let world = self.app.world();
        let adapter = world.get_resource::<RenderAdapterInfo>();
        let (instances, source_triangles) = self.scene_size();
        SceneNumbers {
            adapter: adapter.map(|adapter| adapter.name.clone()),
            instances,
            source_triangles,
            generation_time: world.resource::<SceneSize>().generation_time,
            times,
        }
    }
}

/// Bevy's plugins without a window; if nothing `draws`, without a renderer.
fn plugins(draws: bool) -> impl PluginGroup {
    scene::default_plugins(draws)
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
        .set(RenderPlugin {
            // A frame shows all its meshes only if their pipelines are compiled in it.
            synchronous_pipeline_compilation: true,
            ..adapter::render_plugin(draws)
        })
        .disable::<WinitPlugin>()
        // An update then renders the very frame that it has prepared.
        .disable::<PipelinedRenderingPlugin>()
}
