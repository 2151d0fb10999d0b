//! Cuts a Bevy mesh into the meshes of its drawable units.
//!
//! The vertices of a unit are vertices of the source mesh with all their attributes, and vertices that simplification
//! has moved. Moved vertices have positions, normals, tangents, two sets of texture coordinates and colours from the
//! hierarchy. Other attributes, joints and morph targets are copied from the source vertex. Units have the vertex
//! layout of their source, unless that is compressed: both use the same pipelines, and nothing is compiled when units
//! replace the source.

use std::sync::Mutex;

use bevy::asset::{AssetId, RenderAssetUsages};
use bevy::mesh::{
    Indices, Mesh, MeshAccessError, MeshVertexAttribute, MeshVertexAttributeId, PrimitiveTopology,
    VertexAttributeValues,
};
use bevy::platform::collections::HashMap;
use fieldlod_hierarchy::{Hierarchy, Unit};

use crate::compat::decompressed;
use crate::scene::rig::morph_targets_at;

/// The mesh that a hierarchy was baked from, with another order of triangles.
pub(crate) fn source_mesh(hierarchy: &Hierarchy, indices: Vec<u32>) -> Mesh {
    let vertices = hierarchy.source_vertices();
    let usage = RenderAssetUsages::default();
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, usage);
    mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, vertices.positions);
    let others: [(MeshVertexAttribute, VertexAttributeValues); 5] = [
        (Mesh::ATTRIBUTE_NORMAL, vertices.normals.into()),
        (Mesh::ATTRIBUTE_UV_0, vertices.uvs.into()),
        (Mesh::ATTRIBUTE_TANGENT, vertices.tangents.into()),
        (Mesh::ATTRIBUTE_UV_1, vertices.uvs_1.into()),
        (Mesh::ATTRIBUTE_COLOR, vertices.colors.into()),
    ];
    for (attribute, values) in others {
        if !values.is_empty() {
            mesh.insert_attribute(attribute, values);
        }
    }
    mesh.with_inserted_indices(Indices::U32(indices))
}

/// The indices of the source triangles of a hierarchy, in the order of its units.
pub(crate) fn source_indices(hierarchy: &Hierarchy) -> Vec<u32> {
    let units = hierarchy.source_units().map(|unit| &hierarchy.units[unit]);
    let triangles = units.flat_map(|unit| hierarchy.triangles_of(unit));
    triangles.flatten().collect()
}

/// Makes the meshes of units when views first draw them: most units of a large mesh are never drawn.
#[derive(Debug)]
pub(crate) struct UnitMeshes {
    /// The hierarchy without groups and without the vertices that the source mesh has.
    hierarchy: Hierarchy,
    /// The mesh of each unit that was made. It is freed with the last entity that draws the unit.
    pub(crate) made: Mutex<HashMap<u32, AssetId<Mesh>>>,
}

impl UnitMeshes {
    pub(crate) fn new(mut hierarchy: Hierarchy) -> Self {
        let all = hierarchy.vertices.positions.len() as u32;
        let moved: Vec<u32> = (hierarchy.source_vertex_count..all).collect();
        hierarchy.vertices = hierarchy.vertices.at(&moved);
        hierarchy.groups = Vec::new();
        Self {
            hierarchy,
            made: Mutex::default(),
        }
    }

    /// The mesh of a unit; `None` if `source` is unreadable or its number of vertices has changed.
    pub(crate) fn make(&self, source: &Mesh, unit: u32) -> Option<Mesh> {
        let first_held = self.hierarchy.source_vertex_count;
        if source.try_attribute(Mesh::ATTRIBUTE_POSITION).ok()?.len() != first_held as usize {
            return None;
        }
        let unit = &self.hierarchy.units[unit as usize];
        unit_mesh(source, &self.hierarchy, first_held, unit).ok()
    }
}

