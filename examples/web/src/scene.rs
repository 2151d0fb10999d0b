//! The scene, its lights and its cameras.

use bevy::camera::visibility::VisibilityRange;
use bevy::camera::{ScalingMode, Viewport};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::light::CascadeShadowConfigBuilder;
use bevy::prelude::*;
use bevy::world_serialization::WorldInstanceReady;

use crate::controls::CONTROLS;

/// Side of the square of ground.
pub(crate) const SIDE_IN_M: f32 = 160.0;
/// The glTF files of the ground, without extension.
pub(crate) const GROUND: [&str; 4] = ["ground_0", "ground_1", "ground_2", "ground_3"];
/// The glTF files of props: a scene of each has all places of one prop.
pub(crate) const PROPS: [&str; 2] = ["rocks", "bushes"];
/// The glTF files of hand-made levels of the props, and where they are drawn, in metres.
const RANGES: [(&str, [f32; 2]); 5] = [
    (PROPS[0], [0.0, 15.0]),
    ("rocks_1", [15.0, 40.0]),
    ("rocks_2", [40.0, f32::INFINITY]),
    (PROPS[1], [0.0, 15.0]),
    ("bushes_1", [15.0, f32::INFINITY]),
];
const DANCERS: u8 = 5;

/// What the page asks for.
#[derive(Resource, Clone, Copy, Debug)]
pub(crate) struct Options {
    /// The number of copies of all props.
    pub(crate) copies: u32,
    /// Whether nothing moves, so that pictures can be compared.
    pub(crate) is_still: bool,
    /// Whether props have hand-made levels, for measurements without the plugin.
    pub(crate) has_ranges: bool,
}

/// The camera that the player orbits.
#[derive(Component)]
pub(crate) struct Orbit;

#[derive(Component)]
struct Minimap;

pub(crate) fn plugin(app: &mut App) {
    app.insert_resource(ClearColor(Color::srgb(0.55, 0.7, 0.85)))
        .add_systems(Startup, setup)
        .add_systems(Update, (start_dance, orbit, place_minimap));
}

fn setup(mut commands: Commands, assets: Res<AssetServer>, options: Res<Options>) {
    let scene = |name: &str| {
        let file = format!("{name}.gltf");
        WorldAssetRoot(assets.load(GltfAssetLabel::Scene(0).from_asset(file)))
    };
    for name in GROUND {
        commands.spawn(scene(name));
    }
    let mut props = Vec::from(PROPS.map(|name| (name, None)));
    if options.has_ranges {
        props = Vec::from(RANGES.map(|(name, range)| (name, Some(range))));
    }
    for (name, range) in props {
        for copy in 0..options.copies {
            let place = Vec3::new((copy % 8) as f32, 0.0, (copy / 8) as f32) * -SIDE_IN_M;
            let place = Transform::from_translation(place);
            let mut prop = commands.spawn((scene(name), place));
            if let Some([from, to]) = range {
                prop.insert(VisibilityRange::abrupt(from, to));
                prop.observe(inherit_range);
            }
        }
    }
    for index in 0..DANCERS {
        let place = Transform::from_xyz(2.0 * f32::from(index) - 4.0, 0.5, 44.0);
        commands.spawn((scene("dancer"), place));
    }
    commands.spawn((
        DirectionalLight {
            illuminance: 4000.0,
            shadow_maps_enabled: true,
            ..default()
        },
        // WebGL2 has one cascade.
        CascadeShadowConfigBuilder {
            num_cascades: 1,
            maximum_distance: 120.0,
            ..default()
        }
        .build(),
        Transform::default().looking_to(Vec3::new(-1.0, -1.0, -0.5), Vec3::Y),
    ));
    let eye = Transform::from_xyz(0.0, 9.0, 60.0).looking_at(Vec3::ZERO, Vec3::Y);
    // The lookup table of the default needs more of Bevy's features.
    commands.spawn((Camera3d::default(), Tonemapping::AcesFitted, eye, Orbit));
    let mut map = OrthographicProjection::default_3d();
    map.scaling_mode = ScalingMode::FixedVertical {
        viewport_height: SIDE_IN_M,
    };
    commands.spawn((
        Camera3d::default(),
        Camera {
            order: 1,
            ..default()
        },
        Tonemapping::AcesFitted,
        Projection::Orthographic(map),
        Transform::from_xyz(0.0, 50.0, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z),
        Minimap,
    ));
}

/// Meshes of a scene are drawn in the range of its root.
fn inherit_range(
    scene: On<WorldInstanceReady>,
    mut commands: Commands,
    ranges: Query<&VisibilityRange>,
    children: Query<&Children>,
    meshes: Query<(), With<Mesh3d>>,
) -> Result {
    let range = ranges.get(scene.entity)?;
    let meshes = children
        .iter_descendants(scene.entity)
        .filter(|child| meshes.contains(*child));
    for mesh in meshes {
        commands.entity(mesh).insert(range.clone());
    }
    Ok(())
}

/// The minimap is in the upper right corner.
fn place_minimap(mut camera: Single<&mut Camera, With<Minimap>>) {
    let Some(screen) = camera.physical_target_size() else {
        return;
    };
    let side = screen.min_element() / 3;
    let viewport = Viewport {
        physical_position: UVec2::new(screen.x - side, 0),
        physical_size: UVec2::splat(side),
        ..default()
    };
    let size = |viewport: &Viewport| (viewport.physical_position, viewport.physical_size);
    if side > 0 && camera.viewport.as_ref().map(size) != Some(size(&viewport)) {
        camera.viewport = Some(viewport);
    }
}

/// Moves the camera around the middle as the player drags.
fn orbit(mut camera: Single<&mut Transform, With<Orbit>>) {
    let mut controls = CONTROLS.lock().expect("no panic");
    let [yaw, pitch] = std::mem::take(&mut controls.turn);
    let zoom = std::mem::replace(&mut controls.zoom, 1.0);
    if [yaw, pitch, zoom] == [0.0, 0.0, 1.0] {
        return;
    }
    let eye = camera.translation;
    let distance = (eye.length() * zoom).clamp(5.0, SIDE_IN_M);
    let yaw = eye.x.atan2(eye.z) + yaw;
    let pitch = ((eye.y / eye.length()).asin() + pitch).clamp(0.1, 1.5);
    let turn = Quat::from_rotation_y(yaw) * Quat::from_rotation_x(-pitch);
    **camera =
        Transform::from_translation(turn * Vec3::Z * distance).looking_at(Vec3::ZERO, Vec3::Y);
}

fn start_dance(
    mut commands: Commands,
    options: Res<Options>,
    assets: Res<AssetServer>,
    mut graphs: ResMut<Assets<AnimationGraph>>,
    mut players: Query<(Entity, &mut AnimationPlayer), Added<AnimationPlayer>>,
) {
    for (entity, mut player) in players.iter_mut().filter(|_| !options.is_still) {
        let clip = assets.load(GltfAssetLabel::Animation(0).from_asset("dancer.gltf"));
        let (graph, dance) = AnimationGraph::from_clip(clip);
        let graph = AnimationGraphHandle(graphs.add(graph));
        commands.entity(entity).insert(graph);
        player.play(dance).repeat();
    }
}
