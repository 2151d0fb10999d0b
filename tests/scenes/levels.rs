//! Three levels of a prop, as a careful user makes them by hand.

use bevy::asset::RenderAssetUsages;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh};

use super::Prop;

/// Largest share of the source triangles that the second and the third level have.
const KEPT: [f32; 2] = [0.15, 0.02];
/// Distances from which these levels are drawn, in radii of the prop.
const FROM_RADII: [f32; 2] = [20.0, 80.0];

/// Props with fewer triangles have no levels.
const LEVELS_FROM: usize = 100;

/// A mesh, the paint and the distances between which it is drawn.
#[derive(Debug)]
pub(super) struct Level {
    pub(super) mesh: Mesh,
    pub(super) paint: usize,
    pub(super) from: f32,
    pub(super) to: f32,
}

/// The levels of a prop after its source.
#[derive(Debug)]
pub(super) struct PropLevels {
    /// The distance up to which the source is drawn.
    pub(super) source_to: f32,
    pub(super) coarser: Vec<Level>,
}

impl PropLevels {
    /// Makes the levels by the bake of this project, so that they are as good as the plugin's. The last level is a box
    /// around all parts, or a simplified mesh.
    pub(super) fn of(prop: &Prop, ends_in_box: bool) -> Self {
        let triangles = prop.parts.iter().map(|part| part.source.triangle_count());
        if triangles.sum::<usize>() < LEVELS_FROM {
            return Self {
                source_to: f32::INFINITY,
                coarser: Vec::new(),
            };
        }
        let [near, far] = FROM_RADII.map(|radii| radii * prop.radius);
        let mut coarser = Vec::new();
        for part in &prop.parts {
            let [second, third] = simplified(&part.source);
            let level = |mesh, from, to| Level {
                mesh,
                paint: part.paint,
                from,
                to,
            };
            coarser.push(level(second, near, far));
            if !ends_in_box {
                coarser.push(level(third, far, f32::INFINITY));
            }
        }
        if ends_in_box {
            coarser.push(Level {
                mesh: box_around(prop),
                paint: prop.parts[prop.parts.len() - 1].paint,
                from: far,
                to: f32::INFINITY,
            });
        }
        Self {
            source_to: near,
            coarser,
        }
    }
}

fn simplified(source: &SourceMesh) -> [Mesh; 2] {
    let baked = bake_mesh(source, &BakeConfig::fast()).expect("a generated mesh can be baked");
    let whole = baked.whole_mesh_levels().expect("16-bit indices suffice");
    KEPT.map(|kept| {
        let most = source.triangle_count() as f32 * kept;
        let fits = whole
            .units
            .iter()
            .position(|unit| unit.triangle_count as f32 <= most);
        let unit = &whole.units[fits.unwrap_or(whole.units.len() - 1)];
        let vertices = whole.vertices_of(unit).iter().map(|&v| v as usize);
        let all = &whole.vertices;
        let of = |values: &[Vec3]| vertices.clone().map(|v| values[v]).collect();
        let uvs = vertices.clone().map(|v| all.uvs[v]).collect();
        to_mesh(
            of(&all.positions),
            of(&all.normals),
            uvs,
            whole.indices_of(unit),
        )
    })
}

fn box_around(prop: &Prop) -> Mesh {
    let points = prop.parts.iter().flat_map(|part| &part.source.positions);
    let (low, high) = points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &at| {
        (low.min(at), high.max(at))
    });
    let cuboid = Mesh::from(Cuboid::from_size(high - low));
    cuboid.translated_by((low + high) * 0.5)
}

/// A mesh with positions, normals and texture coordinates only.
pub(super) fn source_mesh(source: &SourceMesh) -> Mesh {
    let indices = &source.indices;
    to_mesh(
        source.positions.clone(),
        source.normals.clone(),
        source.uvs.clone(),
        indices,
    )
}

fn to_mesh<I: Copy + Into<u32>>(
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    indices: &[I],
) -> Mesh {
    // One index width in all meshes, so that Bevy draws them together.
    let indices = indices.iter().map(|&index| index.into()).collect();
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
    .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
    .with_inserted_indices(Indices::U32(indices))
}
