//! Plants that a material's vertex shader moves in the wind: levels of detail keep the attributes that it reads.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example vegetation`.

mod common;

use bevy::mesh::MeshBuilder;
use bevy::pbr::{ExtendedMaterial, MaterialExtension};
use bevy::prelude::*;
use bevy::render::render_resource::AsBindGroup;
use bevy::shader::ShaderRef;
use bevy_fieldlod::prelude::*;

type WindMaterial = ExtendedMaterial<StandardMaterial, Wind>;

/// Moves vertices by their height above the origin of the mesh.
#[derive(Asset, AsBindGroup, Reflect, Clone, Debug)]
struct Wind {
    /// Displacement at a height of one.
    #[uniform(100)]
    strength: f32,
}

impl MaterialExtension for Wind {
    fn vertex_shader() -> ShaderRef {
        "wind.wgsl".into()
    }

    /// Shadows move, too.
    fn prepass_vertex_shader() -> ShaderRef {
        "wind.wgsl".into()
    }
}

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin))
        .add_plugins(MaterialPlugin::<WindMaterial>::default())
        .add_systems(Startup, setup)
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<WindMaterial>>,
) {
    let mesh = Mesh3d(meshes.add(bush()));
    let base = StandardMaterial {
        double_sided: true,
        cull_mode: None,
        ..Color::srgb(0.25, 0.5, 0.15).into()
    };
    let material = MeshMaterial3d(materials.add(WindMaterial {
        base,
        extension: Wind { strength: 0.1 },
    }));
    for index in 0..100u8 {
        let (x, z) = (f32::from(index % 10), f32::from(index / 10));
        let place = Transform::from_xyz(2.0 * (x - 4.5) + 0.7 * z.sin(), 0.0, -2.0 * z);
        let plant = AutoLod::of_kind(LodKind::WholeMesh);
        commands.spawn((
            mesh.clone(),
            material.clone(),
            place.with_rotation(Quat::from_rotation_y(x + 3.0 * z)),
            plant,
        ));
    }
    commands.spawn((
        DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::default().looking_to(Vec3::new(-1.0, -1.0, -0.5), Vec3::Y),
    ));
    let eye = Transform::from_xyz(0.0, 3.0, 5.0).looking_at(Vec3::new(0.0, 0.0, -4.0), Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
}

/// Two hundred leaves on a ball: many loose pieces, as plants have.
fn bush() -> Mesh {
    let leaf = Plane3d::default()
        .mesh()
        .size(0.12, 0.3)
        .subdivisions(1)
        .build();
    let mut bush = Sphere::new(0.1).mesh().build();
    for index in 0..200u8 {
        let turn = Quat::from_rotation_y(2.4 * f32::from(index))
            * Quat::from_rotation_x(0.014 * f32::from(index));
        let place = Transform::from_translation(Vec3::Y + turn * Vec3::new(0.0, 0.2, 0.6))
            .with_rotation(turn);
        bush.merge(&leaf.clone().transformed_by(place))
            .expect("the same attributes");
    }
    bush
}
