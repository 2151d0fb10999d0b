//! Frame times of crowds of animated characters with a sun, with and without levels.
//!
//! `cargo bench -p fieldlod_tests --bench characters -- fox.glb 1000 0.02 knight.glb 300 1` prints medians for 1,000
//! foxes, drawn at 0.02 of their size, and for 300 knights. Commands for the GPU are recorded and dropped. With
//! `--adapter` they are executed, and the time of a frame includes the wait for them. `--together` puts all crowds into
//! one scene.
//!
//! `FIELDLOD_PICTURES=folder` writes a picture of each crowd, with `--adapter`.

use std::path::Path;
use std::time::{Duration, Instant};

use bevy::asset::UnapprovedPathMode;
use bevy::color::palettes::css;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::render::render_resource::PollType;
use bevy::render::renderer::RenderDevice;
use bevy::time::TimeUpdateStrategy;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::frame_times::{FrameTimes, drop_commands, median};
use fieldlod_tests::stage::{self, Eye, Stage};

/// Rounds in which each scene runs some timed frames, in turn.
const ROUNDS: usize = 8;
const FRAMES: usize = 6;
/// Meters between neighbours.
const SPACING: f32 = 2.0;

/// The input of a crowd: the file of its character, the number of characters, and their scale.
struct CrowdInput<'a> {
    file: &'a str,
    count: u32,
    scale: f32,
}

impl<'a> CrowdInput<'a> {
    fn of([file, count, scale]: [&'a String; 3]) -> Self {
        Self {
            file,
            count: count.parse().expect("a number of characters"),
            scale: scale.parse().expect("a scale"),
        }
    }
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let has = |name: &str| args.iter().any(|arg| arg == name);
    let rest: Vec<&String> = args.iter().filter(|arg| !arg.starts_with("--")).collect();
    let (inputs, rest) = rest.as_chunks::<3>();
    if inputs.is_empty() || !rest.is_empty() {
        return println!(
            "arguments: a glTF file, a number of characters and a scale for each crowd"
        );
    }
    let inputs: Vec<CrowdInput<'_>> = inputs.iter().map(|input| CrowdInput::of(*input)).collect();
    let inputs_per_scene = if has("--together") { inputs.len() } else { 1 };
    for inputs in inputs.chunks(inputs_per_scene) {
        for CrowdInput { file, count, .. } in inputs {
            println!("{count} of {file}, a sun");
        }
        let crowd = |has_levels| Crowd::new(inputs, has_levels, has("--adapter"));
        let methods = [("full detail", false), ("AutoLod", true)];
        print_times(&mut methods.map(|(name, has_levels)| (name, crowd(has_levels))));
    }
}

/// One or more crowds in an app of their own.
struct Crowd {
    stage: Stage,
    eye: Eye,
    executes_commands: bool,
}

impl Crowd {
    fn new(inputs: &[CrowdInput<'_>], has_levels: bool, executes_commands: bool) -> Self {
        let plugins = stage::plugins().set(AssetPlugin {
            unapproved_path_mode: UnapprovedPathMode::Allow,
            ..default()
        });
        let mut stage = Stage::stock_with(plugins).expect("an adapter");
        stage
            .app
            .add_plugins(FieldLodPlugin)
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(
                16,
            )))
            .add_systems(Update, play_clips);
        stage.finish();
        if !executes_commands {
            drop_commands(&mut stage.app);
        }
        let pose =
            Transform::from_xyz(0.0, 6.0, 8.0).looking_to(Vec3::new(0.0, -0.35, -1.0), Vec3::Y);
        let size_px = UVec2::new(1920, 1080);
        let eye = stage.add_eye_of_size(
            size_px,
            pose,
            css::SKY_BLUE.into(),
            FieldLodCamera::default(),
        );
        let sun = DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        };
        let slope = Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y);
        stage.spawn((sun, slope));
        let mut crowd = Self {
            stage,
            eye,
            executes_commands,
        };
        for (row, input) in inputs.iter().enumerate() {
            crowd.spawn(input, row, has_levels);
        }
        crowd.load(inputs.iter().map(|input| input.count).sum(), has_levels);
        crowd
    }

    /// Spawns a crowd in a square. Further crowds stand between the characters of the first.
    fn spawn(&mut self, input: &CrowdInput<'_>, row: usize, has_levels: bool) {
        let file = Path::new(input.file).canonicalize().expect("a file");
        let world = self.stage.app.world_mut();
        let assets = world.resource::<AssetServer>();
        let clip = assets.load(GltfAssetLabel::Animation(0).from_asset(file.clone()));
        let scene = assets.load(GltfAssetLabel::Scene(0).from_asset(file));
        let columns = (input.count as f32).sqrt().ceil() as u32;
        let shift = row as f32 * 0.4;
        for index in 0..input.count {
            let [x, z] = [index % columns, index / columns].map(|at| at as f32 * SPACING + shift);
            let place = Transform::from_xyz(x - columns as f32, 0.0, -z)
                .with_scale(Vec3::splat(input.scale));
            let mut root = world.spawn((WorldAssetRoot(scene.clone()), Clip(clip.clone()), place));
            if has_levels {
                root.insert(AutoLod::default());
            }
        }
    }

    /// Draws frames until all characters are there, and have their levels.
    fn load(&mut self, count: u32, has_levels: bool) {
        let deadline = Instant::now() + Duration::from_secs(300);
        let mut players = self.stage.app.world_mut().query::<&AnimationPlayer>();
        let is_loaded = |app: &mut App| {
            let progress = *app.world().resource::<FieldLodProgress>();
            let has_all = players.iter(app.world()).len() as u32 >= count;
            has_all && progress.waiting == 0 && (progress.ready > 0) == has_levels
        };
        let mut is_loaded = is_loaded;
        while !is_loaded(&mut self.stage.app) {
            assert!(Instant::now() < deadline, "the crowd is not loaded");
            self.stage.app.update();
        }
        (0..10).for_each(|_| self.stage.app.update());
    }

    /// The time of a frame with the wait for the adapter, and its parts.
    fn draw(&mut self) -> (Duration, FrameTimes) {
        let start = Instant::now();
        let parts = FrameTimes::of_update(&mut self.stage.app);
        let device = self.stage.app.world().resource::<RenderDevice>();
        let done = device.poll(PollType::wait_indefinitely());
        done.expect("the graphics device is not lost");
        (start.elapsed(), parts)
    }
}

