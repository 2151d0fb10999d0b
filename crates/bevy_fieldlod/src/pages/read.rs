//! Reads the resident beginning of `.fieldpages` files, and single pages.

use std::error::Error;
use std::io::{self, SeekFrom};
use std::ops::Range;
use std::path::PathBuf;

use bevy::asset::io::Reader;
use bevy::asset::{AssetPath, AssetServer, AssetServerMode, AsyncReadExt, AsyncSeekExt};
use bevy::prelude::*;
use bevy::tasks::AsyncComputeTaskPool;
use fieldlod_hierarchy::{FileError, Hierarchy, PagedFile};

use crate::assets::file_parts::{AssetFolder, read_part};
use crate::assets::lod_pages::{LodPages, PagePlace};
use crate::pages::mesh_in_pages::{MeshInPages, UnitOfPage};

/// Why a page could not be read.
pub(super) type PageError = Box<dyn Error + Send + Sync>;

impl LodPages {
    /// Reads the table of contents and the first pages, or the whole file if its reader cannot seek.
    pub(crate) async fn read(
        reader: &mut dyn Reader,
        path: AssetPath<'static>,
        folder: Option<&AssetFolder>,
    ) -> Result<Self, BevyError> {
        let name = path.to_string();
        // A browser's reader has the whole file, and would fetch it again for each page.
        let can_seek = !cfg!(target_arch = "wasm32") && reader.seekable().is_ok();
        let file = match folder {
            Some(folder) => folder.find(&path, reader).await,
            None => None,
        };
        let mut beginning = Beginning {
            bytes: Vec::new(),
            file,
            reader,
        };
        beginning.read_up_to(PagedFile::HEADER_BYTES as u64).await?;
        let contents = PagedFile::contents_end(&beginning.bytes)?;
        beginning.read_up_to(contents).await?;
        let contents = contents.min(beginning.bytes.len() as u64);
        let paged = PagedFile::from_contents(&beginning.bytes[..contents as usize])?;
        let first_pages = paged.meshes.iter().filter_map(|mesh| mesh.pages.first());
        let end = first_pages.map(|page| page.bytes.end).max().unwrap_or(0);
        // A reader that cannot seek gives each byte once: all pages are kept.
        let end = if can_seek { end } else { u64::MAX };
        beginning.read_up_to(end).await?;
        let Beginning { bytes, file, .. } = beginning;
        let first_page = |mesh: &fieldlod_hierarchy::PagedMesh| -> Result<Hierarchy, FileError> {
            let page = mesh
                .pages
                .first()
                .ok_or(FileError::Corrupt { what: "the pages" })?;
            mesh.read_page(0, part(&bytes, &page.bytes)?)
        };
        Ok(Self {
            first_pages: paged.meshes.iter().map(first_page).collect(),
            place: match file {
                Some(file) => PagePlace::File(file),
                None if can_seek => PagePlace::Asset(path),
                None => PagePlace::Memory(bytes),
            },
            file: paged,
            name,
        })
    }
}

/// The part of a file that has been read: its beginning.
struct Beginning<'a> {
    bytes: Vec<u8>,
    /// The file to read directly, without the reader.
    file: Option<PathBuf>,
    reader: &'a mut dyn Reader,
}

impl Beginning<'_> {
    /// Reads up to the byte `end`, or to the end of the file.
    async fn read_up_to(&mut self, end: u64) -> io::Result<()> {
        let start = self.bytes.len() as u64;
        let more = match &self.file {
            Some(file) => read_part(file.clone(), start..end).await?,
            None => read_next(self.reader, end.saturating_sub(start)).await?,
        };
        self.bytes.extend_from_slice(&more);
        Ok(())
    }
}

/// Reads up to `count` bytes. It allocates only for bytes that arrive, so a corrupt count cannot exhaust the memory.
async fn read_next(reader: &mut dyn Reader, count: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    AsyncReadExt::take(reader, count)
        .read_to_end(&mut bytes)
        .await?;
    Ok(bytes)
}

fn part<'a>(bytes: &'a [u8], range: &Range<u64>) -> Result<&'a [u8], FileError> {
    let part = bytes.get(range.start as usize..range.end as usize);
    part.ok_or(truncated(range.end, bytes.len() as u64))
}

fn truncated(needed: u64, available: u64) -> FileError {
    FileError::Truncated {
        what: "the file",
        needed,
        available,
    }
}

impl MeshInPages {
    /// Reads and decodes a page.
    pub(super) async fn read(
        self,
        page: u32,
        assets: AssetServer,
    ) -> Result<Vec<UnitOfPage>, PageError> {
        let Range { start, end } = self.paged().pages[page as usize].bytes;
        let bytes = match &self.pages.place {
            PagePlace::File(file) => read_part(file.clone(), start..end).await?,
            PagePlace::Asset(path) => read_asset_part(&assets, path, start..end).await?,
            PagePlace::Memory(bytes) => part(bytes, &(start..end))?.to_vec(),
        };
        if (bytes.len() as u64) < end - start {
            return Err(truncated(end, start + bytes.len() as u64).into());
        }
        // Decoding takes long, and the few threads for input and output have other reads to do.
        let decode = async move {
            let read = self.paged().read_page(page as usize, &bytes)?;
            Ok(self.units_of_page(page, &read)?)
        };
        AsyncComputeTaskPool::get().spawn(decode).await
    }
}

/// The bytes of an asset in a range, or fewer if the asset is shorter.
async fn read_asset_part(
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
    let seekable = reader.seekable().map_err(io::Error::other)?;
    seekable.seek(SeekFrom::Start(range.start)).await?;
    Ok(read_next(&mut *reader, range.end - range.start).await?)
}
