//! The format version and errors of reading.

use thiserror::Error;

use crate::validate::InvalidHierarchy;

/// The format version that this crate reads and writes.
pub const FORMAT_VERSION: u32 = 2;

/// Reasons why bytes are not a valid `.fieldlod` or `.fieldpages` file.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum FileError {
    /// The first bytes are not the magic.
    #[error("not a .fieldlod file")]
    NotFieldlod,
    /// The format version is not [`FORMAT_VERSION`].
    #[error("format version {found}, but this program reads version {FORMAT_VERSION}: bake again")]
    Version { found: u32 },
    /// The bytes end before the announced length.
    #[error("truncated: {what} ends after {available} of {needed} bytes")]
    Truncated {
        what: &'static str,
        needed: u64,
        available: u64,
    },
    /// The bytes continue after the announced length.
    #[error("{extra} bytes follow the end of the data")]
    TrailingBytes { extra: u64 },
    /// The checksum does not match the bytes.
    #[error("corrupt: wrong checksum")]
    Checksum,
    /// The name of a primitive is not UTF-8.
    #[error("corrupt: the name of primitive {primitive} is not UTF-8")]
    Name { primitive: usize },
    /// The checksum matches, but the data cannot be decoded.
    #[error("corrupt: could not decode {what}")]
    Corrupt { what: &'static str },
    /// The checksum matches, but the hierarchy is invalid.
    #[error("primitive {primitive}: {fault}")]
    Invalid {
        primitive: usize,
        fault: InvalidHierarchy,
    },
}
