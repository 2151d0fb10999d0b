//! Buffer views compressed by `EXT_meshopt_compression` or its successor `KHR_meshopt_compression`.
//!
//! meshoptimizer decodes them. It does not check strides, counts and filters; this module does. Numbers are
//! little-endian in glTF and in memory; `fieldlod_hierarchy` does not build for other machines.

use bytemuck::Pod;
use gltf::buffer::View;
use gltf::json::Value;
use meshopt::{decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat};
use meshopt::{decode_index_buffer, decode_index_sequence, decode_vertex_buffer};
use thiserror::Error;

/// The names of the extension.
pub(super) const EXTENSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Largest number of decoded bytes of all views of a file: 1,024 for each byte of its buffers, plus 16 MiB. Otherwise
/// a file of a few kilobytes could claim gigabytes.
pub(super) fn allowance(buffers: &[Vec<u8>]) -> usize {
    let bytes: usize = buffers.iter().map(Vec::len).sum();
    bytes.saturating_mul(1 << 10).saturating_add(1 << 24)
}

/// Why a compressed buffer view could not be decoded.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum PackedViewFault {
    /// A property is missing, out of range, or claims too many bytes.
    #[error("its {property} is missing or out of range")]
    Property { property: &'static str },
    /// The compressed bytes end outside their buffer.
    #[error("its packed bytes lie outside buffer {buffer}")]
    OutOfBounds { buffer: usize },
    /// meshoptimizer could not decode the bytes.
    #[error("its packed bytes are corrupt")]
    Corrupt,
}

use PackedViewFault as Fault;

/// The extension object of a view. Its ranges are checked.
struct Packed<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
    mode: &'a str,
    filter: &'a str,
}

/// The extension object of `view`; `None` if it is not compressed.
pub(super) fn object_of<'a>(view: &'a View<'_>) -> Option<&'a Value> {
    let extensions = view.extensions()?;
    EXTENSIONS.iter().find_map(|&name| extensions.get(name))
}

/// Decodes a view with this extension object, to at most `most` bytes.
pub(super) fn unpack(object: &Value, buffers: &[Vec<u8>], most: usize) -> Result<Vec<u8>, Fault> {
    let packed = Packed::read(object, buffers, most)?;
    match packed.count {
        0 => Ok(Vec::new()),
        _ => packed.decode(),
    }
}

fn number(object: &Value, property: &'static str) -> Result<usize, Fault> {
    let value = object.get(property).and_then(Value::as_u64);
    value
        .and_then(|value| usize::try_from(value).ok())
        .ok_or(Fault::Property { property })
}

fn text<'a>(object: &'a Value, property: &'static str) -> Result<&'a str, Fault> {
    let value = object.get(property).and_then(Value::as_str);
    value.ok_or(Fault::Property { property })
}

impl<'a> Packed<'a> {
    fn read(object: &'a Value, buffers: &'a [Vec<u8>], most: usize) -> Result<Self, Fault> {
        let buffer = number(object, "buffer")?;
        let start = match object.get("byteOffset") {
            Some(_) => number(object, "byteOffset")?,
            None => 0,
        };
        let end = start.checked_add(number(object, "byteLength")?);
        let whole = buffers.get(buffer).zip(end);
        let bytes = whole.and_then(|(bytes, end)| bytes.get(start..end));
        let packed = Self {
            bytes: bytes.ok_or(Fault::OutOfBounds { buffer })?,
            stride: number(object, "byteStride")?,
            count: number(object, "count")?,
            mode: text(object, "mode")?,
            filter: match object.get("filter") {
                Some(_) => text(object, "filter")?,
                None => "NONE",
            },
        };
        match packed.bad_property(most) {
            Some(property) => Err(Fault::Property { property }),
            None => Ok(packed),
        }
    }

    /// The first property that is out of the range that the extension allows, or that claims too many bytes.
    fn bad_property(&self, most: usize) -> Option<&'static str> {
        let stride = self.stride;
        let stride_fits = match self.mode {
            "ATTRIBUTES" => (1..=256).contains(&stride) && stride.is_multiple_of(4),
            "TRIANGLES" | "INDICES" => stride == 2 || stride == 4,
            _ => return Some("mode"),
        };
        let filter_fits = match (self.mode, self.filter) {
            (_, "NONE") | ("ATTRIBUTES", "EXPONENTIAL") => true,
            ("ATTRIBUTES", "OCTAHEDRAL" | "COLOR") => stride == 4 || stride == 8,
            ("ATTRIBUTES", "QUATERNION") => stride == 8,
            _ => false,
        };
        let bytes = self.count.checked_mul(stride.max(1));
        let count_fits = bytes.is_some_and(|bytes| bytes <= most)
            && (self.mode != "TRIANGLES" || self.count.is_multiple_of(3));
        let checks = [
            ("byteStride", stride_fits),
            ("filter", filter_fits),
            ("count", count_fits),
        ];
        let bad = checks.into_iter().find(|(_, fits)| !fits);
        bad.map(|(property, _)| property)
    }

    fn decode(&self) -> Result<Vec<u8>, Fault> {
        let (bytes, count) = (self.bytes, self.count);
        match (self.mode, self.stride) {
            ("TRIANGLES", 2) => return bytes_of(decode_index_buffer::<u16>(bytes, count)),
            ("TRIANGLES", _) => return bytes_of(decode_index_buffer::<u32>(bytes, count)),
            ("INDICES", 2) => return bytes_of(decode_index_sequence::<u16>(bytes, count)),
            ("INDICES", _) => return bytes_of(decode_index_sequence::<u32>(bytes, count)),
            _ => {}
        }
        let elements = self.elements()?;
        Ok(match (self.filter, self.stride) {
            ("OCTAHEDRAL", 4) => filtered(&elements, decode_filter_oct::<i8>),
            ("OCTAHEDRAL", _) => filtered(&elements, decode_filter_oct::<i16>),
            ("COLOR", 4) => filtered(&elements, decode_filter_color::<i8>),
            ("COLOR", _) => filtered(&elements, decode_filter_color::<i16>),
            ("QUATERNION", _) => filtered(&elements, decode_filter_quat),
            ("EXPONENTIAL", _) => filtered(&elements, decode_filter_exp::<1>),
            _ => elements,
        })
    }

    /// The decoded elements before filters.
    fn elements(&self) -> Result<Vec<u8>, Fault> {
        // The size of an element is part of its type.
        macro_rules! for_stride {
            ($($words:literal)*) => {
                match self.stride / 4 {
                    $($words => bytes_of(decode_vertex_buffer::<[u32; $words]>(self.bytes, self.count)),)*
                    _ => Err(Fault::Property { property: "byteStride" }),
                }
            };
        }
        for_stride!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29
            30 31 32)
    }
}

fn bytes_of<T: Pod>(decoded: meshopt::Result<Vec<T>>) -> Result<Vec<u8>, Fault> {
    let elements = decoded.map_err(|_| Fault::Corrupt)?;
    Ok(bytemuck::cast_slice(&elements).to_vec())
}

/// Applies a filter to elements of type `T`.
fn filtered<T: Pod>(bytes: &[u8], filter: impl Fn(&mut [T])) -> Vec<u8> {
    let mut elements: Vec<T> = bytemuck::pod_collect_to_vec(bytes);
    filter(&mut elements);
    bytemuck::cast_slice(&elements).to_vec()
}
