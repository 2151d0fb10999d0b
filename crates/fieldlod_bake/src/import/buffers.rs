//! The bytes behind a document's buffers.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::Document;
use gltf::buffer::Source;
use percent_encoding::percent_decode_str;
use thiserror::Error;

use super::ImportError;

/// Why the bytes of a buffer cannot be had.
#[derive(Debug, Error)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum BufferFault {
    /// The file beside the glTF is missing or unreadable.
    #[error("{uri:?} cannot be read: {error}")]
    Read { uri: String, error: std::io::Error },
    /// A link to somewhere else.
    #[error("{uri:?} is not a file beside the glTF")]
    Elsewhere { uri: String },
    /// Bytes inside the JSON, but garbled.
    #[error("its data URI cannot be decoded: {0}")]
    DataUri(String),
    /// It should be the binary chunk, but there is none.
    #[error("the GLB has no binary chunk")]
    NoBinaryChunk,
    /// Fewer bytes than announced.
    #[error("truncated: {available} of {needed} bytes")]
    Truncated { needed: u64, available: u64 },
}

/// Loads every buffer, in the order of the document.
pub(super) fn load(
    document: &Document,
    blob: Option<&[u8]>,
    folder: &Path,
) -> Result<Vec<Vec<u8>>, ImportError> {
    let load = |buffer: gltf::Buffer<'_>| {
        load_one(&buffer, blob, folder).map_err(|fault| ImportError::Buffer {
            buffer: buffer.index(),
            fault,
        })
    };
    document.buffers().map(load).collect()
}

fn load_one(
    buffer: &gltf::Buffer<'_>,
    blob: Option<&[u8]>,
    folder: &Path,
) -> Result<Vec<u8>, BufferFault> {
    let bytes = match buffer.source() {
        Source::Bin => blob.ok_or(BufferFault::NoBinaryChunk)?.to_vec(),
        Source::Uri(uri) => match uri.strip_prefix("data:") {
            Some(data) => decode_data_uri(data)?,
            None => read_beside(uri, folder)?,
        },
    };
    let (needed, available) = (buffer.length() as u64, bytes.len() as u64);
    if available < needed {
        return Err(BufferFault::Truncated { needed, available });
    }
    Ok(bytes)
}

fn decode_data_uri(data: &str) -> Result<Vec<u8>, BufferFault> {
    let Some((kind, data)) = data.split_once(',') else {
        return Err(BufferFault::DataUri("no comma before the data".into()));
    };
    let decoded: Vec<u8> = percent_decode_str(data).collect();
    if !kind.ends_with(";base64") {
        return Ok(decoded);
    }
    STANDARD
        .decode(decoded)
        .map_err(|error| BufferFault::DataUri(error.to_string()))
}

fn read_beside(uri: &str, folder: &Path) -> Result<Vec<u8>, BufferFault> {
    let elsewhere = || BufferFault::Elsewhere { uri: uri.into() };
    if uri.contains("://") {
        return Err(elsewhere());
    }
    let name = percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| elsewhere())?;
    std::fs::read(folder.join(name.as_ref())).map_err(|error| BufferFault::Read {
        uri: uri.into(),
        error,
    })
}
