//! Reads parts of files of the system, and no more than those.
//!
//! Bevy's reader of files reads on from where it was sent to, up to 8 MiB, for as long as it is there. So files in the
//! folder of assets are read past it.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::PathBuf;

use bevy::asset::io::{AssetSourceId, Reader};
use bevy::asset::{AssetMode, AssetPath, AsyncSeekExt};
use bevy::prelude::*;

/// By so many bytes at its end a file is known.
const END_BYTES: i64 = 64;

/// Where Bevy looks for assets, unless a game has a default source of its own.
#[derive(Clone, Debug)]
pub(crate) struct AssetFolder(PathBuf);

impl AssetFolder {
    /// That of an app's [`AssetPlugin`].
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn of(app: &App) -> Option<Self> {
        let plugins = app.get_added_plugins::<AssetPlugin>();
        let plugin = plugins.first()?;
        let folder = match plugin.mode {
            AssetMode::Unprocessed => &plugin.file_path,
            AssetMode::Processed => &plugin.processed_file_path,
        };
        let base = bevy::asset::io::file::FileAssetReader::get_base_path();
        Some(Self(base.join(folder)))
    }

    /// The web has none.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn of(_app: &App) -> Option<Self> {
        None
    }

    /// The file in the folder that `reader` reads from, which is set back to its beginning. None if it reads from
    /// elsewhere: a source may have any reader.
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
        // Nothing lies behind the end, and so it is not read on from there.
        let start = reader.seek(SeekFrom::End(-END_BYTES)).await.ok();
        let mut end = Vec::new();
        let is_read = reader.read_to_end(&mut end).await.is_ok();
        reader.seek(SeekFrom::Start(0)).await.ok()?;
        let range = start.filter(|_| is_read)?..u64::MAX;
        let same = read_part(file.clone(), range).await.ok()? == end;
        same.then_some(file)
    }
}

/// The bytes of a file in a range, or fewer if it ends before.
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
    // Disks that do not answer keep threads, but none of Bevy's.
    #[cfg(not(target_arch = "wasm32"))]
    let bytes = blocking::unblock(read).await;
    #[cfg(target_arch = "wasm32")]
    let bytes = read();
    bytes
}
