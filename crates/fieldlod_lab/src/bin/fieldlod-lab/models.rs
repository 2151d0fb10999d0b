//! The models that commands measure, from files or generated.

use std::path::{Path, PathBuf};

use fieldlod_bake::{
    BakeConfig, ImportedPrimitive, MeshError, SourceMesh, bake_mesh, bake_together,
    clusterlod_hierarchy, import_gltf,
};
use fieldlod_cli::output::Failure;
use fieldlod_hierarchy::{BakedFile, Hierarchy};
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

    /// Bakes the primitive with the most triangles in both systems. A .fieldlod file already contains this system's
    /// levels; `config` then applies only to clusterlod.
    pub(crate) fn bake(&self, config: &BakeConfig) -> Result<BakedModel, Failure> {
        let (mesh, baked) = self.load()?;
        Ok(BakedModel {
            name: self.name(),
            ours: self.hierarchy_of(&mesh, baked, config)?,
            clusterlods: clusterlod_hierarchy(&mesh, config).map_err(|e| self.failure(e))?,
            surface: mesh.surface,
        })
    }

    /// The primitive with the most triangles, baked by this project.
    pub(crate) fn bake_ours(&self, config: &BakeConfig) -> Result<Hierarchy, Failure> {
        let (mesh, baked) = self.load()?;
        self.hierarchy_of(&mesh, baked, config)
    }

    /// All primitives of the glTF mesh with the most triangles, baked together.
    pub(crate) fn bake_plant(&self, config: &BakeConfig) -> Result<Vec<Hierarchy>, Failure> {
        let path = match self {
            Self::File(path) if path.extension().is_none_or(|it| it != "fieldlod") => path,
            _ => return Ok(vec![self.bake_ours(config)?]),
        };
        let import = import_gltf(path).map_err(|error| Failure::new(path, error))?;
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

    fn hierarchy_of(
        &self,
        mesh: &SourceMesh,
        baked: Option<Hierarchy>,
        config: &BakeConfig,
    ) -> Result<Hierarchy, Failure> {
        match baked {
            Some(hierarchy) => Ok(hierarchy),
            None => bake_mesh(mesh, config).map_err(|error| self.failure(error)),
        }
    }

    fn failure(&self, error: MeshError) -> Failure {
        match self {
            Self::File(path) => Failure::new(path, error),
            Self::Generated(generated) => Failure::new(Path::new(generated.name), error),
        }
    }

    /// The mesh of the primitive with the most triangles, and its hierarchy if the file contains one.
    fn load(&self) -> Result<(SourceMesh, Option<Hierarchy>), Failure> {
        match self {
            Self::Generated(generated) => Ok(((generated.mesh)(), None)),
            Self::File(path) if path.extension().is_some_and(|it| it == "fieldlod") => {
                let bytes = std::fs::read(path).map_err(|error| Failure::new(path, error))?;
                let file = BakedFile::from_bytes(&bytes);
                let primitives = file.map_err(|error| Failure::new(path, error))?.primitives;
                let hierarchies = primitives.into_iter().map(|primitive| primitive.hierarchy);
                let largest = hierarchies.max_by_key(Hierarchy::source_triangle_count);
                let hierarchy = largest.ok_or_else(|| no_primitives(path))?;
                Ok((source_mesh(&hierarchy), Some(hierarchy)))
            }
            Self::File(path) => {
                let import = import_gltf(path).map_err(|error| Failure::new(path, error))?;
                let primitives = import.primitives.into_iter();
                let meshes = primitives.map(|primitive| primitive.mesh);
                let largest = meshes.max_by_key(SourceMesh::triangle_count);
                Ok((largest.ok_or_else(|| no_primitives(path))?, None))
            }
        }
    }
}

fn no_primitives(path: &Path) -> Failure {
    Failure::new(path, "the file has no primitives")
}

/// The source mesh of a hierarchy, with its triangles in the order of the units.
fn source_mesh(hierarchy: &Hierarchy) -> SourceMesh {
    let units = hierarchy.source_units().map(|unit| &hierarchy.units[unit]);
    let triangles = units.flat_map(|unit| hierarchy.triangles_of(unit));
    let vertices = hierarchy.source_vertices();
    let mut mesh = SourceMesh {
        indices: triangles.flatten().collect(),
        ..SourceMesh::default()
    };
    mesh.positions = vertices.positions;
    mesh.normals = vertices.normals;
    mesh.uvs = vertices.uvs;
    mesh
}
