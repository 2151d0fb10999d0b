//! The rocks of the scene with three levels, as an artist makes them.

use bevy::asset::RenderAssetUsages;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_tests::apps::bevy_mesh;

/// Shapes of rocks.
pub(crate) const SHAPES: u32 = 3;
/// Largest share of the triangles in each coarser level.
const KEPT: [f32; 2] = [0.15, 0.02];

/// The levels of each rock, finest first.
pub(crate) fn by_rock() -> Vec<Vec<Mesh>> {
    (0..SHAPES)
        .map(|seed| levels_of(&fieldlod_tests::rock(6, seed)))
        .collect()
}

fn levels_of(source: &SourceMesh) -> Vec<Mesh> {
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
    let coarser = KEPT.iter().map(|&kept| level(kept));
    std::iter::once(bevy_mesh(source)).chain(coarser).collect()
}

/// The whole-mesh level that a unit draws.
fn mesh_of(whole: &Hierarchy, unit: usize) -> Mesh {
    let unit = &whole.units[unit];
    let vertices = whole.vertices_of(unit).iter();
    let places = vertices
        .clone()
        .map(|&v| whole.vertices.positions[v as usize].to_array());
    let normals = vertices.map(|&v| whole.vertices.normals[v as usize].to_array());
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, places.collect::<Vec<_>>())
    .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals.collect::<Vec<_>>())
    .with_inserted_indices(Indices::U16(whole.indices_of(unit).to_vec()))
}
