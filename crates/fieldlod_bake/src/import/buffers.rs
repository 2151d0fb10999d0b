//! Bytes of the buffers of a document.

use std::collections::HashMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::Document;
use gltf::buffer::{Source, View};
use percent_encoding::percent_decode_str;

use super::ReadBeside;
use super::error::{BufferFault, ImportError};
use super::meshopt_views;

/// Largest number of characters of a URI in a message. The length of a URI is not limited.
const MOST_SHOWN: usize = 120;

/// The bytes of all buffer views.
pub(super) struct Buffers {
    buffers: Vec<Vec<u8>>,
    /// Decoded bytes of compressed views, by the index of the view.
    unpacked: HashMap<usize, Vec<u8>>,
}

impl Buffers {
    /// Reads every buffer and decodes every compressed view.
    pub(super) fn load(
        document: &Document,
        blob: Option<&[u8]>,
        beside: &ReadBeside<'_>,
    ) -> Result<Self, ImportError> {
        let load = |buffer: gltf::Buffer<'_>| {
            load_one(&buffer, blob, beside).map_err(|fault| ImportError::Buffer {
                buffer: buffer.index(),
                fault,
            })
        };
        let buffers: Vec<Vec<u8>> = document.buffers().map(load).collect::<Result<_, _>>()?;
        let unpacked = unpack_views(document, &buffers)?;
        Ok(Self { buffers, unpacked })
    }

    /// The bytes of `view`. `None` if it ends outside its buffer.
    pub(super) fn view(&self, view: &View<'_>) -> Option<&[u8]> {
        if let Some(bytes) = self.unpacked.get(&view.index()) {
            return Some(bytes);
        }
        let buffer = self.buffers.get(view.buffer().index())?;
        buffer.get(view.offset()..view.offset().checked_add(view.length())?)
    }
}

fn unpack_views(
    document: &Document,
    buffers: &[Vec<u8>],
) -> Result<HashMap<usize, Vec<u8>>, ImportError> {
    let mut left = meshopt_views::allowance(buffers);
    let mut unpacked = HashMap::new();
    for view in document.views() {
        let Some(object) = meshopt_views::object_of(&view) else {
            continue;
        };
        let unpack = meshopt_views::unpack(object, buffers, left);
        let bytes = unpack.map_err(|fault| ImportError::PackedView {
            view: view.index(),
            fault,
        })?;
        // The allowance is for the file, not for each view: many views may name the same few bytes.
        left -= bytes.len();
        unpacked.insert(view.index(), bytes);
    }
    Ok(unpacked)
}

/// Returns `true` for a buffer without bytes, which is a fallback for readers that do not support compression.
fn is_empty_fallback(buffer: &gltf::Buffer<'_>) -> bool {
    let names = meshopt_views::EXTENSIONS.iter();
    let mut objects = names.filter_map(|name| buffer.extension_value(name));
    let fallback = objects.any(|object| object.get("fallback") == Some(&true.into()));
    fallback && matches!(buffer.source(), Source::Bin)
}

fn load_one(
    buffer: &gltf::Buffer<'_>,
    blob: Option<&[u8]>,
    beside: &ReadBeside<'_>,
) -> Result<Vec<u8>, BufferFault> {
    if is_empty_fallback(buffer) {
        return Ok(Vec::new());
    }
    let bytes = match buffer.source() {
        Source::Bin => blob.ok_or(BufferFault::NoBinaryChunk)?.to_vec(),
        Source::Uri(uri) => read_uri(uri, beside)?,
    };
    let (needed, available) = (buffer.length() as u64, bytes.len() as u64);
    if available < needed {
        return Err(BufferFault::Truncated { needed, available });
    }
    Ok(bytes)
}

/// The bytes of a data URI, or of a file that `beside` reads.
pub(super) fn read_uri(uri: &str, beside: &ReadBeside<'_>) -> Result<Vec<u8>, BufferFault> {
    match data_of(uri) {
        Some(data) => decode_data_uri(data),
        None => read_beside(uri, beside),
    }
}

/// The part of a data URI after the scheme. The case of the scheme is ignored.
pub(super) fn data_of(uri: &str) -> Option<&str> {
    let (scheme, data) = uri.split_at_checked("data:".len())?;
    scheme.eq_ignore_ascii_case("data:").then_some(data)
}

/// The start of a URI, for messages.
fn shortened(uri: &str) -> String {
    match uri.char_indices().nth(MOST_SHOWN) {
        Some((end, _)) => format!("{}…", &uri[..end]),
        None => uri.into(),
    }
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

fn read_beside(uri: &str, beside: &ReadBeside<'_>) -> Result<Vec<u8>, BufferFault> {
    let elsewhere = || BufferFault::Elsewhere {
        uri: shortened(uri),
    };
    // Nothing is downloaded during a bake.
    if uri.contains("://") {
        return Err(elsewhere());
    }
    let name = percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| elsewhere())?;
    beside(&name).map_err(|error| BufferFault::Read {
        uri: shortened(uri),
        error,
    })
}
