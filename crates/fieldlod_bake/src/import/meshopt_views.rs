//! Buffer views packed by `EXT_meshopt_compression` or its successor `KHR_meshopt_compression`.
//! meshoptimizer decodes them; all that it takes on trust is checked before.

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
        let bytes = buffers.get(buffer).zip(end);
        let bytes = bytes.and_then(|(bytes, end)| bytes.get(start..end));
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
        let count_fits = self.count.checked_mul(self.stride.max(1));
        let count_fits = count_fits.is_some_and(|bytes| bytes <= most)
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
        let unpacked = match (self.mode, self.stride) {
            (Mode::Attributes, _) => return self.unpack_attributes(),
            (Mode::Triangles, 2) => meshopt::decode_index_buffer::<u16>(self.bytes, self.count)
                .map(|indices| bytes_of(&indices, u16::to_le_bytes)),
            (Mode::Triangles, _) => meshopt::decode_index_buffer::<u32>(self.bytes, self.count)
                .map(|indices| bytes_of(&indices, u32::to_le_bytes)),
            (Mode::Indices, 2) => meshopt::decode_index_sequence::<u16>(self.bytes, self.count)
                .map(|indices| bytes_of(&indices, u16::to_le_bytes)),
            (Mode::Indices, _) => meshopt::decode_index_sequence::<u32>(self.bytes, self.count)
                .map(|indices| bytes_of(&indices, u32::to_le_bytes)),
        };
        unpacked.map_err(|_| Fault::Corrupt)
    }

    fn unpack_attributes(&self) -> Result<Vec<u8>, Fault> {
        match (self.filter, self.stride) {
            (Filter::Octahedral, 4) => self.filtered(meshopt::decode_filter_oct::<i8>, to_i8),
            (Filter::Octahedral, _) => self.filtered(meshopt::decode_filter_oct::<i16>, to_i16),
            (Filter::Color, 4) => self.filtered(meshopt::decode_filter_color::<i8>, to_i8),
            (Filter::Color, _) => self.filtered(meshopt::decode_filter_color::<i16>, to_i16),
            (Filter::Quaternion, _) => self.filtered(meshopt::decode_filter_quat, to_i16),
            (Filter::Exponential, _) => {
                let mut bytes = self.elements()?;
                let (words, _) = bytes.as_chunks_mut::<4>();
                let mut numbers: Vec<[u32; 1]> = words
                    .iter()
                    .map(|word| [u32::from_le_bytes(*word)])
                    .collect();
                meshopt::decode_filter_exp(&mut numbers);
                for (word, [number]) in words.iter_mut().zip(numbers) {
                    *word = number.to_le_bytes();
                }
                Ok(bytes)
            }
            (Filter::None, _) => self.elements(),
        }
    }

    /// Elements of four components, through a filter.
    fn filtered<C: Component>(
        &self,
        filter: impl Fn(&mut [[C; 4]]),
        component: impl Fn(&[u8]) -> C,
    ) -> Result<Vec<u8>, Fault> {
        let bytes = self.elements()?;
        let size = size_of::<C>();
        let elements = bytes.chunks_exact(size * 4);
        let mut elements: Vec<[C; 4]> = elements
            .map(|element| std::array::from_fn(|k| component(&element[k * size..][..size])))
            .collect();
        filter(&mut elements);
        Ok(elements.iter().flatten().flat_map(|c| c.bytes()).collect())
    }

    /// The elements as they were packed, one after the other.
    fn elements(&self) -> Result<Vec<u8>, Fault> {
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

    fn elements_of<T: Element>(&self) -> Result<Vec<u8>, Fault> {
        let elements = meshopt::decode_vertex_buffer::<T>(self.bytes, self.count);
        let elements = elements.map_err(|_| Fault::Corrupt)?;
        let words = elements.iter().flat_map(Element::words);
        Ok(words.flat_map(|word| word.to_ne_bytes()).collect())
    }
}

/// An element of a vertex buffer: its size is the stride.
trait Element: Clone + Default {
    fn words(&self) -> &[u32];
}

impl<const N: usize> Element for [u32; N]
where
    [u32; N]: Default,
{
    fn words(&self) -> &[u32] {
        self
    }
}

trait Component: Copy {
    fn bytes(self) -> Vec<u8>;
}

impl Component for i8 {
    fn bytes(self) -> Vec<u8> {
        self.to_le_bytes().to_vec()
    }
}

impl Component for i16 {
    fn bytes(self) -> Vec<u8> {
        self.to_le_bytes().to_vec()
    }
}

fn to_i8(bytes: &[u8]) -> i8 {
    i8::from_le_bytes([bytes[0]])
}

fn to_i16(bytes: &[u8]) -> i16 {
    i16::from_le_bytes([bytes[0], bytes[1]])
}

fn bytes_of<T: Copy, const N: usize>(values: &[T], bytes: impl Fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|&value| bytes(value)).collect()
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
