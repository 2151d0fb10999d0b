//! One primitive: its attributes and its triangles.

use glam::{Vec2, Vec3};
use gltf::accessor::Dimensions;
use gltf::mesh::Mode;
use gltf::{Primitive, Semantic};

use super::accessor::{AccessorFault, is_float, read_floats, read_indices, read_uvs};
use super::{ImportError, PrimitivePlace, SkipReason};
use crate::{MeshError, SourceMesh};

/// Why `primitive` gets no levels of detail, if so.
pub(super) fn skip_reason(primitive: &Primitive<'_>, skinned: bool) -> Option<SkipReason> {
    let triangles = [Mode::Triangles, Mode::TriangleStrip, Mode::TriangleFan];
    let positions = primitive.get(&Semantic::Positions);
    if !triangles.contains(&primitive.mode()) {
        Some(SkipReason::NotTriangles)
    } else if skinned {
        Some(SkipReason::Skinned)
    } else if primitive.morph_targets().len() > 0 {
        Some(SkipReason::Morphed)
    } else if !positions.is_some_and(|accessor| is_float(&accessor, Dimensions::Vec3)) {
        Some(SkipReason::QuantizedPositions)
    } else {
        None
    }
}

/// Reads a primitive that is not to be skipped.
pub(super) fn read(
    primitive: &Primitive<'_>,
    buffers: &[Vec<u8>],
    place: &PrimitivePlace,
) -> Result<SourceMesh, ImportError> {
    let at = |attribute| {
        let place = place.clone();
        move |fault: AccessorFault| ImportError::Accessor {
            place,
            attribute,
            fault,
        }
    };
    let mut mesh = SourceMesh::default();
    if let Some(accessor) = primitive.get(&Semantic::Positions) {
        let positions = read_floats(&accessor, buffers).map_err(at("positions"))?;
        mesh.positions = positions.into_iter().map(Vec3::from_array).collect();
    }
    let normals = primitive.get(&Semantic::Normals);
    if let Some(accessor) = normals.filter(|normals| is_float(normals, Dimensions::Vec3)) {
        let normals = read_floats(&accessor, buffers).map_err(at("normals"))?;
        mesh.normals = normals.into_iter().map(Vec3::from_array).collect();
    }
    if let Some(accessor) = primitive.get(&Semantic::TexCoords(0)) {
        let uvs = read_uvs(&accessor, buffers).map_err(at("texture coordinates"))?;
        mesh.uvs = uvs.into_iter().flatten().map(Vec2::from_array).collect();
    }
    let corners = match primitive.indices() {
        Some(accessor) => read_indices(&accessor, buffers).map_err(at("indices"))?,
        None => (0..mesh.positions.len() as u32).collect(),
    };
    mesh.indices = triangle_list(primitive.mode(), corners);
    with_normals(mesh, primitive.mode()).map_err(|fault| ImportError::Mesh {
        place: place.clone(),
        fault,
    })
}

/// Unrolls strips and fans. Of a strip, every second triangle is turned round.
fn triangle_list(mode: Mode, corners: Vec<u32>) -> Vec<u32> {
    match mode {
        Mode::TriangleStrip => {
            let turned = |(index, corners): (usize, &[u32])| {
                let (first, second) = if index % 2 == 0 { (0, 1) } else { (1, 0) };
                [corners[first], corners[second], corners[2]]
            };
            corners.windows(3).enumerate().flat_map(turned).collect()
        }
        Mode::TriangleFan => {
            let spokes = corners.get(1..).unwrap_or_default();
            let blade = |edge: &[u32]| [corners[0], edge[0], edge[1]];
            spokes.windows(2).flat_map(blade).collect()
        }
        _ => corners,
    }
}

/// Does what Bevy does to triangle lists without normals. Strips and fans stay without.
fn with_normals(mesh: SourceMesh, mode: Mode) -> Result<SourceMesh, MeshError> {
    if mesh.indices.is_empty() || !mesh.normals.is_empty() || mode != Mode::Triangles {
        return Ok(mesh);
    }
    mesh.validate()?;
    Ok(mesh.without_shared_vertices())
}
