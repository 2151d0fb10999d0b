//! What of a `.fieldpages` file is always in memory.

use std::path::PathBuf;

use bevy::asset::AssetPath;
use fieldlod_hierarchy::{FileError, Hierarchy, PagedFile};

/// The table of contents of a file and the coarsest levels of its meshes.
#[derive(Debug)]
pub(crate) struct LodPages {
    pub(crate) file: PagedFile,
    /// The first page of each mesh.
    pub(crate) first_pages: Vec<Result<Hierarchy, FileError>>,
    /// Where all other pages are.
    pub(crate) place: PagePlace,
    /// The path of the file.
    pub(crate) name: String,
}

/// Where pages are read from.
#[derive(Debug)]
pub(crate) enum PagePlace {
    /// A file of the system.
    File(PathBuf),
    /// A file of which Bevy's reader can read parts.
    Asset(AssetPath<'static>),
    /// All bytes of a file that can only be read as a whole.
    Memory(Vec<u8>),
}
