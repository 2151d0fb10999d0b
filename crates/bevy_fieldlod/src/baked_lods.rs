//! `.fieldlod` files as Bevy assets.

use std::sync::Arc;

use bevy::asset::io::Reader;
use bevy::asset::{AssetLoader, LoadContext};
use bevy::prelude::*;
use fieldlod_hierarchy::BakedFile;

/// The hierarchies of one glTF file: a `.fieldlod` file made by `fieldlod bake`.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct BakedLods {
    /// The contents of the file. Hierarchies may lack the vertices of their source, which are then taken
    /// from the meshes that they are used for.
    pub file: Arc<BakedFile>,
}

/// Lets the asset server load `.fieldlod` files.
pub(crate) fn plugin(app: &mut App) {
    app.init_asset::<BakedLods>()
        .init_asset_loader::<BakedLodsLoader>();
}

/// Loads `.fieldlod` files.
#[derive(Debug, Default, TypePath)]
struct BakedLodsLoader;

impl AssetLoader for BakedLodsLoader {
    type Asset = BakedLods;
    type Settings = ();
    type Error = BevyError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _settings: &(),
        _load_context: &mut LoadContext<'_>,
    ) -> Result<BakedLods, BevyError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        let file = Arc::new(BakedFile::from_bytes_beside_source(&bytes)?);
        Ok(BakedLods { file })
    }

    fn extensions(&self) -> &[&str] {
        &["fieldlod"]
    }
}
