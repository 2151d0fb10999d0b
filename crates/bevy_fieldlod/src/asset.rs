//! `.fieldlod` files as Bevy assets.

use std::sync::Arc;

use bevy::asset::io::Reader;
use bevy::asset::{AssetLoader, LoadContext};
use bevy::prelude::*;
use fieldlod_hierarchy::{BakedFile, FileError};
use thiserror::Error;

/// The hierarchies of one glTF file: a `.fieldlod` file made by `fieldlod bake`.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct BakedLods {
    /// The file's contents, validated.
    pub file: Arc<BakedFile>,
}

/// Loads `.fieldlod` files.
#[derive(Debug, Default, TypePath)]
pub(crate) struct BakedLodsLoader;

/// Why a `.fieldlod` file could not be loaded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BakedLodsError {
    /// The file could not be read.
    #[error("cannot read the file: {0}")]
    Io(#[from] std::io::Error),
    /// Its contents are unusable.
    #[error(transparent)]
    File(#[from] FileError),
}

impl AssetLoader for BakedLodsLoader {
    type Asset = BakedLods;
    type Settings = ();
    type Error = BakedLodsError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _settings: &(),
        _load_context: &mut LoadContext<'_>,
    ) -> Result<BakedLods, BakedLodsError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        let file = BakedFile::from_bytes(&bytes)?;
        Ok(BakedLods {
            file: Arc::new(file),
        })
    }

    fn extensions(&self) -> &[&str] {
        &["fieldlod"]
    }
}
