//! The format version, and errors of reading.

use thiserror::Error;

use crate::validate::InvalidHierarchy;

/// The version that this crate writes, and the only one that it reads.
pub const FORMAT_VERSION: u32 = 1;

/// Why bytes are not a usable `.fieldlod` file.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum FileError {
    /// The first bytes are not the magic.
    #[error("not a .fieldlod file")]
    NotFieldlod,
    /// Another version of the program wrote the file.
    #[error("format version {found}, but this program reads version {FORMAT_VERSION}: bake again")]
    Version { found: u32 },
    /// There are fewer bytes than the header or an array announces.
    #[error("truncated: {what} ends after {available} of {needed} bytes")]
    Truncated {
        what: &'static str,
        needed: u64,
        available: u64,
    },
    /// There are more bytes than the header announces.
    #[error("{extra} bytes follow the end of the data")]
    TrailingBytes { extra: u64 },
    /// The checksum does not fit the bytes.
    #[error("corrupt: wrong checksum")]
    Checksum,
    /// The name of a primitive is not UTF-8.
    #[error("corrupt: the name of primitive {primitive} is not UTF-8")]
    Name { primitive: usize },
    /// Data that no writer produces, although the checksum fits.
    #[error("corrupt: could not decode {what}")]
    Corrupt { what: &'static str },
    /// The file is without the vertices of its source, but the reader needs all vertices.
    #[error("primitive {primitive}: the file is without the vertices of its source")]
    SourceVerticesLeftOut { primitive: usize },
    /// An invariant is broken, although the checksum fits.
    #[error("primitive {primitive}: {fault}")]
    Invalid {
        primitive: usize,
        fault: InvalidHierarchy,
    },
}
