//! Attributes and triangles of one primitive.

use fieldlod_hierarchy::Vertices;
use glam::{Vec2, Vec3, Vec4};
use gltf::mesh::Mode;
use gltf::{Primitive, Semantic};

use super::accessor::{VertexReader, read_indices};
use super::buffers::Buffers;
use super::error::{PrimitiveFault, SkipReason};
use super::format::{Attribute, Formats};
use super::rig::{Rig, Skin, read_rig};
use crate::mesh::used_vertices::{renumber, used_of};
use crate::mesh::{MeshError, SourceMesh, check_indices};

/// The largest number of vertices that 16-bit indices reach. Levels of rigged primitives have one unit each.
const MOST_RIGGED_VERTICES: usize = 1 << 16;

/// Returns the reason if `primitive` has no levels of detail.
pub(super) fn skip_reason(primitive: &Primitive<'_>) -> Option<SkipReason> {
    let triangles = [Mode::Triangles, Mode::TriangleStrip, Mode::TriangleFan];
    if !triangles.contains(&primitive.mode()) {
        Some(SkipReason::NotTriangles)
    } else if formats_of(primitive).is_none() {
        Some(SkipReason::PositionFormat)
    } else {
        None
    }
}

fn formats_of(primitive: &Primitive<'_>) -> Option<Formats> {
    let positions = primitive.get(&Semantic::Positions)?;
    Formats::of_positions(&positions)
}

/// Reads a primitive that is not skipped. Vertices that no triangle uses are left out.
pub(super) fn read(
    primitive: &Primitive<'_>,
    buffers: &Buffers,
    skins: &[(u32, &Skin)],
) -> Result<(SourceMesh, Option<Rig>), PrimitiveFault> {
    let positions = primitive.get(&Semantic::Positions);
    let vertex_count = positions.map_or(0, |positions| positions.count());
    let corners = corners(primitive, buffers, vertex_count)?;
    // Many primitives may share one vertex buffer, so each reads only its own vertices.
    let used = corners.as_deref();
    let used = used.and_then(|corners| used_of(corners, vertex_count));
    let vertices = VertexReader {
        buffers,
        vertex_count,
        only: used.as_deref(),
    };
    let rig = read_rig(primitive, vertices, skins)?;
    let formats = formats_of(primitive).unwrap_or(Formats::AsBevy);
    let reader = Reader {
        primitive,
        vertices,
        formats,
    };
    let mesh = reader.mesh(corners)?;
    // A primitive without triangles is skipped by the caller, and is no fault.
    if !mesh.indices.is_empty() {
        mesh.validate()?;
    }
    let (mesh, rig) = if needs_normals(&mesh, primitive.mode()) {
        // The new vertices are the old corners, so the rig is copied in the same order.
        let rig = rig.map(|rig| rig.at(&mesh.indices));
        (mesh.without_shared_vertices(), rig)
    } else {
        (mesh, rig)
    };
    let vertices = mesh.positions.len();
    if rig.is_some() && vertices > MOST_RIGGED_VERTICES {
        return Err(MeshError::TooLargeForRig { vertices }.into());
    }
    Ok((mesh, rig))
}

/// The indices, which are in range. `None` if vertices are drawn in order.
fn corners(
    primitive: &Primitive<'_>,
    buffers: &Buffers,
    vertices: usize,
) -> Result<Option<Vec<u32>>, PrimitiveFault> {
    let Some(accessor) = primitive.indices() else {
        return Ok(None);
    };
    let corners = read_indices(&accessor, buffers);
    let corners = corners.map_err(PrimitiveFault::accessor("indices"))?;
    check_indices(&corners, vertices)?;
    Ok(Some(corners))
}

struct Reader<'a> {
    primitive: &'a Primitive<'a>,
    vertices: VertexReader<'a>,
    formats: Formats,
}

impl Reader<'_> {
    fn mesh(&self, corners: Option<Vec<u32>>) -> Result<SourceMesh, PrimitiveFault> {
        use Attribute::{Color, Normal, Position, Tangent, Uv};
        let positions = self.vectors(&Semantic::Positions, Position, "positions")?;
        let normals = self.vectors(&Semantic::Normals, Normal, "normals")?;
        let uvs = self.vectors(&Semantic::TexCoords(0), Uv, "texture coordinates")?;
        let tangents = self.vectors(&Semantic::Tangents, Tangent, "tangents")?;
        let uvs_1 = self.vectors(&Semantic::TexCoords(1), Uv, "second texture coordinates")?;
        let colors = self.vectors(&Semantic::Colors(0), Color, "colors")?;
        let mut corners = corners.unwrap_or_else(|| (0..positions.len() as u32).collect());
        if let Some(used) = self.vertices.only {
            renumber(&mut corners, used);
        }
        // Attributes that the hierarchy cannot hold are copied from source vertices when the plugin draws a level.
        Ok(SourceMesh {
            has_other_attributes: has_other_attributes(self.primitive)
                || (tangents.is_empty() && gets_tangents(self.primitive)),
            vertices: Vertices {
                positions: positions.into_iter().map(Vec3::from_array).collect(),
                normals: normals.into_iter().map(Vec3::from_array).collect(),
                uvs: uvs.into_iter().map(Vec2::from_array).collect(),
                tangents: tangents.into_iter().map(Vec4::from_array).collect(),
                uvs_1: uvs_1.into_iter().map(Vec2::from_array).collect(),
                colors: colors.into_iter().map(Vec4::from_array).collect(),
            },
            surface: None,
            indices: triangle_list(self.primitive.mode(), corners),
        })
    }

    /// The vectors of an attribute; none if it is missing or in a format that is not read. A missing fourth component
    /// is 1, the alpha of an opaque colour.
    fn vectors<const N: usize>(
        &self,
        semantic: &Semantic,
        attribute: Attribute,
        name: &'static str,
    ) -> Result<Vec<[f32; N]>, PrimitiveFault> {
        let accessor = self.primitive.get(semantic);
        match accessor.filter(|accessor| self.formats.allow(attribute, accessor)) {
            Some(accessor) => self.vertices.read(&accessor, [1.0; N], name),
            None => Ok(Vec::new()),
        }
    }
}

/// Returns `true` if vertices have attributes that a [`SourceMesh`] lacks.
fn has_other_attributes(primitive: &Primitive<'_>) -> bool {
    let is_held = |semantic| {
        matches!(
            semantic,
            Semantic::Positions
                | Semantic::Normals
                | Semantic::Tangents
                | Semantic::TexCoords(0 | 1)
                | Semantic::Colors(0)
        )
    };
    let mut semantics = primitive.attributes().map(|(semantic, _)| semantic);
    semantics.any(|semantic| !is_held(semantic))
}

/// Returns `true` if Bevy computes tangents for a primitive without them.
fn gets_tangents(primitive: &Primitive<'_>) -> bool {
    let material = primitive.material();
    let coat = material.extension_value("KHR_materials_clearcoat");
    material.normal_texture().is_some()
        || coat.is_some_and(|coat| coat.get("clearcoatNormalTexture").is_some())
}

/// Converts strips and fans to triangle lists. Every second triangle of a strip is reversed.
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

/// Returns `true` if Bevy gives each triangle its own vertices and a flat normal. Strips and fans stay without normals.
fn needs_normals(mesh: &SourceMesh, mode: Mode) -> bool {
    !mesh.indices.is_empty() && mesh.normals.is_empty() && mode == Mode::Triangles
}
