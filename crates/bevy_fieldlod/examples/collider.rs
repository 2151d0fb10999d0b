//! Physics on a mesh with levels of detail: the collider has all triangles of the mesh at any drawn level.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example collider`.

mod common;

use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use common::meshes::{hills, sun};

/// Triangles that balls bounce off.
#[derive(Component)]
struct Collider(Vec<Triangle3d>);

/// A ball, and its vertical speed.
#[derive(Component)]
struct Ball(f32);

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin))
        .add_systems(Startup, setup)
        .add_systems(FixedUpdate, (add_colliders, move_balls).chain())
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let ground = Mesh3d(meshes.add(hills(12.0, 40, &[0.4, 2.0])));
    let material = MeshMaterial3d(materials.add(Color::srgb(0.6, 0.5, 0.4)));
    commands.spawn((ground, material.clone(), AutoLod::default()));
    let mesh = Mesh3d(meshes.add(Sphere::new(0.25)));
    for index in 0..16u8 {
        let place = Vec3::new(f32::from(index % 4) - 1.4, 1.0, f32::from(index / 4) - 1.6);
        let place = Transform::from_translation(2.5 * place);
        commands.spawn((mesh.clone(), material.clone(), place, Ball(0.0)));
    }
    commands.spawn(sun());
    let eye = Transform::from_xyz(0.0, 6.0, 9.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
}

/// Makes a collider as soon as a mesh is spawned.
fn add_colliders(
    mut commands: Commands,
    added: Query<(Entity, &Mesh3d), (With<AutoLod>, Without<Collider>)>,
    meshes: Res<Assets<Mesh>>,
) -> Result {
    for (entity, mesh) in &added {
        let mesh = meshes.get(mesh).ok_or("the mesh is not loaded")?;
        let collider = Collider(mesh.triangles()?.collect());
        commands.entity(entity).insert(collider);
    }
    Ok(())
}

fn move_balls(balls: Query<(&mut Transform, &mut Ball)>, ground: Query<&Collider>) {
    // The time between two runs of `FixedUpdate`.
    let step = 1.0 / 64.0;
    for (mut place, mut ball) in balls {
        ball.0 -= 9.81 * step;
        place.translation.y += ball.0 * step;
        let triangles = ground.iter().flat_map(|collider| &collider.0);
        let below = triangles.filter_map(|triangle| height_at(place.translation.xz(), triangle));
        let lowest = below.fold(f32::MIN, f32::max) + 0.25;
        if place.translation.y < lowest {
            place.translation.y = lowest;
            ball.0 *= -0.6;
        }
    }
}

/// The height of a triangle that faces up, if the point is above or below it.
fn height_at(point: Vec2, triangle: &Triangle3d) -> Option<f32> {
    let [a, b, c] = triangle.vertices;
    let side = |from: Vec3, to: Vec3| (point - from.xz()).perp_dot(to.xz() - from.xz());
    let weights = Vec3::new(side(b, c), side(c, a), side(a, b));
    let height = weights.dot(Vec3::new(a.y, b.y, c.y)) / weights.element_sum();
    (weights.min_element() >= 0.0).then_some(height)
}
