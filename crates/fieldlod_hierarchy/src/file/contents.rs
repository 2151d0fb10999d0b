//! The contents of a file.

use crate::bounds::Aabb;
#[cfg(doc)]
use crate::file::vertices::quantize::Precision;
use crate::hierarchy::Hierarchy;

/// The contents of a `.fieldlod` file: hierarchies of the mesh primitives of one glTF file.
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
    /// The levels of detail.
    pub hierarchy: Hierarchy,
    /// Upper bound for the distance between a stored position and the baked position, in local units. 0
    /// unless the vertices were written with [`Precision::Quantized16`]. Deviations and spheres contain it.
    /// Vertices that are read from the source mesh are exact.
    pub position_error_in_local: f32,
    /// The box of all primitives that share vertices with this one or change levels together with it. With
    /// [`Precision::Quantized16`], they then round shared vertices to equal positions. `None` for the box of
    /// the own vertices. Files do not hold it.
    pub grid_box: Option<Aabb>,
}

impl BakedPrimitive {
    /// A hierarchy of the primitive with these indices in the glTF file.
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
            grid_box: None,
        }
    }
}

impl BakedFile {
    /// The primitive with these indices in the glTF file.
    #[must_use]
    pub fn find(&self, mesh_index: u32, primitive_index: u32) -> Option<&BakedPrimitive> {
        self.primitives
            .iter()
            .find(|p| p.mesh_index == mesh_index && p.primitive_index == primitive_index)
    }
}