/// The mesh of `unit` for the GPU, with 16-bit indices. `source` is the mesh that `hierarchy` was baked from.
/// `first_held` is the index of the first vertex in [`Hierarchy::vertices`].
pub(crate) fn unit_mesh(
    source: &Mesh,
    hierarchy: &Hierarchy,
    first_held: u32,
    unit: &Unit,
) -> Result<Mesh, MeshAccessError> {
    // Rays and physics use the source.
    let usage = RenderAssetUsages::RENDER_WORLD;
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, usage);
    let vertices = hierarchy.vertices_of(unit);
    // If the origin is unknown, the hierarchy has all attributes of moved vertices, and any vertex will do.
    let origin = |&vertex: &u32| hierarchy.origin_of(vertex).unwrap_or(0);
    let origins: Vec<u32> = vertices.iter().map(origin).collect();
    for (attribute, values) in source.try_attributes()? {
        let mut values = decompressed(source, attribute.id, &gather(values, &origins)).into_owned();
        move_values(&mut values, attribute.id, hierarchy, first_held, vertices);
        let format = (&values).into();
        mesh.insert_attribute(
            MeshVertexAttribute {
                format,
                ..*attribute
            },
            values,
        );
    }
    if let Some(targets) = morph_targets_at(source, &origins)? {
        mesh.set_morph_targets(targets);
    }
    mesh.insert_indices(Indices::U16(hierarchy.indices_of(unit).to_vec()));
    Ok(mesh)
}

/// Sets the values of moved vertices to those in the hierarchy.
fn move_values(
    values: &mut VertexAttributeValues,
    id: MeshVertexAttributeId,
    hierarchy: &Hierarchy,
    first_held: u32,
    vertices: &[u32],
) {
    use VertexAttributeValues::{Float32x2, Float32x3, Float32x4};
    let held = &hierarchy.vertices;
    let moved = Moved {
        first: hierarchy.source_vertex_count,
        first_held,
        vertices,
    };
    // The hierarchy has no other formats.
    match values {
        Float32x3(own) if id == Mesh::ATTRIBUTE_POSITION.id => moved.set(own, &held.positions),
        Float32x3(own) if id == Mesh::ATTRIBUTE_NORMAL.id => moved.set(own, &held.normals),
        Float32x2(own) if id == Mesh::ATTRIBUTE_UV_0.id => moved.set(own, &held.uvs),
        Float32x2(own) if id == Mesh::ATTRIBUTE_UV_1.id => moved.set(own, &held.uvs_1),
        Float32x4(own) if id == Mesh::ATTRIBUTE_TANGENT.id => moved.set(own, &held.tangents),
        Float32x4(own) if id == Mesh::ATTRIBUTE_COLOR.id => moved.set(own, &held.colors),
        _ => {}
    }
}

/// The vertices of a unit. Indices from `first` on are moved vertices.
struct Moved<'a> {
    first: u32,
    first_held: u32,
    vertices: &'a [u32],
}

impl Moved<'_> {
    /// Sets the values of moved vertices to those of `held`, which may be empty.
    fn set<A: From<V>, V: Copy>(&self, values: &mut [A], held: &[V]) {
        for (value, &vertex) in values.iter_mut().zip(self.vertices) {
            if vertex >= self.first
                && let Some(&moved) = held.get((vertex - self.first_held) as usize)
            {
                *value = moved.into();
            }
        }
    }
}

/// The values at `vertices`, in their order.
fn gather(values: &VertexAttributeValues, vertices: &[u32]) -> VertexAttributeValues {
    macro_rules! each_format {
        ($($format:ident)*) => {
            match values {
                $(VertexAttributeValues::$format(values) => VertexAttributeValues::$format(
                    vertices.iter().map(|&vertex| values[vertex as usize]).collect(),
                ),)*
            }
        };
    }
    each_format! {
        Uint8 Uint8x2 Uint8x4 Sint8 Sint8x2 Sint8x4
        Unorm8 Unorm8x2 Unorm8x4 Snorm8 Snorm8x2 Snorm8x4
        Uint16 Uint16x2 Uint16x4 Sint16 Sint16x2 Sint16x4
        Unorm16 Unorm16x2 Unorm16x4 Snorm16 Snorm16x2 Snorm16x4
        Float16 Float16x2 Float16x4
        Float32 Float32x2 Float32x3 Float32x4
        Uint32 Uint32x2 Uint32x3 Uint32x4
        Sint32 Sint32x2 Sint32x3 Sint32x4
        Float64 Float64x2 Float64x3 Float64x4
        Unorm10_10_10_2 Unorm8x4Bgra
    }
}
