//! A material of the game's own: levels of detail are drawn with it like the source mesh.
//!
//! Run with `cargo run --release -p bevy_fieldlod --example custom_material`.

mod common;

use bevy::prelude::*;
use bevy::render::render_resource::AsBindGroup;
use bevy::shader::ShaderRef;
use bevy_fieldlod::prelude::*;
use common::meshes::rock;

/// Rings of two colours around the vertical axis.
#[derive(Asset, TypePath, AsBindGroup, Clone, Debug)]
struct Rings {
    #[uniform(0)]
    color: LinearRgba,
}

impl Material for Rings {
    fn fragment_shader() -> ShaderRef {
        "rings.wgsl".into()
    }
}

fn main() -> AppExit {
    App::new()
        .add_plugins((common::plugins(), FieldLodPlugin))
        .add_plugins(MaterialPlugin::<Rings>::default())
        .add_systems(Startup, setup)
        .add_systems(Update, change_color)
        .run()
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<Rings>>,
) {
    let color = LinearRgba::rgb(0.8, 0.3, 0.1);
    let material = MeshMaterial3d(materials.add(Rings { color }));
    // The left rock is drawn as a whole, the right one in units, which inherit the material.
    for (x, subdivisions) in [(-1.3, 25), (1.3, 60)] {
        let mesh = Mesh3d(meshes.add(rock(subdivisions)));
        let place = Transform::from_xyz(x, 0.0, 0.0);
        commands.spawn((mesh, material.clone(), place, AutoLod::default()));
    }
    let eye = Transform::from_xyz(0.0, 1.5, 5.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
}

/// Changes the material, which all levels and units share.
fn change_color(time: Res<Time>, mut materials: ResMut<Assets<Rings>>) {
    for (_, material) in materials.iter_mut() {
        material.color = Color::hsl(20.0 * time.elapsed_secs() % 360.0, 0.7, 0.5).into();
    }
}
