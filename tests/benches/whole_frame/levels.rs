//! The rocks of the scene with three levels, as an artist makes them.

use bevy::asset::RenderAssetUsages;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_tests::apps::bevy_mesh;

/// Shapes of rocks.
pub(crate) const SHAPES: u32 = 3;
/// Largest share of the triangles in each level.
const KEPT: [f32; 3] = [1.0, 0.15, 0.02];

/// A mesh.
#[derive(Clone)]
pub(crate) struct Level {
    pub(crate) mesh: Mesh,
    pub(crate) triangles: u32,
}

/// The levels of each rock, finest first.
pub(crate) fn by_rock() -> Vec<Vec<Level>> {
    (0..SHAPES)
        .map(|seed| levels_of(&fieldlod_tests::rock(6, seed)))
        .collect()
}

fn levels_of(source: &SourceMesh) -> Vec<Level> {
    let baked = bake_mesh(source, &BakeConfig::default()).expect("a rock can be baked");
    let whole = baked
        .whole_mesh_levels()
        .expect("its level fits 16-bit indices");
    let all = source.indices.len() as f32 / 3.0;
    let level = |kept: f32| {
        let mut units = whole.units.iter().enumerate();
        let (index, _) = units
            .find(|(_, unit)| unit.triangle_count as f32 <= all * kept)
            .expect("a rock has coarse levels");
        mesh_of(&whole, index)
    };
    let coarser = KEPT[1..].iter().map(|&kept| level(kept));
    let source = Level {
        mesh: bevy_mesh(source),
        triangles: all as u32,
    };
    std::iter::once(source).chain(coarser).collect()
}

/// The whole-mesh level that a unit draws.
fn mesh_of(whole: &Hierarchy, unit: usize) -> Level {
    let unit = &whole.units[unit];
    let vertices = whole.vertices_of(unit).iter();
    let places = vertices
        .clone()
        .map(|&v| whole.vertices.positions[v as usize].to_array());
    let normals = vertices.map(|&v| whole.vertices.normals[v as usize].to_array());
    let mesh = Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, places.collect::<Vec<_>>())
    .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals.collect::<Vec<_>>())
    .with_inserted_indices(Indices::U16(whole.indices_of(unit).to_vec()));
    Level {
        mesh,
        triangles: unit.triangle_count,
    }
}
