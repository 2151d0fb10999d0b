//! The models that commands measure, from files or generated.

use std::path::{Path, PathBuf};

use fieldlod_bake::{
    BakeConfig, ImportedPrimitive, MeshError, SourceMesh, bake_mesh, bake_together,
    clusterlod_hierarchy, import_gltf,
};
use fieldlod_cli::output::Failure;
use fieldlod_hierarchy::Hierarchy;
use fieldlod_lab::chart::{BakedModel, Generated};

/// A model before it is baked.
pub(crate) enum Model {
    File(PathBuf),
    Generated(Generated),
}

impl Model {
    /// The file's name without its extension, or the name of the generated model.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::File(path) => {
                let stem = path.file_stem().unwrap_or_default();
                stem.to_string_lossy().into_owned()
            }
            Self::Generated(generated) => generated.name.to_owned(),
        }
    }

    /// Bakes the largest primitive with fieldlod and with clusterlod.
    pub(crate) fn bake(&self, config: &BakeConfig) -> Result<BakedModel, Failure> {
        let mesh = self.load()?;
        Ok(BakedModel {
            name: self.name(),
            ours: bake_mesh(&mesh, config).map_err(|e| self.failure(e))?,
            clusterlods: clusterlod_hierarchy(&mesh, config).map_err(|e| self.failure(e))?,
            surface: mesh.surface,
        })
    }

    /// Bakes all primitives of the largest glTF mesh together.
    pub(crate) fn bake_plant(&self, config: &BakeConfig) -> Result<Vec<Hierarchy>, Failure> {
        let path = match self {
            Self::File(path) => path,
            Self::Generated(generated) => {
                let baked = bake_mesh(&(generated.mesh)(), config);
                return Ok(vec![baked.map_err(|error| self.failure(error))?]);
            }
        };
        let import = import_gltf(path).map_err(|error| Failure::new(path, error))?;
        // Primitives are in the order of the file, so those of a mesh are neighbours.
        let meshes = (import.primitives).chunk_by(|a, b| a.place.mesh_index == b.place.mesh_index);
        let triangles = |primitives: &&[ImportedPrimitive]| {
            let counts = primitives.iter().map(|it| it.mesh.triangle_count());
            counts.sum::<usize>()
        };
        let largest = meshes.max_by_key(triangles);
        let largest = largest.ok_or_else(|| no_primitives(path))?.iter();
        let largest: Vec<&SourceMesh> = largest.map(|primitive| &primitive.mesh).collect();
        let baked = bake_together(&largest, config).into_iter();
        let baked = baked.map(|baked| Ok(baked.map_err(|error| self.failure(error))?.0));
        baked.collect()
    }

    fn failure(&self, error: MeshError) -> Failure {
        match self {
            Self::File(path) => Failure::new(path, error),
            Self::Generated(generated) => Failure::new(Path::new(generated.name), error),
        }
    }

    /// Loads the primitive with the most triangles.
    fn load(&self) -> Result<SourceMesh, Failure> {
        let path = match self {
            Self::File(path) => path,
            Self::Generated(generated) => return Ok((generated.mesh)()),
        };
        let import = import_gltf(path).map_err(|error| Failure::new(path, error))?;
        let meshes = import
            .primitives
            .into_iter()
            .map(|primitive| primitive.mesh);
        let largest = meshes.max_by_key(SourceMesh::triangle_count);
        largest.ok_or_else(|| no_primitives(path))
    }
}

fn no_primitives(path: &Path) -> Failure {
    Failure::new(path, "the file has no primitives")
}
