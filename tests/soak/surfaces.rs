//! Whether what is drawn is a closed surface.

use std::collections::{HashMap, HashSet};

use bevy::prelude::*;

/// Sets of meshes that form a closed surface. The search for open edges is slow, and depends on the meshes alone.
#[derive(Resource, Debug, Default)]
pub struct ClosedSurfaces(HashSet<Vec<AssetId<Mesh>>>);

impl ClosedSurfaces {
    /// Checks that entities form a closed surface, unless the same meshes were checked earlier.
    ///
    /// # Panics
    /// If the surface has a hole, or an entity has no mesh in main memory.
    pub fn check(&mut self, world: &World, drawn: &[Entity]) {
        let mesh = |drawn: &Entity| world.get::<Mesh3d>(*drawn).unwrap().id();
        let mut meshes: Vec<AssetId<Mesh>> = drawn.iter().map(mesh).collect();
        meshes.sort_unstable();
        if self.0.insert(meshes) {
            assert_eq!(open_edges(world, drawn), 0, "{drawn:?} have holes");
        }
    }
}

/// The number of edges of the surface of `drawn` with more triangles on one side than on the other. It is 0 for a
/// closed surface.
///
/// # Panics
/// If an entity has no mesh in main memory, or the mesh has no positions and indices.
pub fn open_edges(world: &World, drawn: &[Entity]) -> usize {
    let meshes = world.resource::<Assets<Mesh>>();
    let mut sides: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for &entity in drawn {
        let mesh = meshes.get(world.get::<Mesh3d>(entity).unwrap()).unwrap();
        let positions = mesh.attribute(Mesh::ATTRIBUTE_POSITION).unwrap();
        let positions = positions.as_float3().unwrap();
        let corners: Vec<[u32; 3]> = mesh
            .indices()
            .unwrap()
            .iter()
            .map(|corner| positions[corner].map(f32::to_bits))
            .collect();
        for triangle in corners.chunks_exact(3) {
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                let (from, to) = (triangle[from], triangle[to]);
                // The triangles on both sides of an edge use it in opposite directions.
                let (edge, side) = if from < to {
                    ([from, to], 1)
                } else {
                    ([to, from], -1)
                };
                *sides.entry(edge).or_default() += side;
            }
        }
    }
    sides.values().filter(|&&side| side != 0).count()
}
