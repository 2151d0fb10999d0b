//! `.fieldlod` and `.fieldpages` files as Bevy assets.

use std::sync::Arc;

use bevy::asset::io::Reader;
use bevy::asset::{AssetLoader, LoadContext};
use bevy::prelude::*;
use fieldlod_hierarchy::BakedFile;

use crate::assets::file_parts::AssetFolder;
use crate::assets::lod_pages::LodPages;

/// The hierarchies of one glTF file. `fieldlod bake` writes them as a `.fieldlod` file. `fieldlod bake --pages` writes
/// them as a `.fieldpages` file, of which only the coarsest levels are in memory.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct BakedLods {
    /// The contents of a `.fieldlod` file; empty for a `.fieldpages` file. A hierarchy without source vertices uses the
    /// vertices of the mesh that it is applied to.
    pub file: Arc<BakedFile>,
    /// The resident part of a `.fieldpages` file.
    pub(crate) pages: Option<Arc<LodPages>>,
}

impl BakedLods {
    /// Wraps hierarchies that are in memory: those of meshes that a program creates and bakes, for
    /// [`AutoLod::from_file`](crate::AutoLod::from_file).
    #[must_use]
    pub fn new(file: Arc<BakedFile>) -> Self {
        Self { file, pages: None }
    }

    fn in_pages(pages: LodPages) -> Self {
        let primitives = Vec::new();
        Self {
            file: Arc::new(BakedFile { primitives }),
            pages: Some(Arc::new(pages)),
        }
    }
}

/// Registers the asset and its loader.
pub(crate) fn plugin(app: &mut App) {
    let folder = AssetFolder::of(app);
    app.init_asset::<BakedLods>()
        .register_asset_loader(BakedLodsLoader { folder });
}

/// Loads `.fieldlod` files, and the resident part of `.fieldpages` files.
#[derive(Debug, TypePath)]
struct BakedLodsLoader {
    folder: Option<AssetFolder>,
}

const IN_PAGES: &str = "fieldpages";

impl AssetLoader for BakedLodsLoader {
    type Asset = BakedLods;
    type Settings = ();
    type Error = BevyError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _settings: &(),
        load_context: &mut LoadContext<'_>,
    ) -> Result<BakedLods, BevyError> {
        let path = load_context.path().clone_owned();
        if path.path().extension().is_some_and(|ext| ext == IN_PAGES) {
            let pages = LodPages::read(reader, path, self.folder.as_ref()).await?;
            return Ok(BakedLods::in_pages(pages));
        }
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        let file = BakedFile::from_bytes(&bytes)?;
        Ok(BakedLods::new(Arc::new(file)))
    }

    fn extensions(&self) -> &[&str] {
        &["fieldlod", IN_PAGES]
    }
}
