//! Bakes when assets are processed, so that a shipped game never does.

use std::path::Path;

use bevy::asset::AssetPath;
use bevy::asset::io::{AssetReaderError, AssetWriterError, Writer};
use bevy::asset::processor::{Process, ProcessContext, ProcessError};
use bevy::gltf::{GltfLoader, GltfLoaderSettings};
use bevy::prelude::*;
use bevy::tasks::futures_lite::AsyncWriteExt;
use fieldlod_bake::{BakeConfig, bake_file_bytes};
use fieldlod_hierarchy::{FileOptions, Precision};

use crate::glb;

/// Makes Bevy's asset processor put the levels of detail of `.glb` files into them, where the plugin
/// finds them.
///
/// It works while [`AssetPlugin`] processes assets (`AssetMode::Processed` and Bevy's
/// `asset_processor` feature, as when a game is built for shipping). The processed files are plain
/// glTF with one more chunk, which other readers ignore. What the game ships with needs neither this
/// plugin nor the `bake` feature. Files with separate buffers (`.gltf`) are left alone: give them a
/// `.fieldlod` file with `fieldlod bake`.
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
        app.register_asset_processor(BakeIntoGlb)
            .set_default_asset_processor::<BakeIntoGlb>("glb");
    }
}

/// Puts a `.fieldlod` file into a `.glb` file. Its settings are those of the loader.
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
        let path = context.path().clone();
        let mut bytes = Vec::new();
        let read = context.asset_reader().read_to_end(&mut bytes).await;
        read.map_err(|fault| ProcessError::AssetReaderError {
            path: path.clone(),
            err: AssetReaderError::Io(fault.into()),
        })?;
        let processed = processed(&path, bytes);
        let written = writer.write_all(&processed).await;
        written.map_err(|fault| ProcessError::AssetWriterError {
            path,
            err: AssetWriterError::Io(fault),
        })?;
        Ok(copy_of(settings))
    }
}

/// `glb` with its levels of detail; as it was, and the log says why, if it has none.
fn processed(path: &AssetPath, glb: Vec<u8>) -> Vec<u8> {
    match bake_file_bytes(&glb, Path::new(""), &BakeConfig::default(), &|_| ()) {
        Ok(outcome) => {
            for unread in &outcome.unread_images {
                warn!("{path}: {unread}");
            }
            let options = FileOptions {
                precision: Precision::Quantized16,
                beside_source: true,
            };
            let file = outcome.file.to_bytes_with(options);
            glb::with_chunk(&glb, &file).unwrap_or(glb)
        }
        Err(fault) => {
            warn!("{path} is left without levels of detail: {fault}");
            glb
        }
    }
}

/// The settings are not `Clone`.
fn copy_of(settings: &GltfLoaderSettings) -> GltfLoaderSettings {
    let GltfLoaderSettings {
        load_meshes,
        load_materials,
        load_cameras,
        load_lights,
        load_animations,
        include_source,
        default_sampler,
        override_sampler,
        validate,
        convert_coordinates,
        skinned_mesh_bounds_policy,
    } = settings;
    GltfLoaderSettings {
        load_meshes: *load_meshes,
        load_materials: *load_materials,
        load_cameras: *load_cameras,
        load_lights: *load_lights,
        load_animations: *load_animations,
        include_source: *include_source,
        default_sampler: default_sampler.clone(),
        override_sampler: *override_sampler,
        validate: *validate,
        convert_coordinates: *convert_coordinates,
        skinned_mesh_bounds_policy: *skinned_mesh_bounds_policy,
    }
}
