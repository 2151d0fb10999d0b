//! Plants that a material's vertex shader moves in the wind: levels of detail keep the attributes that it reads.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example vegetation`.

mod common;

use bevy::pbr::{ExtendedMaterial, MaterialExtension};
use bevy::prelude::*;
use bevy::render::render_resource::AsBindGroup;
use bevy::shader::ShaderRef;
use bevy_fieldlod::prelude::*;
use common::meshes::{bush, sun};

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
        // Bakes read the colours of the base material.
        .bake_extended_material::<Wind>()
        .add_systems(Startup, setup)
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<WindMaterial>>,
) {
    let mesh = Mesh3d(meshes.add(bush(200)));
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
        let place = place.with_rotation(Quat::from_rotation_y(x + 3.0 * z));
        let plant = AutoLod::of_kind(LodKind::WholeMesh);
        commands.spawn((mesh.clone(), material.clone(), place, plant));
    }
    let (light, place) = sun();
    let shadow_maps_enabled = true;
    commands.spawn((
        DirectionalLight {
            shadow_maps_enabled,
            ..light
        },
        place,
    ));
    let eye = Transform::from_xyz(0.0, 3.0, 5.0).looking_at(Vec3::new(0.0, 0.0, -4.0), Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
}
