//! Whole frames of a field of rocks with Bevy's meshlets and at full detail, on the adapter at hand.
//!
//! `cargo run --release --manifest-path tests/benches/meshlets/Cargo.toml -- 45`, with the number of rocks. It is a
//! program of its own because Bevy's meshlets link meshoptimizer 0.6 and this project 0.7, under the same C symbols.
//! The rocks, the camera and the sun resemble those of the scene `boulders` of the bench `whole_frame`. Times can
//! be compared as shares of the time at full detail. Image errors are differences from full detail in both programs.
//! The exit code is 2 if the adapter cannot run meshlets.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use bevy::app::PluginsState;
use bevy::camera::RenderTarget;
use bevy::color::palettes::css;
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::light::CascadeShadowConfigBuilder;
use bevy::log::LogPlugin;
use bevy::mesh::VertexAttributeValues;
use bevy::pbr::experimental::meshlet::{
    MESHLET_DEFAULT_VERTEX_POSITION_QUANTIZATION_FACTOR, MeshletMesh, MeshletMesh3d, MeshletPlugin,
};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::{PollType, TextureFormat};
use bevy::render::renderer::RenderDevice;
use bevy::render::settings::WgpuSettings;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::tasks::{block_on, tick_global_task_pools_on_main_thread};
use bevy::window::ExitCondition;

/// Shapes of rocks, and 81,920 triangles in each.
const SHAPES: usize = 3;
const SUBDIVISIONS: u32 = 63;
/// Steps of the camera for timed frames, and rounds over them.
const STEPS: u8 = 7;
const ROUNDS: usize = 20;
/// Steps of the camera whose pictures are compared.
const COMPARED: [u8; 2] = [0, 6];
/// Frames until everything is uploaded, and the pause after each.
const WARM_UP: usize = 20;
const PAUSE: Duration = Duration::from_millis(50);
const CLUSTER_BUFFER_SLOTS: u32 = 1 << 22;
/// The exit code if the adapter cannot run meshlets.
const CANNOT_RUN: u8 = 2;

#[derive(Clone, Copy, PartialEq)]
enum Method {
    Full,
    Meshlets,
}

fn main() -> ExitCode {
    let rocks = std::env::args().nth(1).and_then(|arg| arg.parse().ok());
    if let Err(error) = check_adapter() {
        eprintln!("meshlets: {error}");
        return ExitCode::from(CANNOT_RUN);
    }
    let mut scenes =
        [Method::Full, Method::Meshlets].map(|method| Scene::new(method, rocks.unwrap_or(45)));
    let [full, meshlets] = scenes
        .each_mut()
        .map(|scene| COMPARED.map(|step| scene.picture(step)));
    println!(
        "image error of meshlets: RMSE {:.2} of 255",
        rmse(&meshlets, &full)
    );
    let mut times = [const { Vec::new() }; 2];
    for _ in 0..ROUNDS {
        for step in 0..STEPS {
            for (scene, times) in scenes.iter_mut().zip(&mut times) {
                times.push(scene.frame(step));
            }
        }
    }
    println!("method: whole frame, main world, render world with the extraction, ms");
    for (name, times) in ["full detail", "meshlets"].iter().zip(&times) {
        let [whole, main, render] = [0, 1, 2].map(|part| median_ms(times, part));
        println!("{name}: {whole:.2}, {main:.2}, {render:.2}");
    }
    ExitCode::SUCCESS
}

/// Checks that the adapter that Bevy requests by default can run meshlets.
fn check_adapter() -> Result<(), String> {
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..wgpu::RequestAdapterOptions::default()
    }));
    let adapter = adapter.map_err(|error| format!("could not find an adapter: {error}"))?;
    let missing = MeshletPlugin::required_wgpu_features() - adapter.features();
    if missing.is_empty() {
        return Ok(());
    }
    let missing: Vec<&str> = missing.iter_names().map(|(name, _)| name).collect();
    let (name, missing) = (adapter.get_info().name, missing.join(", "));
    Err(format!(
        "{name} cannot run meshlets: missing features {missing}"
    ))
}

