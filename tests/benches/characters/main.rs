//! Frame times of crowds of animated characters with a sun, with and without levels.
//!
//! `cargo bench -p fieldlod_tests --bench characters -- fox.glb 1000 0.02 knight.glb 300 1` prints medians for 1,000
//! foxes, drawn at 0.02 of their size, and for 300 knights. Commands for the GPU are recorded and dropped. With
//! `--adapter` they are executed, and the time of a frame includes the wait for them.

use std::path::Path;
use std::time::{Duration, Instant};

use bevy::prelude::*;
use bevy::render::render_resource::PollType;
use bevy::render::renderer::RenderDevice;
use bevy::time::TimeUpdateStrategy;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::{finish, spawn_camera};
use fieldlod_tests::frame_times::{FrameTimes, drop_commands, median};
use fieldlod_tests::stage;

/// Rounds in which each crowd runs some timed frames, in turn.
const ROUNDS: usize = 8;
const FRAMES: usize = 6;
/// Meters between neighbours.
const SPACING: f32 = 2.0;

/// A crowd: the file of the character, how many there are, and their scale.
struct Order<'a> {
    file: &'a Path,
    count: u32,
    scale: f32,
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let with_adapter = args.iter().any(|arg| arg == "--adapter");
    let args: Vec<&String> = args.iter().filter(|arg| !arg.starts_with("--")).collect();
    let (orders, rest) = args.as_chunks::<3>();
    if orders.is_empty() || !rest.is_empty() {
        return println!(
            "arguments: a glTF file, a number of characters and a scale for each crowd"
        );
    }
    for [file, count, scale] in orders {
        let order = Order {
            file: Path::new(file.as_str()),
            count: count.parse().expect("a number of characters"),
            scale: scale.parse().expect("a scale"),
        };
        println!("{count} of {file}, a sun");
        let crowd = |has_levels| Crowd::new(&order, has_levels, with_adapter);
        print_times(&mut [("full detail", crowd(false)), ("AutoLod", crowd(true))]);
    }
}

struct Crowd {
    app: App,
    camera: Entity,
}

impl Crowd {
    fn new(order: &Order<'_>, has_levels: bool, with_adapter: bool) -> Self {
        let folder = order.file.parent().expect("a file in a folder");
        let folder = folder.canonicalize().expect("a folder");
        let plugins = stage::plugins().set(AssetPlugin {
            file_path: folder.display().to_string(),
            ..default()
        });
        let mut app = App::new();
        app.add_plugins((plugins, FieldLodPlugin))
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(
                16,
            )))
            .add_systems(Update, play_clips);
        finish(&mut app);
        if !with_adapter {
            drop_commands(&mut app);
        }
        let eye =
            Transform::from_xyz(0.0, 3.0, 4.0).looking_to(Vec3::new(0.0, -0.15, -1.0), Vec3::Y);
        let camera = spawn_camera(app.world_mut(), UVec2::new(1920, 1080), eye);
        let sun = DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        };
        let slope = Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y);
        app.world_mut().spawn((sun, slope));
        let file = order
            .file
            .file_name()
            .expect("a file")
            .display()
            .to_string();
        let assets = app.world().resource::<AssetServer>();
        let clip = assets.load(GltfAssetLabel::Animation(0).from_asset(file.clone()));
        let scene = assets.load(GltfAssetLabel::Scene(0).from_asset(file));
        app.insert_resource(Clip(clip));
        let columns = (order.count as f32).sqrt().ceil() as u32;
        for index in 0..order.count {
            let [x, z] = [index % columns, index / columns].map(|at| at as f32 * SPACING);
            let place = Transform::from_xyz(x - columns as f32, 0.0, -z)
                .with_scale(Vec3::splat(order.scale));
            let mut root = app
                .world_mut()
                .spawn((WorldAssetRoot(scene.clone()), place));
            if has_levels {
                root.insert(AutoLod::default());
            }
        }
        let mut crowd = Self { app, camera };
        crowd.load(order.count, has_levels);
        crowd
    }

    /// Draws frames until all characters are there, and have their levels.
    fn load(&mut self, count: u32, has_levels: bool) {
        let deadline = Instant::now() + Duration::from_secs(300);
        let mut players = self.app.world_mut().query::<&AnimationPlayer>();
        let is_loaded = |app: &mut App| {
            let progress = *app.world().resource::<FieldLodProgress>();
            let has_all = players.iter(app.world()).len() as u32 >= count;
            has_all && progress.waiting == 0 && (progress.ready > 0) == has_levels
        };
        let mut is_loaded = is_loaded;
        while !is_loaded(&mut self.app) {
            assert!(Instant::now() < deadline, "the crowd is not loaded");
            self.app.update();
        }
        (0..10).for_each(|_| self.app.update());
    }

    /// The time of a frame with the wait for the adapter, and its parts.
    fn draw(&mut self) -> (Duration, FrameTimes) {
        let start = Instant::now();
        let parts = FrameTimes::of_update(&mut self.app);
        let device = self.app.world().resource::<RenderDevice>();
        let done = device.poll(PollType::wait_indefinitely());
        done.expect("the graphics device is not lost");
        (start.elapsed(), parts)
    }
}

#[derive(Resource)]
struct Clip(Handle<AnimationClip>);

/// Plays the clip on each new character, each at its own time.
fn play_clips(
    mut commands: Commands,
    clip: Res<Clip>,
    mut graphs: ResMut<Assets<AnimationGraph>>,
    mut players: Query<(Entity, &mut AnimationPlayer), Added<AnimationPlayer>>,
    mut graph: Local<Option<(Handle<AnimationGraph>, AnimationNodeIndex)>>,
) {
    for (entity, mut player) in &mut players {
        let (graph, node) = graph.get_or_insert_with(|| {
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
    println!("medians in ms        main  extract   render    frame    triangles");
    for ((name, crowd), times) in crowds.iter_mut().zip(&times) {
        let ms = |part: fn(&(Duration, FrameTimes)) -> Duration| {
            median(times.iter().map(part)).as_secs_f64() * 1e3
        };
        let stats = crowd.app.world().get::<FieldLodViewStats>(crowd.camera);
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
