//! The `.fieldlod` file: hierarchies, compact, coarsest level first.
//!
//! ```text
//! magic "FLDLOD\r\n" | version u32 | primitive count u32 | directory bytes u64 | XXH3 of it u64
//! directory: per primitive  place, name, source hash, attributes, precision, counts,
//!            and length u64 and XXH3 u64 of each section
//! sections:  the first of every primitive, the second of every primitive, …
//! ```
//! Little-endian throughout. The magic's line end catches transfers that rewrite line ends. The
//! first section of a primitive holds the terminal groups, each further one the groups of the next finer
//! level.
//!
//! A vertex is stored once, in the first section that uses it, as the difference to what its
//! neighbours suggest (the parallelogram rule of C. Touma and C. Gotsman: Triangle Mesh
//! Compression, 1998), its normal as the difference to that of its triangles; a triangle by the edge
//! that it shares with one before it. What remains is entropy-coded by the pco library. A file may
//! leave out the attributes of the source's vertices, but not which of them its triangles use.
//!
//! Deviation: meshoptimizer's vertex and index codecs are not used. Their only kept implementation
//! is C++, which whoever loads a file would have to link; they keep neither the order of vertices
//! nor the corner at which a triangle begins; and they rely on a general compressor after them.

mod contents;
mod decode;
mod encode;
mod error;
mod layout;
mod paged;
mod reader;
mod sections;
mod vertices;

pub use contents::{BakedFile, BakedPrimitive, FileOptions};
pub use error::{FORMAT_VERSION, FileError};
pub use paged::{Page, PageOptions, PagedFile, PagedMesh};
pub use vertices::quantize::Precision;

use decode::Decoder;
use layout::Entry;
use reader::Reader;

// The arrays are written as they lie in memory.
const _: () = assert!(cfg!(target_endian = "little"));

impl BakedFile {
    /// The file's bytes, lossless and with all vertices: the same for the same contents.
    ///
    /// # Panics
    /// If a hierarchy is not valid.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.to_bytes_with(FileOptions::default())
    }

    /// The file's bytes: the same for the same contents.
    ///
    /// # Panics
    /// If a hierarchy is not valid.
    #[must_use]
    pub fn to_bytes_with(&self, options: FileOptions) -> Vec<u8> {
        let primitives = self.primitives.iter();
        let (entries, parts): (Vec<Entry>, Vec<Vec<Vec<u8>>>) = primitives
            .map(|primitive| encode::encode(primitive, options))
            .unzip();
        let mut bytes = layout::write(&entries);
        // The first section of every primitive, the second of every primitive, and so on.
        let most = parts.iter().map(Vec::len).max().unwrap_or(0);
        for number in 0..most {
            for part in parts.iter().filter_map(|parts| parts.get(number)) {
                bytes.extend_from_slice(part);
            }
        }
        bytes
    }

    /// Reads and validates a file's bytes.
    ///
    /// # Errors
    /// A [`FileError`] that says what is wrong; never a panic, whatever the bytes.
    /// [`FileError::SourceVerticesLeftOut`] for a file that was written
    /// [`beside_source`](FileOptions::beside_source).
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FileError> {
        let file = read(bytes)?;
        let mut primitives = file.primitives.iter();
        match primitives.position(|primitive| primitive.hierarchy.lacks_source_vertices()) {
            Some(primitive) => Err(FileError::SourceVerticesLeftOut { primitive }),
            None => Ok(file),
        }
    }

    /// Reads a file whose source is at hand. Hierarchies may
    /// [lack the source's vertices](crate::Hierarchy::lacks_source_vertices): before they are used, call
    /// [`with_source_vertices`](crate::Hierarchy::with_source_vertices), which also checks what could not be checked without.
    ///
    /// # Errors
    /// A [`FileError`] that says what is wrong; never a panic, whatever the bytes.
    pub fn from_bytes_beside_source(bytes: &[u8]) -> Result<Self, FileError> {
        read(bytes)
    }
}

fn read(bytes: &[u8]) -> Result<BakedFile, FileError> {
    let (entries, sections) = layout::read(bytes)?;
    check_length(&entries, sections.len() as u64)?;
    let longest = entries.iter().map(|entry| entry.sections.len()).max();
    let mut decoders: Vec<Decoder> = entries.into_iter().map(Decoder::new).collect();
    let mut reader = Reader { rest: sections };
    // The first section of every primitive, the second of every primitive, and so on.
    for _ in 0..longest.unwrap_or(0) {
        for decoder in &mut decoders {
            decoder.read_section(&mut reader)?;
        }
    }
    let numbered = decoders.into_iter().enumerate();
    let primitives = numbered.map(|(index, decoder)| decoder.finish(index));
    Ok(BakedFile {
        primitives: primitives.collect::<Result<_, _>>()?,
    })
}

/// Checks that the file has exactly the sections that the directory announces.
fn check_length(entries: &[Entry], available: u64) -> Result<(), FileError> {
    let sections = entries.iter().flat_map(|entry| &entry.sections);
    let needed = sections.fold(0, |sum: u64, part| sum.saturating_add(part.length));
    if available < needed {
        return Err(FileError::Truncated {
            what: "the file",
            needed,
            available,
        });
    }
    if available > needed {
        let extra = available - needed;
        return Err(FileError::TrailingBytes { extra });
    }
    Ok(())
}
