//! The contents of a file.

use crate::file::vertices::quantize::Precision;
use crate::hierarchy::Hierarchy;

/// How a file is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FileOptions {
    /// How exactly the file keeps vertex attributes.
    pub precision: Precision,
    /// Leaves out the source's vertices: for a file that is read where its source is at hand, by
    /// [`BakedFile::from_bytes_beside_source`]. Only moved vertices are then stored.
    pub beside_source: bool,
}

impl From<Precision> for FileOptions {
    /// With all vertices.
    fn from(precision: Precision) -> Self {
        Self {
            precision,
            beside_source: false,
        }
    }
}

/// The contents of a `.fieldlod` file: the hierarchies of one glTF file's mesh primitives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BakedFile {
    /// One entry per baked primitive.
    pub primitives: Vec<BakedPrimitive>,
}

/// The hierarchy of one primitive of a glTF mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct BakedPrimitive {
    /// Index of the mesh in the glTF file.
    pub mesh_index: u32,
    /// Index of the primitive in that mesh.
    pub primitive_index: u32,
    /// The mesh's name, or an empty string.
    pub name: String,
    /// Its levels of detail.
    pub hierarchy: Hierarchy,
    /// How far the positions in `hierarchy` lie from where the bake had them at most, in local
    /// units: 0 unless the file was written with [`Precision::Quantized16`]. Vertices that come from
    /// the source mesh itself are not concerned.
    pub position_error_in_local: f32,
}

impl BakedPrimitive {
    /// Names a hierarchy by its place in the glTF file.
    #[must_use]
    pub fn new(
        mesh_index: u32,
        primitive_index: u32,
        name: impl Into<String>,
        hierarchy: Hierarchy,
    ) -> Self {
        Self {
            mesh_index,
            primitive_index,
            name: name.into(),
            hierarchy,
            position_error_in_local: 0.0,
        }
    }
}

impl BakedFile {
    /// The hierarchy of one primitive, by its place in the glTF file.
    #[must_use]
    pub fn find(&self, mesh_index: u32, primitive_index: u32) -> Option<&BakedPrimitive> {
        self.primitives
            .iter()
            .find(|p| p.mesh_index == mesh_index && p.primitive_index == primitive_index)
    }
}