/// The clip of a character, on the root of its scene.
#[derive(Component)]
struct Clip(Handle<AnimationClip>);

/// Plays the clip on each new character. Each starts at another time of the clip.
fn play_clips(
    mut commands: Commands,
    clips: Query<&Clip>,
    parents: Query<&ChildOf>,
    mut graphs: ResMut<Assets<AnimationGraph>>,
    mut players: Query<(Entity, &mut AnimationPlayer), Added<AnimationPlayer>>,
    mut made: Local<HashMap<AssetId<AnimationClip>, (Handle<AnimationGraph>, AnimationNodeIndex)>>,
) {
    for (entity, mut player) in &mut players {
        let Some(clip) = parents
            .iter_ancestors(entity)
            .find_map(|root| clips.get(root).ok())
        else {
            continue;
        };
        let (graph, node) = made.entry(clip.0.id()).or_insert_with(|| {
            let (graph, node) = AnimationGraph::from_clip(clip.0.clone());
            (graphs.add(graph), node)
        });
        let playing = player.play(*node).repeat();
        playing.seek_to(entity.index_u32() as f32 * 0.37 % 0.7);
        commands
            .entity(entity)
            .insert(AnimationGraphHandle(graph.clone()));
    }
}

/// Prints the times of each crowd. The crowds run in turn.
fn print_times(crowds: &mut [(&str, Crowd)]) {
    let mut times = vec![Vec::new(); crowds.len()];
    for _ in 0..ROUNDS {
        for ((_, crowd), times) in crowds.iter_mut().zip(&mut times) {
            // The first frame of a crowd runs with cold caches.
            crowd.draw();
            times.extend((0..FRAMES).map(|_| crowd.draw()));
        }
    }
    if let Some(folder) = std::env::var_os("FIELDLOD_PICTURES") {
        for (name, crowd) in crowds
            .iter_mut()
            .filter(|(_, crowd)| crowd.executes_commands)
        {
            let [picture] = crowd.stage.shoot([&crowd.eye]);
            let file = Path::new(&folder).join(format!("{name}.png"));
            picture.save(file).expect("the folder exists");
        }
    }
    println!("medians in ms        main  extract   render    frame    triangles");
    for ((name, crowd), times) in crowds.iter_mut().zip(&times) {
        let ms = |part: fn(&(Duration, FrameTimes)) -> Duration| {
            median(times.iter().map(part)).as_secs_f64() * 1e3
        };
        let stats = crowd
            .stage
            .app
            .world()
            .get::<FieldLodViewStats>(crowd.eye.entity);
        let triangles = stats.filter(|stats| stats.triangles_full > 0);
        println!(
            "{name:<16}{:>9.2}{:>9.2}{:>9.2}{:>9.2}    {}",
            ms(|(_, parts)| parts.main),
            ms(|(_, parts)| parts.extract),
            ms(|(_, parts)| parts.render),
            ms(|(frame, _)| *frame),
            triangles.map_or(String::new(), |stats| format!(
                "{} of {}",
                stats.triangles_drawn, stats.triangles_full
            )),
        );
    }
}
