//! The models that commands measure, from files or generated.

use std::path::{Path, PathBuf};

use fieldlod_bake::{BakeConfig, bake_file, bake_mesh};
use fieldlod_cli::output::Failure;
use fieldlod_hierarchy::{BakedFile, Hierarchy};
use fieldlod_lab::chart::Generated;

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

    /// The hierarchy of the primitive with most triangles. Files that are baked already are taken as
    /// they are, whatever `config` says.
    pub(crate) fn hierarchy(&self, config: &BakeConfig) -> Result<Hierarchy, Failure> {
        match self {
            Self::File(path) => {
                // The one that a scene is most likely about.
                let primitives = read(path, config)?.primitives.into_iter();
                primitives
                    .map(|primitive| primitive.hierarchy)
                    .max_by_key(Hierarchy::source_triangle_count)
                    .ok_or_else(|| Failure::new(path, "it has no primitives"))
            }
            Self::Generated(generated) => {
                let baked = bake_mesh(&(generated.mesh)(), config);
                baked.map_err(|error| Failure::new(Path::new(generated.name), error))
            }
        }
    }
}

fn read(path: &Path, config: &BakeConfig) -> Result<BakedFile, Failure> {
    if path.extension().is_some_and(|it| it == "fieldlod") {
        let bytes = std::fs::read(path).map_err(|error| Failure::new(path, error))?;
        BakedFile::from_bytes(&bytes).map_err(|error| Failure::new(path, error))
    } else {
        let outcome = bake_file(path, config, &|_| ());
        outcome
            .map(|outcome| outcome.file)
            .map_err(|error| Failure::new(path, error))
    }
}
