//! Buffer views packed by `EXT_meshopt_compression` or its successor `KHR_meshopt_compression`.
//! meshoptimizer decodes them; all that it takes on trust is checked before.
//!
//! Numbers are taken as they lie in memory: little-endian, as glTF has them and as `fieldlod_hierarchy`
//! demands of the machine.

use bytemuck::Pod;
use gltf::buffer::View;
use gltf::json::Value;
use thiserror::Error;

/// The names under which a view may be packed.
pub(super) const EXTENSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// How many bytes all packed views of a file together may stand for. A packed byte can stand for
/// many, but a few kilobytes must not claim gigabytes.
pub(super) fn allowance(buffers: &[Vec<u8>]) -> usize {
    let bytes: usize = buffers.iter().map(Vec::len).sum();
    bytes.saturating_mul(1 << 10).saturating_add(1 << 24)
}

/// Why a packed buffer view cannot be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum PackedViewFault {
    /// A property is missing or out of the range that the extension allows.
    #[error("its {property} is missing or out of range")]
    Property { property: &'static str },
    /// The packed bytes are not all there.
    #[error("its packed bytes lie outside buffer {buffer}")]
    OutOfBounds { buffer: usize },
    /// The bytes do not unpack.
    #[error("its packed bytes are corrupt")]
    Corrupt,
}

use PackedViewFault as Fault;

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, PartialEq)]
enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// The extension object of a view.
struct Packed<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
    mode: Mode,
    filter: Filter,
}

/// The extension object of `view`; `None` if it is not packed.
pub(super) fn object_of<'a>(view: &'a View<'_>) -> Option<&'a Value> {
    let extensions = view.extensions()?;
    EXTENSIONS.iter().find_map(|&name| extensions.get(name))
}

/// The bytes that a view with this extension object stands for, at most `most`.
pub(super) fn unpack(
    object: &Value,
    buffers: &[Vec<u8>],
    most: usize,
) -> Result<Vec<u8>, PackedViewFault> {
    Packed::read(object, buffers, most)?.unpack()
}

fn number(object: &Value, property: &'static str) -> Result<usize, Fault> {
    let value = object.get(property).and_then(Value::as_u64);
    value
        .and_then(|value| usize::try_from(value).ok())
        .ok_or(Fault::Property { property })
}

impl<'a> Packed<'a> {
    fn read(object: &Value, buffers: &'a [Vec<u8>], most: usize) -> Result<Self, Fault> {
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
            mode: mode(object)?,
            filter: filter(object)?,
        };
        packed.check(most).map(|()| packed)
    }

    /// The ranges that the extension states, and a limit to what few bytes can claim.
    fn check(&self, most: usize) -> Result<(), Fault> {
        let stride_fits = match self.mode {
            Mode::Attributes => (1..=256).contains(&self.stride) && self.stride.is_multiple_of(4),
            Mode::Triangles | Mode::Indices => self.stride == 2 || self.stride == 4,
        };
        let filter_fits = match self.filter {
            Filter::None => true,
            _ if self.mode != Mode::Attributes => false,
            Filter::Octahedral | Filter::Color => self.stride == 4 || self.stride == 8,
            Filter::Quaternion => self.stride == 8,
            Filter::Exponential => true,
        };
        let unpacked_bytes = self.count.checked_mul(self.stride.max(1));
        let count_fits = unpacked_bytes.is_some_and(|bytes| bytes <= most)
            && (self.mode != Mode::Triangles || self.count.is_multiple_of(3));
        let checks = [
            ("byteStride", stride_fits),
            ("filter", filter_fits),
            ("count", count_fits),
        ];
        match checks.into_iter().find(|(_, fits)| !fits) {
            Some((property, _)) => Err(Fault::Property { property }),
            None => Ok(()),
        }
    }

    fn unpack(&self) -> Result<Vec<u8>, Fault> {
        if self.count == 0 {
            return Ok(Vec::new());
        }
        let (bytes, count) = (self.bytes, self.count);
        match (self.mode, self.stride) {
            (Mode::Attributes, _) => self.unpack_attributes(),
            (Mode::Triangles, 2) => bytes_of(meshopt::decode_index_buffer::<u16>(bytes, count)),
            (Mode::Triangles, _) => bytes_of(meshopt::decode_index_buffer::<u32>(bytes, count)),
            (Mode::Indices, 2) => bytes_of(meshopt::decode_index_sequence::<u16>(bytes, count)),
            (Mode::Indices, _) => bytes_of(meshopt::decode_index_sequence::<u32>(bytes, count)),
        }
    }

    fn unpack_attributes(&self) -> Result<Vec<u8>, Fault> {
        let elements = self.elements()?;
        Ok(match (self.filter, self.stride) {
            (Filter::None, _) => elements,
            (Filter::Octahedral, 4) => filtered(&elements, meshopt::decode_filter_oct::<i8>),
            (Filter::Octahedral, _) => filtered(&elements, meshopt::decode_filter_oct::<i16>),
            (Filter::Color, 4) => filtered(&elements, meshopt::decode_filter_color::<i8>),
            (Filter::Color, _) => filtered(&elements, meshopt::decode_filter_color::<i16>),
            (Filter::Quaternion, _) => filtered(&elements, meshopt::decode_filter_quat),
            (Filter::Exponential, _) => filtered(&elements, meshopt::decode_filter_exp::<1>),
        })
    }

    /// The elements as they were packed, one after the other.
    fn elements(&self) -> Result<Vec<u8>, Fault> {
        // The size of an element is part of its type.
        macro_rules! for_stride {
            ($($words:literal)*) => {
                match self.stride / 4 {
                    $($words => self.elements_of::<[u32; $words]>(),)*
                    _ => Err(Fault::Property { property: "byteStride" }),
                }
            };
        }
        for_stride!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29
            30 31 32)
    }

    fn elements_of<T: Pod + Default>(&self) -> Result<Vec<u8>, Fault> {
        bytes_of(meshopt::decode_vertex_buffer::<T>(self.bytes, self.count))
    }
}

/// The bytes of elements that were decoded.
fn bytes_of<T: Pod>(decoded: meshopt::Result<Vec<T>>) -> Result<Vec<u8>, Fault> {
    let elements = decoded.map_err(|_| Fault::Corrupt)?;
    Ok(bytemuck::cast_slice(&elements).to_vec())
}

/// Elements of so many components, through a filter.
fn filtered<T: Pod>(bytes: &[u8], filter: impl Fn(&mut [T])) -> Vec<u8> {
    let mut elements: Vec<T> = bytemuck::pod_collect_to_vec(bytes);
    filter(&mut elements);
    bytemuck::cast_slice(&elements).to_vec()
}

fn mode(object: &Value) -> Result<Mode, Fault> {
    match object.get("mode").and_then(Value::as_str) {
        Some("ATTRIBUTES") => Ok(Mode::Attributes),
        Some("TRIANGLES") => Ok(Mode::Triangles),
        Some("INDICES") => Ok(Mode::Indices),
        _ => Err(Fault::Property { property: "mode" }),
    }
}

fn filter(object: &Value) -> Result<Filter, Fault> {
    match object.get("filter").map(|name| name.as_str()) {
        None | Some(Some("NONE")) => Ok(Filter::None),
        Some(Some("OCTAHEDRAL")) => Ok(Filter::Octahedral),
        Some(Some("QUATERNION")) => Ok(Filter::Quaternion),
        Some(Some("EXPONENTIAL")) => Ok(Filter::Exponential),
        Some(Some("COLOR")) => Ok(Filter::Color),
        _ => Err(Fault::Property { property: "filter" }),
    }
}
