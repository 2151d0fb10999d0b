//! `.fieldlod` files beside their assets.

use std::path::Path;
use std::sync::{Arc, Mutex};

use async_lock::OnceCell;
use bevy::asset::io::AssetReaderError;
use bevy::asset::{AssetPath, AssetServer, AssetServerMode};
use bevy::log::warn;
use bevy::platform::collections::HashMap;
use fieldlod_hierarchy::{BakedFile, FileError};

use crate::assets::glb;
use crate::lock;

/// A file, with its name for messages.
type Found = Option<(String, Arc<BakedFile>)>;

/// Caches the files beside assets while meshes are being prepared, so that each file is read once for all meshes of
/// its asset.
#[derive(Debug, Default)]
pub(crate) struct SidecarFiles {
    files: Mutex<HashMap<AssetPath<'static>, Arc<OnceCell<Found>>>>,
}

impl SidecarFiles {
    /// Finds the file for the asset at `path`.
    pub(super) async fn find(&self, assets: &AssetServer, path: &AssetPath<'static>) -> Found {
        let asset = path.clone().without_label().into_owned();
        let file = lock(&self.files).entry(asset.clone()).or_default().clone();
        // Tasks wait for the first one without blocking their threads. On the web, tasks of all meshes start at once.
        let found = file.get_or_init(|| read_sidecar(assets, &asset)).await;
        found.clone()
    }
}

/// Reads the file with the same name and the extension `fieldlod`, or the chunk that the asset processor added to a
/// `.glb`.
async fn read_sidecar(assets: &AssetServer, path: &AssetPath<'static>) -> Found {
    let sidecar = path.path().with_extension("fieldlod");
    if let Some(bytes) = read(assets, path, &sidecar).await {
        return parse(sidecar.display().to_string(), &bytes);
    }
    // Only the asset processor adds the chunk; a source file is not read in full for it.
    let is_processed = matches!(assets.mode(), AssetServerMode::Processed);
    if is_processed && path.path().extension().is_some_and(|ext| ext == "glb") {
        let whole = read(assets, path, path.path()).await?;
        return parse(path.to_string(), glb::find_chunk(&whole)?);
    }
    None
}

fn parse(name: String, bytes: &[u8]) -> Found {
    match BakedFile::from_bytes(bytes) {
        Ok(file) => Some((name, Arc::new(file))),
        // Many servers answer requests for missing files with a page, some with the status 200.
        Err(FileError::NotFieldlod) if is_page(bytes) => None,
        Err(error) => {
            warn!("could not use {name}: {error}; trying other sources");
            None
        }
    }
}

/// Whether the bytes begin like HTML.
fn is_page(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    text.trim_ascii_start().starts_with(b"<")
}

/// Reads without the asset server, which would log an error for a missing file.
pub(super) async fn read(
    assets: &AssetServer,
    asset: &AssetPath<'static>,
    file: &Path,
) -> Option<Vec<u8>> {
    let source = assets.get_source(asset.source()).ok()?;
    let reader = match assets.mode() {
        AssetServerMode::Processed if source.should_process() => source.processed_reader().ok()?,
        _ => source.reader(),
    };
    let mut bytes = Vec::new();
    let result = match reader.read(file).await {
        Ok(mut reader) => reader.read_to_end(&mut bytes).await,
        Err(AssetReaderError::NotFound(_)) => return None,
        Err(error) => Err(std::io::Error::other(error)),
    };
    match result {
        Ok(_) => Some(bytes),
        Err(error) => {
            warn!("could not read {}: {error}", file.display());
            None
        }
    }
}
