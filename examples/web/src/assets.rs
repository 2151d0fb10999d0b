//! Generates the assets and bakes their levels of detail.

use std::f32::consts::TAU;
use std::path::Path;

use bevy::mesh::VertexAttributeValues;
use bevy::prelude::*;
use fieldlod_bake::{BakeConfig, bake_file};

use crate::common::characters::write_dancer;
use crate::common::meshes::{bush, rock, write_gltf};
use crate::scene::{GROUND, PROPS, SIDE_IN_M};

/// Squares along each side of a piece of ground: it has more than 20,000 triangles, so that it is drawn as units.
const SQUARES: u32 = 110;
const PLACES: u16 = 300;

/// Writes all assets into a folder.
pub(crate) fn write(folder: &Path) -> Result {
    std::fs::create_dir_all(folder)?;
    let file = |name: &str| folder.join(name).with_extension("gltf");
    for (index, name) in (0u8..).zip(GROUND) {
        let corner = Vec2::new(f32::from(index % 2), f32::from(index / 2)) - 0.5;
        let piece = ground(corner * 0.5 * SIDE_IN_M);
        write_gltf(&file(name), &piece, &[Vec3::ZERO], [0.35, 0.45, 0.2])?;
    }
    for (name, mesh, first, color) in [
        (PROPS[0], rock(11), 0, [0.5, 0.45, 0.4]),
        ("rocks_1", rock(5), 0, [0.5, 0.45, 0.4]),
        ("rocks_2", rock(2), 0, [0.5, 0.45, 0.4]),
        (PROPS[1], bush(200), 1, [0.15, 0.35, 0.1]),
        ("bushes_1", bush(50), 1, [0.15, 0.35, 0.1]),
    ] {
        let places: Vec<Vec3> = (0..PLACES).map(|index| place(2 * index + first)).collect();
        write_gltf(&file(name), &mesh, &places, color)?;
    }
    write_dancer(&file("dancer"))?;
    for name in GROUND.iter().chain(&PROPS).chain(&["dancer"]) {
        let config = BakeConfig {
            // Pieces meet at the same vertices at all levels.
            lock_borders: name.starts_with("ground"),
            ..default()
        };
        let outcome = bake_file(&file(name), &config, &|_| ())?;
        if let Some(skipped) = outcome.skipped.first() {
            return Err(format!("{name}: {skipped:?}").into());
        }
        std::fs::write(
            folder.join(name).with_extension("fieldlod"),
            outcome.file.to_bytes(),
        )?;
    }
    Ok(())
}

/// A piece of ground with its middle at `middle`.
fn ground(middle: Vec2) -> Mesh {
    let side = SIDE_IN_M * 0.5;
    let plane = Plane3d::default().mesh().size(side, side);
    let plane = plane.subdivisions(SQUARES - 1).build();
    let mut mesh = plane.translated_by(Vec3::new(middle.x, 0.0, middle.y));
    let mut normals = Vec::new();
    if let Some(VertexAttributeValues::Float32x3(positions)) =
        mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION)
    {
        for [x, y, z] in positions {
            *y = height(*x, *z);
            // From the function, so that pieces are shaded alike where they meet.
            let slope = |dx, dz| (height(*x + dx, *z + dz) - height(*x - dx, *z - dz)) / 0.2;
            normals.push(Vec3::new(-slope(0.1, 0.0), 1.0, -slope(0.0, 0.1)).normalize());
        }
    }
    mesh.with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
}

/// The height of the ground in metres.
fn height(x: f32, z: f32) -> f32 {
    let waves = [0.05, 0.13, 0.4, 1.1, 2.9];
    let waves = waves.map(|f: f32| ((f * x).sin() + (f * z + 0.5 * f * x).cos()) / f);
    0.12 * waves.iter().sum::<f32>()
}

/// A place on the ground: a spiral with the golden angle spreads the places evenly.
fn place(index: u16) -> Vec3 {
    let share = f32::from(index) / f32::from(2 * PLACES);
    let at = Vec2::from_angle(0.381_966 * TAU * f32::from(index)) * 0.48 * SIDE_IN_M * share.sqrt();
    Vec3::new(at.x, height(at.x, at.y), at.y)
}
