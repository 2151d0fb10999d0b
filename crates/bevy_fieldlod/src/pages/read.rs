//! Reads `.fieldpages` files: what stays in memory, and single pages.

use std::io::{self, SeekFrom};
use std::ops::Range;

use bevy::asset::io::{
    AssetReaderError, MissingAssetSourceError, MissingProcessedAssetReaderError, Reader,
};
use bevy::asset::{AssetPath, AssetServer, AssetServerMode, AsyncReadExt, AsyncSeekExt};
use bevy::mesh::MeshAccessError;
use bevy::prelude::*;
use bevy::tasks::AsyncComputeTaskPool;
use fieldlod_hierarchy::{FileError, Hierarchy, PagedFile};
use thiserror::Error;

use crate::lod_pages::{LodPages, PagePlace};
use crate::mesh_in_pages::{MeshInPages, UnitOfPage};

/// Bytes of a page that are asked for at once.
const MOST_AT_ONCE: usize = 256 << 10;

/// Why a page is not there.
#[derive(Debug, Error)]
pub(super) enum PageError {
    #[error(transparent)]
    Source(#[from] MissingAssetSourceError),
    #[error(transparent)]
    Processed(#[from] MissingProcessedAssetReaderError),
    #[error(transparent)]
    Open(#[from] AssetReaderError),
    #[error(transparent)]
    Read(#[from] io::Error),
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Mesh(#[from] MeshAccessError),
}

impl LodPages {
    /// Reads the table of contents and the first pages; all of a file that cannot be read in parts.
    pub(crate) async fn read(
        reader: &mut dyn Reader,
        path: AssetPath<'static>,
    ) -> Result<Self, BevyError> {
        let name = path.to_string();
        let can_seek = reader.seekable().is_ok();
        let mut bytes = Vec::new();
        read_up_to(reader, &mut bytes, PagedFile::HEADER_BYTES as u64).await?;
        let contents = PagedFile::contents_end(&bytes)?;
        read_up_to(reader, &mut bytes, contents).await?;
        let contents = contents.min(bytes.len() as u64);
        let file = PagedFile::from_contents(&bytes[..contents as usize])?;
        let first_pages = file.meshes.iter().filter_map(|mesh| mesh.pages.first());
        let end = first_pages.map(|page| page.bytes.end).max().unwrap_or(0);
        read_up_to(reader, &mut bytes, if can_seek { end } else { u64::MAX }).await?;
        let first_page = |mesh: &fieldlod_hierarchy::PagedMesh| -> Result<Hierarchy, FileError> {
            let page = mesh
                .pages
                .first()
                .ok_or(FileError::Corrupt { what: "the pages" })?;
            mesh.read_page(0, part(&bytes, &page.bytes)?)
        };
        Ok(Self {
            first_pages: file.meshes.iter().map(first_page).collect(),
            place: match can_seek {
                true => PagePlace::Path(path),
                false => PagePlace::Memory(bytes),
            },
            file,
            name,
        })
    }
}

/// Reads on until there are so many bytes, or no more.
async fn read_up_to(reader: &mut dyn Reader, bytes: &mut Vec<u8>, end: u64) -> io::Result<()> {
    let more = end.saturating_sub(bytes.len() as u64);
    AsyncReadExt::take(reader, more).read_to_end(bytes).await?;
    Ok(())
}

fn part<'a>(bytes: &'a [u8], range: &Range<u64>) -> Result<&'a [u8], FileError> {
    let part = bytes.get(range.start as usize..range.end as usize);
    part.ok_or(FileError::Truncated {
        what: "the file",
        needed: range.end,
        available: bytes.len() as u64,
    })
}

impl MeshInPages {
    /// Reads and decodes a page.
    pub(super) async fn read(
        self,
        page: u32,
        assets: AssetServer,
    ) -> Result<Vec<UnitOfPage>, PageError> {
        let range = self.paged().pages[page as usize].bytes.clone();
        let bytes = match &self.pages.place {
            PagePlace::Path(path) => read_part(&assets, path, range).await?,
            PagePlace::Memory(bytes) => part(bytes, &range)?.to_vec(),
        };
        let decode = async move {
            let read = self.paged().read_page(page as usize, &bytes)?;
            Ok(self.units_of_page(page, &read)?)
        };
        AsyncComputeTaskPool::get().spawn(decode).await
    }
}

async fn read_part(
    assets: &AssetServer,
    path: &AssetPath<'static>,
    range: Range<u64>,
) -> Result<Vec<u8>, PageError> {
    let source = assets.get_source(path.source())?;
    let reader = match assets.mode() {
        AssetServerMode::Unprocessed => source.reader(),
        AssetServerMode::Processed => source.processed_reader()?,
    };
    let mut reader = reader.read(path.path()).await?;
    let reader = reader.seekable().map_err(io::Error::other)?;
    reader.seek(SeekFrom::Start(range.start)).await?;
    // Much at once, since Bevy's reader of files reads ahead as long as it is there; and no more memory than bytes
    // come, whatever the table of contents says.
    let (length, mut bytes) = ((range.end - range.start) as usize, Vec::new());
    while bytes.len() < length {
        let read = bytes.len();
        bytes.resize(length.min(read + MOST_AT_ONCE), 0);
        let more = reader.read(&mut bytes[read..]).await?;
        bytes.truncate(read + more);
        if more == 0 {
            return Err(PageError::File(FileError::Truncated {
                what: "the file",
                needed: range.end,
                available: range.start + read as u64,
            }));
        }
    }
    Ok(bytes)
}