/// The rocks in an app of their own.
struct Scene {
    app: App,
    camera: Entity,
    target: Handle<Image>,
}

/// The last picture that was read back: four bytes a pixel.
#[derive(Resource, Default)]
struct Picture(Vec<u8>);

impl Scene {
    fn new(method: Method, rocks: u32) -> Self {
        let mut app = app(method);
        let world = app.world_mut();
        place_rocks(world, method, rocks);
        place_sun(world);
        world.init_resource::<Picture>();
        let (camera, target) = place_camera(world);
        let mut scene = Self {
            app,
            camera,
            target,
        };
        for _ in 0..WARM_UP {
            scene.frame(0);
            std::thread::sleep(PAUSE);
        }
        scene
    }

    /// Draws a frame and reads it back.
    fn picture(&mut self, step: u8) -> Vec<u8> {
        self.frame(step);
        let shot = Screenshot::image(self.target.clone());
        let keep = |shot: On<ScreenshotCaptured>, mut picture: ResMut<Picture>| {
            picture.0 = shot.image.data.clone().unwrap_or_default();
        };
        self.app.world_mut().spawn(shot).observe(keep);
        loop {
            self.frame(step);
            let picture = &mut self.app.world_mut().resource_mut::<Picture>().0;
            if !picture.is_empty() {
                return std::mem::take(picture);
            }
        }
    }

    /// Draws a frame. Returns the times of the whole frame, of the main world and of the render world.
    fn frame(&mut self, step: u8) -> [Duration; 3] {
        let at = pose(step);
        self.app.world_mut().entity_mut(self.camera).insert(at);
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
        let device = self.app.world().resource::<RenderDevice>();
        // A lost device fails in the next frame.
        let _ = device.poll(PollType::wait_indefinitely());
        [start.elapsed(), main, render]
    }
}

