//! Reads byte ranges of files in the asset folder.
//!
//! Bevy's file reader reads up to 8 MiB ahead after each seek, so this module opens the files itself.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::PathBuf;

use bevy::asset::io::{AssetSourceId, Reader};
use bevy::asset::{AssetPath, AsyncSeekExt};
use bevy::prelude::*;

/// Number of bytes at the end of a file that must be equal for two files to count as the same: the end of the
/// last page. With fewer, different files may be taken for each other; with more, the check reads more bytes.
const END_BYTES: i64 = 64;

/// The asset folder of Bevy's default source.
#[derive(Clone, Debug)]
pub(crate) struct AssetFolder(PathBuf);

impl AssetFolder {
    /// The folder of an app's [`AssetPlugin`].
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn of(app: &App) -> Option<Self> {
        use bevy::asset::AssetMode;
        let plugins = app.get_added_plugins::<AssetPlugin>();
        let plugin = plugins.first()?;
        let folder = match plugin.mode {
            AssetMode::Unprocessed => &plugin.file_path,
            AssetMode::Processed => &plugin.processed_file_path,
        };
        let base = bevy::asset::io::file::FileAssetReader::get_base_path();
        Some(Self(base.join(folder)))
    }

    /// Returns `None`: a browser has no asset folder. No file is opened there.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn of(_app: &App) -> Option<Self> {
        None
    }

    /// Finds the file in the folder that `reader` reads, and rewinds the reader. `None` if a custom asset source reads
    /// from another place.
    pub(crate) async fn find(
        &self,
        asset: &AssetPath<'static>,
        reader: &mut dyn Reader,
    ) -> Option<PathBuf> {
        if *asset.source() != AssetSourceId::Default {
            return None;
        }
        let file = self.0.join(asset.path());
        let reader = reader.seekable().ok()?;
        // At the end of the file, Bevy's reader has nothing to read ahead.
        let start = reader.seek(SeekFrom::End(-END_BYTES)).await.ok();
        let mut end = Vec::new();
        let is_read = reader.read_to_end(&mut end).await.is_ok();
        reader.seek(SeekFrom::Start(0)).await.ok()?;
        let range = start.filter(|_| is_read)?..u64::MAX;
        let same = read_part(file.clone(), range).await.ok()? == end;
        same.then_some(file)
    }
}

/// The bytes of a file in a range, or fewer if the file is shorter.
pub(crate) async fn read_part(path: PathBuf, range: Range<u64>) -> io::Result<Vec<u8>> {
    let read = move || {
        let mut file = File::open(path)?;
        let end = range.end.min(file.metadata()?.len());
        let length = end.saturating_sub(range.start);
        let mut bytes = Vec::with_capacity(length as usize);
        file.seek(SeekFrom::Start(range.start))?;
        file.take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    // A slow disk must not block Bevy's threads.
    #[cfg(not(target_arch = "wasm32"))]
    let bytes = blocking::unblock(read).await;
    #[cfg(target_arch = "wasm32")]
    let bytes = read();
    bytes
}
