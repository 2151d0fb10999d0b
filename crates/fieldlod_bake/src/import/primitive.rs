//! One primitive: its attributes and its triangles.

use fieldlod_hierarchy::Vertices;
use glam::{Vec2, Vec3, Vec4};
use gltf::mesh::Mode;
use gltf::{Primitive, Semantic};

use super::accessor::{read_indices, read_vectors};
use super::buffers::Buffers;
use super::error::{PrimitiveFault, SkipReason};
use super::format::{Attribute, Formats};
use super::rig::{Rig, Skin, read_rig};
use crate::mesh::used_vertices::{renumber, used_of};
use crate::mesh::{MeshError, SourceMesh};

/// Why `primitive` gets no levels of detail, if so.
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

/// Reads a primitive that is not to be skipped, with a skin or without. Vertices that no triangle uses are left out.
pub(super) fn read(
    primitive: &Primitive<'_>,
    buffers: &Buffers,
    skin: Option<(u32, &Skin)>,
) -> Result<(SourceMesh, Option<Rig>), PrimitiveFault> {
    let reader = Reader {
        primitive,
        buffers,
        formats: formats_of(primitive).unwrap_or(Formats::AsBevy),
        vertex_count: primitive
            .get(&Semantic::Positions)
            .map_or(0, |positions| positions.count()),
    };
    let corners = reader.corners()?;
    let used = corners
        .as_deref()
        .and_then(|corners| used_of(corners, reader.vertex_count));
    let rig = read_rig(
        primitive,
        buffers,
        skin,
        reader.vertex_count,
        used.as_deref(),
    )?;
    let mesh = reader.mesh(corners, used.as_deref())?;
    let needs_normals = needs_normals(&mesh, primitive.mode());
    if !needs_normals {
        if !mesh.indices.is_empty() {
            mesh.validate()?;
        }
        return Ok((mesh, rig));
    }
    // Indices that are out of range would be read.
    mesh.validate()?;
    let rig = rig.map(|rig| rig.at(&mesh.indices));
    Ok((mesh.without_shared_vertices(), rig))
}

struct Reader<'a> {
    primitive: &'a Primitive<'a>,
    buffers: &'a Buffers,
    formats: Formats,
    vertex_count: usize,
}

impl Reader<'_> {
    /// The mesh with the vertices `only`, or with all.
    fn mesh(
        &self,
        corners: Option<Vec<u32>>,
        only: Option<&[u32]>,
    ) -> Result<SourceMesh, PrimitiveFault> {
        use Attribute::{Color, Normal, Position, Tangent, Uv};
        let positions = self.vectors(&Semantic::Positions, Position, "positions", only)?;
        let normals = self.vectors(&Semantic::Normals, Normal, "normals", only)?;
        let uvs = self.vectors(&Semantic::TexCoords(0), Uv, "texture coordinates", only)?;
        let tangents = self.vectors(&Semantic::Tangents, Tangent, "tangents", only)?;
        let uvs_1 = self.vectors(
            &Semantic::TexCoords(1),
            Uv,
            "second texture coordinates",
            only,
        )?;
        let colors = self.vectors(&Semantic::Colors(0), Color, "colors", only)?;
        let mut corners = corners.unwrap_or_else(|| (0..positions.len() as u32).collect());
        if let Some(used) = only {
            renumber(&mut corners, used);
        }
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

    /// The indices, which are in range; `None` if vertices are drawn in order.
    fn corners(&self) -> Result<Option<Vec<u32>>, PrimitiveFault> {
        let Some(accessor) = self.primitive.indices() else {
            return Ok(None);
        };
        let corners = read_indices(&accessor, self.buffers);
        let corners = corners.map_err(|fault| PrimitiveFault::Accessor {
            attribute: "indices",
            fault,
        })?;
        let vertices = self.vertex_count;
        let is_wrong = |&(_, &index): &(usize, &u32)| index as usize >= vertices;
        match corners.iter().enumerate().find(is_wrong) {
            Some((position, &index)) => Err(PrimitiveFault::Mesh(MeshError::IndexOutOfRange {
                position,
                index,
                vertices,
            })),
            None => Ok(Some(corners)),
        }
    }

    /// The vectors of an attribute; none if it is missing or in a format that is not read. What
    /// has only three of four components gets a 1: an opaque colour.
    fn vectors<const N: usize>(
        &self,
        semantic: &Semantic,
        attribute: Attribute,
        name: &'static str,
        only: Option<&[u32]>,
    ) -> Result<Vec<[f32; N]>, PrimitiveFault> {
        let accessor = self.primitive.get(semantic);
        let usable = accessor.filter(|accessor| self.formats.allow(attribute, accessor));
        let Some(accessor) = usable else {
            return Ok(Vec::new());
        };
        if accessor.count() != self.vertex_count {
            return Err(PrimitiveFault::Mesh(MeshError::AttributeCount {
                attribute: name,
                count: accessor.count(),
                vertices: self.vertex_count,
            }));
        }
        let vectors = read_vectors(&accessor, self.buffers, [1.0; N], only);
        vectors.map_err(|fault| PrimitiveFault::Accessor {
            attribute: name,
            fault,
        })
    }
}

/// Whether vertices have attributes that a [`SourceMesh`] does not hold.
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

/// Whether Bevy computes tangents for a primitive without.
fn gets_tangents(primitive: &Primitive<'_>) -> bool {
    let material = primitive.material();
    let coat = material.extension_value("KHR_materials_clearcoat");
    material.normal_texture().is_some()
        || coat.is_some_and(|coat| coat.get("clearcoatNormalTexture").is_some())
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

/// Whether Bevy gives each triangle its own vertices and a flat normal. Strips and fans stay without.
fn needs_normals(mesh: &SourceMesh, mode: Mode) -> bool {
    !mesh.indices.is_empty() && mesh.normals.is_empty() && mode == Mode::Triangles
}
