//! A crowd of animated characters. Distant ones are animated less often, by the level that they are drawn at.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example character_crowd`.

mod common;

use bevy::animation::AnimatedBy;
use bevy::diagnostic::FrameCount;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use common::characters::write_dancer;
use common::meshes::{folder_of, sun};

fn main() -> AppExit {
    // A game has its characters in the folder `assets`. This example writes one.
    let folder = folder_of("character_crowd").expect("a folder for temporary files");
    write_dancer(&folder.join("dancer.gltf")).expect("a writable folder");
    App::new()
        .add_plugins((common::plugins_with_assets_in(folder), FieldLodPlugin))
        .add_systems(Startup, setup)
        .add_systems(
            Update,
            (spawn_dancers, start_dance, animate_distant_less_often).chain(),
        )
        .run()
}

/// The file of the characters. Loading its scene and its animation by labels would load the file again.
#[derive(Resource)]
struct Dancer(Handle<Gltf>);

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    commands.insert_resource(Dancer(assets.load("dancer.gltf")));
    let eye = Transform::from_xyz(0.0, 3.0, 6.0).looking_to(Vec3::new(0.0, -0.2, -1.0), Vec3::Y);
    commands.spawn((Camera3d::default(), eye, FieldLodCamera::high()));
    commands.spawn(sun());
}

fn spawn_dancers(
    mut commands: Commands,
    dancer: Res<Dancer>,
    files: Res<Assets<Gltf>>,
    mut is_done: Local<bool>,
) {
    let Some(file) = files.get(&dancer.0).filter(|_| !*is_done) else {
        return;
    };
    *is_done = true;
    for index in 0..400u16 {
        let (column, row) = (f32::from(index % 20), f32::from(index / 20));
        let place = Transform::from_xyz(2.0 * column - 19.0, 0.0, -3.0 * row);
        let scene = WorldAssetRoot(file.scenes[0].clone());
        commands.spawn((scene, place, AutoLod::default()));
    }
}

fn start_dance(
    mut commands: Commands,
    dancer: Res<Dancer>,
    files: Res<Assets<Gltf>>,
    mut graphs: ResMut<Assets<AnimationGraph>>,
    mut players: Query<(Entity, &mut AnimationPlayer), Added<AnimationPlayer>>,
) {
    for (entity, mut player) in &mut players {
        let Some(file) = files.get(&dancer.0) else {
            return;
        };
        let (graph, dance) = AnimationGraph::from_clip(file.animations[0].clone());
        let graph = AnimationGraphHandle(graphs.add(graph));
        commands.entity(entity).insert(graph);
        let dance = player.play(dance).repeat();
        dance.seek_to(0.37 * entity.index_u32() as f32 % 2.0);
    }
}

/// Animates characters at level 0 in each frame, at level 1 in every second, at level 2 in every fourth, and so on.
fn animate_distant_less_often(
    levels: LodLevels,
    camera: Single<Entity, With<Camera3d>>,
    characters: Query<(Entity, &SkinnedMesh)>,
    joints: Query<&AnimatedBy>,
    mut players: Query<&mut AnimationPlayer>,
    frame: Res<FrameCount>,
) {
    for (entity, skin) in &characters {
        let Ok(mut player) = joints
            .get(skin.joints[0])
            .and_then(|by| players.get_mut(by.0))
        else {
            continue;
        };
        let level = levels.in_view(entity, *camera).map_or(0, |of| *of.start());
        let period = 1 << level.min(3);
        let is_due = (frame.0 + entity.index_u32()).is_multiple_of(period);
        for (_, animation) in player.playing_animations_mut() {
            animation.set_speed(period as f32).pause();
            if is_due {
                animation.resume();
            }
        }
    }
}
