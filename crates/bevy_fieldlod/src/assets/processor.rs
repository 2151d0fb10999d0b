//! Bakes in Bevy's asset processor, so that a shipped game never bakes.

use std::collections::BTreeMap;
use std::io;
use std::sync::Mutex;

use bevy::asset::io::{AssetWriterError, Reader, Writer};
use bevy::asset::processor::{Process, ProcessContext, ProcessError};
use bevy::asset::{AssetLoader, AssetPath, LoadContext};
use bevy::gltf::{GltfLoader, GltfLoaderSettings};
use bevy::prelude::*;
use bevy::tasks::futures_lite::AsyncWriteExt;
use fieldlod_bake::{BakeConfig, bake_import, import_gltf_bytes};
use fieldlod_hierarchy::Precision;

use crate::assets::glb;
use crate::lock;

/// Makes Bevy's asset processor add levels of detail to `.glb` files.
///
/// It works while [`AssetPlugin`] processes assets: with `AssetMode::Processed` and Bevy's `asset_processor` feature.
/// The processed files are glTF with an additional chunk, which other readers ignore. The shipped game needs neither
/// this plugin nor the `bake` feature. The bake of leaves reads PNG and JPEG images beside the file, and runs again
/// when these change. `.gltf` files with separate buffers are not supported: bake them with `fieldlod bake`.
///
/// ```no_run
/// use bevy::prelude::*;
/// use bevy_fieldlod::{FieldLodProcessorPlugin, prelude::*};
///
/// App::new()
///     .add_plugins(DefaultPlugins.set(AssetPlugin {
///         mode: AssetMode::Processed,
///         ..default()
///     }))
///     .add_plugins((FieldLodPlugin, FieldLodProcessorPlugin))
///     .run();
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldLodProcessorPlugin;

impl Plugin for FieldLodProcessorPlugin {
    fn build(&self, app: &mut App) {
        app.register_asset_loader(GlbBaker)
            .register_asset_processor(BakeIntoGlb)
            .set_default_asset_processor::<BakeIntoGlb>("glb");
    }
}

/// Adds a `.fieldlod` file to a `.glb` file. It takes the settings of the glTF loader.
#[derive(Clone, Copy, Debug, Default, TypePath)]
pub(crate) struct BakeIntoGlb;

impl Process for BakeIntoGlb {
    type Settings = GltfLoaderSettings;
    type OutputLoader = GltfLoader;

    async fn process(
        &self,
        context: &mut ProcessContext<'_>,
        settings: &GltfLoaderSettings,
        writer: &mut Writer,
    ) -> Result<GltfLoaderSettings, ProcessError> {
        let loaded = context.load_source_asset::<GlbBaker>(&()).await?;
        let BakedGlb(processed) = loaded.take().ok_or(ProcessError::WrongMetaType)?;
        let written = writer.write_all(&processed).await;
        written.map_err(|fault| ProcessError::AssetWriterError {
            path: context.path().clone(),
            err: AssetWriterError::Io(fault),
        })?;
        // The settings are not `Clone`.
        let copy = serde_json::to_value(settings).and_then(serde_json::from_value);
        copy.map_err(|fault| ProcessError::AssetSaveError(fault.into()))
    }
}

/// A `.glb` file with its levels of detail.
#[derive(Asset, TypePath)]
struct BakedGlb(Vec<u8>);

/// Bakes a `.glb` file. It is a loader, because Bevy tracks the other files that a loader reads and processes the asset
/// again when they change.
#[derive(TypePath)]
struct GlbBaker;

impl AssetLoader for GlbBaker {
    type Asset = BakedGlb;
    type Settings = ();
    type Error = BevyError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _settings: &(),
        context: &mut LoadContext<'_>,
    ) -> Result<BakedGlb, BevyError> {
        let mut glb = Vec::new();
        reader.read_to_end(&mut glb).await?;
        let files = files_beside(&glb, context).await;
        Ok(BakedGlb(processed(context.path(), glb, &files)))
    }
}

/// Files beside a `.glb` file by name, or why they could not be read.
type Files = BTreeMap<String, Result<Vec<u8>, String>>;

/// The external images of a file.
async fn files_beside(glb: &[u8], context: &mut LoadContext<'_>) -> Files {
    let wanted = Mutex::new(Vec::new());
    let want = |name: &str| {
        lock(&wanted).push(name.to_owned());
        Err(io::ErrorKind::NotFound.into())
    };
    // An import that finds no file collects the names. Its error is ignored, because the bake reports it.
    let _ = import_gltf_bytes(glb, &want);
    let mut files = Files::new();
    let wanted = std::mem::take(&mut *lock(&wanted));
    for name in wanted {
        let read = match context.path().resolve_embed_str(&name) {
            Ok(path) => context
                .read_asset_bytes(path)
                .await
                .map_err(|fault| fault.to_string()),
            Err(fault) => Err(fault.to_string()),
        };
        files.insert(name, read);
    }
    files
}

/// Adds levels of detail to `glb`. If the bake fails, logs the cause and returns `glb` unchanged.
fn processed(path: &AssetPath, glb: Vec<u8>, files: &Files) -> Vec<u8> {
    let beside = |name: &str| match files.get(name) {
        Some(file) => file.clone().map_err(io::Error::other),
        None => Err(io::ErrorKind::NotFound.into()),
    };
    let import = import_gltf_bytes(&glb, &beside);
    match import.and_then(|import| bake_import(import, &BakeConfig::default(), &|_| ())) {
        Ok(outcome) => {
            for unread in &outcome.unread_images {
                warn!("{path}: {unread}");
            }
            let file = outcome.file.to_bytes_with(Precision::Quantized16);
            glb::with_chunk(&glb, &file).unwrap_or_else(|| {
                warn!(
                    "could not add levels of detail to {path}: it is not binary glTF or would exceed 4 GiB; processing \
                     it without levels of detail"
                );
                glb
            })
        }
        Err(fault) => {
            warn!("could not bake {path}: {fault}; processing it without levels of detail");
            glb
        }
    }
}
