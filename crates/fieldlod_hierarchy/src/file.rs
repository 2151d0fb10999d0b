//! The `.fieldlod` file: compressed hierarchies, coarsest level first.
//!
//! ```text
//! magic "FLDLOD\r\n" | version u32 | primitive count u32
//! | directory bytes u64 | XXH3 of directory u64, seed: primitive count
//! directory: per primitive  indices, name, source hash, attributes, precision, flags, carrier joint,
//!            grids if quantized, position error if quantized or flagged, counts,
//!            and length u64 and XXH3 u64 of each section
//! sections:  the first of every primitive, the second of every primitive, …
//! ```
//! All numbers are little-endian. The line end in the magic detects transfers that rewrite line ends.
//! The first section of a primitive holds the terminal groups. Each further section holds the groups
//! of the next finer level.
//!
//! The first section that uses a vertex stores it. Vertices of a section are in the order of their first
//! use. Each coordinate of each attribute is a list of numbers, and each corner of the triangles is another
//! one. The pco library takes differences of neighbours, or distances to repeated numbers, and
//! entropy-codes them.
//!
//! Attributes that are predicted from neighbouring triangles, and triangles that are coded by shared edges,
//! need 13 % fewer bytes in exact files and 23 % fewer in quantized ones. Reading them takes about twice as long
//! (`RECORD.md` in `benches`).
//!
//! meshoptimizer's vertex and index codecs do not fit: their maintained implementation is C++, which
//! every loader would have to link. The index codec also changes the first corner of triangles, and both
//! codecs need a general compressor behind them.

mod contents;
mod decode;
mod encode;
mod error;
mod layout;
mod paged;
mod reader;
mod sections;
mod vertices;

pub use contents::{BakedFile, BakedPrimitive};
pub use error::{FORMAT_VERSION, FileError};
pub use paged::{Page, PageOptions, PagedFile, PagedMesh};
pub use vertices::quantize::Precision;

use decode::Decoder;
use layout::Entry;
use reader::Reader;

// Arrays are written with the byte order of memory.
const _: () = assert!(cfg!(target_endian = "little"));

impl BakedFile {
    /// Encodes the file losslessly. Equal contents give equal bytes.
    ///
    /// # Panics
    /// If a hierarchy is not valid.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.to_bytes_with(Precision::default())
    }

    /// Encodes the file with this precision of vertex attributes. Equal contents give equal bytes.
    ///
    /// # Panics
    /// If a hierarchy is not valid.
    #[must_use]
    pub fn to_bytes_with(&self, precision: Precision) -> Vec<u8> {
        let primitives = self.primitives.iter();
        let (entries, parts): (Vec<Entry>, Vec<Vec<Vec<u8>>>) = primitives
            .map(|primitive| encode::encode(primitive, precision))
            .unzip();
        let mut bytes = layout::write(&entries);
        bytes.extend(in_file_order(&parts).flatten());
        bytes
    }

    /// Decodes and validates a file.
    ///
    /// # Errors
    /// A [`FileError`] if the bytes are not a valid file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, FileError> {
        let (entries, sections) = layout::read(bytes)?;
        check_length(&entries, sections.len() as u64)?;
        // Sections of all primitives alternate, as they were written: the front of a file holds complete coarse cuts.
        let longest = entries.iter().map(|entry| entry.sections.len()).max();
        let decoders = entries.into_iter().map(|entry| Decoder::new(entry, false));
        let mut decoders: Vec<Decoder> = decoders.collect();
        let mut reader = Reader { rest: sections };
        for _ in 0..longest.unwrap_or(0) {
            for decoder in &mut decoders {
                decoder.read_section(&mut reader)?;
            }
        }
        let primitives = decoders.into_iter().map(Decoder::finish);
        Ok(Self {
            primitives: primitives.collect::<Result<_, _>>()?,
        })
    }
}

/// The first item of each list, the second item of each list, and so on.
fn in_file_order<T>(lists: &[Vec<T>]) -> impl Iterator<Item = &T> {
    let longest = lists.iter().map(Vec::len).max().unwrap_or(0);
    (0..longest).flat_map(move |number| lists.iter().filter_map(move |list| list.get(number)))
}

/// Checks that the file ends with the last section of the directory.
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
