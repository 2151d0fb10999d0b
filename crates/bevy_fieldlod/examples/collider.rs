//! Physics on a mesh with levels of detail: the collider has the triangles of the source mesh, whatever is drawn.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example collider`.

mod common;

use bevy::mesh::VertexAttributeValues;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

/// Triangles that balls bounce off.
#[derive(Component)]
struct Collider(Vec<Triangle3d>);

/// A ball, and its velocity.
#[derive(Component)]
struct Ball(Vec3);

const RADIUS: f32 = 0.25;

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
    let mut bowl = Plane3d::default()
        .mesh()
        .size(12.0, 12.0)
        .subdivisions(40)
        .build();
    if let Some(VertexAttributeValues::Float32x3(positions)) =
        bowl.attribute_mut(Mesh::ATTRIBUTE_POSITION)
    {
        for [x, height, z] in positions {
            *height = 0.05 * (*x * *x + *z * *z) + 0.3 * (1.5 * *x).sin() * (1.5 * *z).cos();
        }
    }
    let material = MeshMaterial3d(materials.add(Color::srgb(0.5, 0.6, 0.4)));
    let bowl = Mesh3d(meshes.add(bowl.with_computed_smooth_normals()));
    commands.spawn((bowl, material, AutoLod::default(), Name::new("bowl")));

    let mesh = Mesh3d(meshes.add(Sphere::new(RADIUS)));
    let red = MeshMaterial3d(materials.add(Color::srgb(0.8, 0.2, 0.2)));
    for index in 0..16u8 {
        let place = Vec3::new(f32::from(index % 4) - 1.4, 3.0, f32::from(index / 4) - 1.6);
        let place = Transform::from_translation(2.0 * place);
        commands.spawn((mesh.clone(), red.clone(), place, Ball(Vec3::ZERO)));
    }
    let sun = Transform::default().looking_to(Vec3::new(-1.0, -1.0, -0.5), Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
    let eye = Transform::from_xyz(0.0, 8.0, 11.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
}

/// Makes colliders when a mesh is spawned.
fn add_colliders(
    mut commands: Commands,
    added: Query<(Entity, &Mesh3d), (With<AutoLod>, Without<Collider>)>,
    meshes: Res<Assets<Mesh>>,
) -> Result {
    for (entity, mesh) in &added {
        let Some(mesh) = meshes.get(mesh) else {
            continue;
        };
        let triangles: Vec<_> = mesh.triangles()?.collect();
        info!("a collider of {} triangles", triangles.len());
        commands.entity(entity).insert(Collider(triangles));
    }
    Ok(())
}

fn move_balls(
    mut balls: Query<(&mut Transform, &mut Ball)>,
    colliders: Query<&Collider>,
    time: Res<Time>,
) {
    for (mut place, mut ball) in &mut balls {
        ball.0.y -= 9.81 * time.delta_secs();
        place.translation += ball.0 * time.delta_secs();
        for Triangle3d { vertices } in colliders.iter().flat_map(|collider| &collider.0) {
            // The nearest of the triangle's plane, if the ball is above the triangle.
            let [a, b, c] = *vertices;
            let normal = (b - a).cross(c - a).normalize();
            let depth = RADIUS - normal.dot(place.translation - a);
            let near = (0.0..RADIUS).contains(&depth)
                && is_above(place.translation.xz(), [a, b, c].map(Vec3::xz));
            if near {
                place.translation += depth * normal;
                // It bounces with half of its speed.
                let speed = ball.0.dot(normal).min(0.0);
                ball.0 -= 1.5 * speed * normal;
            }
        }
    }
}

/// Whether a point is above a triangle that faces up, both seen from above.
fn is_above(point: Vec2, [a, b, c]: [Vec2; 3]) -> bool {
    let is_inside = |from: Vec2, to: Vec2| (to - from).perp_dot(point - from) <= 0.0;
    is_inside(a, b) && is_inside(b, c) && is_inside(c, a)
}
