//! Cuts a Bevy mesh into the meshes of its drawable units.
//!
//! Simplification keeps source vertices, so a unit's mesh is a selection of the source mesh's
//! vertices with every attribute that they have, whatever it is. Equal attributes mean an equal
//! vertex layout, so the pipelines that draw the source mesh draw its units too: nothing is
//! compiled when the one takes the place of the other.

use bevy::asset::RenderAssetUsages;
use bevy::mesh::{Indices, Mesh, MeshAccessError, PrimitiveTopology, VertexAttributeValues};
use fieldlod_hierarchy::{Hierarchy, Unit};

/// The mesh of `unit`, with vertices taken from `source` and 16-bit indices.
pub(crate) fn unit_mesh(
    source: &Mesh,
    hierarchy: &Hierarchy,
    unit: &Unit,
    usage: RenderAssetUsages,
) -> Result<Mesh, MeshAccessError> {
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, usage);
    let vertices = hierarchy.vertices_of(unit);
    for (attribute, values) in source.try_attributes()? {
        mesh.insert_attribute(*attribute, gather(values, vertices));
    }
    mesh.insert_indices(Indices::U16(hierarchy.indices_of(unit).to_vec()));
    Ok(mesh)
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