fn app(method: Method) -> App {
    let mut settings = WgpuSettings::default();
    if method == Method::Meshlets {
        settings.features |= MeshletPlugin::required_wgpu_features();
    }
    let render = RenderPlugin {
        synchronous_pipeline_compilation: true,
        render_creation: settings.into(),
        ..default()
    };
    let window = WindowPlugin {
        primary_window: None,
        exit_condition: ExitCondition::DontExit,
        ..default()
    };
    let plugins = DefaultPlugins.set(render).set(window);
    let plugins = plugins
        .disable::<PipelinedRenderingPlugin>()
        .disable::<LogPlugin>();
    let mut app = App::new();
    app.add_plugins(plugins);
    if method == Method::Meshlets {
        app.add_plugins(MeshletPlugin {
            cluster_buffer_slots: CLUSTER_BUFFER_SLOTS,
        });
    }
    while app.plugins_state() == PluginsState::Adding {
        tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    app
}

fn place_rocks(world: &mut World, method: Method, rocks: u32) {
    let stone = StandardMaterial::from(Color::srgb(0.6, 0.55, 0.5));
    let stone = world.resource_mut::<Assets<StandardMaterial>>().add(stone);
    let shapes: [Mesh; SHAPES] = std::array::from_fn(|seed| rock(seed as u64));
    let places = (0..rocks).map(|index| (index as usize % SHAPES, place_of(index, rocks)));
    match method {
        Method::Full => {
            let mut meshes = world.resource_mut::<Assets<Mesh>>();
            let shapes = shapes.map(|shape| meshes.add(shape));
            let rocks = places.map(|(shape, at)| {
                (
                    Mesh3d(shapes[shape].clone()),
                    MeshMaterial3d(stone.clone()),
                    at,
                )
            });
            world.spawn_batch(rocks.collect::<Vec<_>>());
        }
        Method::Meshlets => {
            let factor = MESHLET_DEFAULT_VERTEX_POSITION_QUANTIZATION_FACTOR;
            let shapes = shapes.map(|shape| {
                MeshletMesh::from_mesh(&shape, factor)
                    .expect("triangles with normals and texture coordinates")
            });
            let mut meshes = world.resource_mut::<Assets<MeshletMesh>>();
            let shapes = shapes.map(|shape| meshes.add(shape));
            let rocks = places.map(|(shape, at)| {
                (
                    MeshletMesh3d(shapes[shape].clone()),
                    MeshMaterial3d(stone.clone()),
                    at,
                )
            });
            world.spawn_batch(rocks.collect::<Vec<_>>());
        }
    }
}

fn place_sun(world: &mut World) {
    let sun = DirectionalLight {
        illuminance: 6_000.0,
        shadow_maps_enabled: true,
        ..default()
    };
    let low = Transform::default().looking_to(Vec3::new(-1.0, -0.7, -0.5), Vec3::Y);
    world.spawn((sun, CascadeShadowConfigBuilder::default().build(), low));
}

fn place_camera(world: &mut World) -> (Entity, Handle<Image>) {
    let image = Image::new_target_texture(960, 540, TextureFormat::Rgba8UnormSrgb, None);
    let target = world.resource_mut::<Assets<Image>>().add(image);
    let sky = Camera {
        clear_color: Color::from(css::SKY_BLUE).into(),
        ..default()
    };
    let camera = (
        (Camera3d::default(), sky),
        RenderTarget::Image(target.clone().into()),
        pose(0),
    );
    let plain = (Tonemapping::None, DebandDither::Disabled, Msaa::Off);
    (world.spawn((camera, plain)).id(), target)
}

/// The place of a rock: higher numbers are farther away.
fn place_of(index: u32, rocks: u32) -> Transform {
    let spread = (rocks as f32 / 45.0).sqrt();
    let away = 3.0 + 90.0 * spread * (index as f32 / rocks as f32).powi(2);
    let aside = ((index as f32 * 0.618).fract() - 0.5) * away * 1.2;
    let turn = Quat::from_rotation_y(index as f32 * 2.4);
    Transform::from_xyz(aside, 0.4, -away).with_rotation(turn)
}

fn pose(step: u8) -> Transform {
    let eye = Vec3::new(0.0, 2.2, 8.0 - 0.4 * f32::from(step));
    Transform::from_translation(eye).looking_to(Vec3::new(0.1, -0.08, -1.0), Vec3::Y)
}

/// A sphere with dents of many sizes.
fn rock(seed: u64) -> Mesh {
    let waves = waves(seed);
    let mut mesh = Sphere::new(1.0)
        .mesh()
        .ico(SUBDIVISIONS)
        .expect("fewer than 80 subdivisions");
    if let Some(VertexAttributeValues::Float32x3(positions)) =
        mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION)
    {
        for position in positions {
            let direction = Vec3::from(*position);
            let dents = waves
                .iter()
                .map(|(wave, phase, height)| (direction.dot(*wave) + phase).sin() * height);
            *position = (direction * (1.0 + dents.sum::<f32>())).into();
        }
    }
    mesh.compute_smooth_normals();
    mesh
}

fn waves(seed: u64) -> Vec<(Vec3, f32, f32)> {
    let mut state = seed;
    // From −1 to 1, by splitmix64.
    let mut signed = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 40) as f32 / (1 << 23) as f32 - 1.0
    };
    let wave = |octave: i32| {
        let axis = Vec3::new(signed(), signed(), signed());
        let frequency = 1.5f32.powi(octave / 2) * 1.5;
        let height = 0.09 / frequency.max(1.0).powf(0.8);
        (
            axis.normalize_or(Vec3::X) * frequency,
            signed() * 3.0,
            height,
        )
    };
    (0..24).map(wave).collect()
}

fn rmse(pictures: &[Vec<u8>], full: &[Vec<u8>]) -> f64 {
    let bytes = pictures.iter().zip(full).flat_map(|(a, b)| a.iter().zip(b));
    // Alpha is the same in both.
    let (sum, pixels) = bytes.fold((0.0, 0.0), |(sum, count), (&a, &b)| {
        (sum + (f64::from(a) - f64::from(b)).powi(2), count + 0.25)
    });
    f64::sqrt(sum / (3.0 * pixels))
}

fn median_ms(times: &[[Duration; 3]], part: usize) -> f64 {
    let mut times: Vec<Duration> = times.iter().map(|times| times[part]).collect();
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e3
}
