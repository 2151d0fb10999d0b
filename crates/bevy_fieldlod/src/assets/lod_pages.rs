//! The resident part of a `.fieldpages` file.

use std::path::PathBuf;

use bevy::asset::AssetPath;
use fieldlod_hierarchy::{FileError, Hierarchy, PagedFile};

/// The table of contents of a file and the coarsest levels of its meshes.
#[derive(Debug)]
pub(crate) struct LodPages {
    pub(crate) file: PagedFile,
    /// The first page of each mesh.
    pub(crate) first_pages: Vec<Result<Hierarchy, FileError>>,
    /// The location of the other pages.
    pub(crate) place: PagePlace,
    /// The path of the file.
    pub(crate) name: String,
}

/// The location of pages.
#[derive(Debug)]
pub(crate) enum PagePlace {
    /// A file on disk.
    File(PathBuf),
    /// An asset with a reader that can seek.
    Asset(AssetPath<'static>),
    /// All bytes of a file whose reader cannot seek.
    Memory(Vec<u8>),
}
