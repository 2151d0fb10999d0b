//! Numbers out of buffers, every range checked.

use gltf::accessor::sparse::{IndexType, Sparse};
use gltf::accessor::{DataType, Dimensions};
use gltf::{Accessor, buffer::View};
use thiserror::Error;

/// Why an accessor cannot be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum AccessorFault {
    /// It ends outside its buffer view, or the view outside its buffer.
    #[error("accessor {accessor} reads outside its buffer")]
    OutOfBounds { accessor: usize },
    /// Elements overlap.
    #[error("accessor {accessor} has a stride of {stride} for elements of {element} bytes")]
    Stride {
        accessor: usize,
        stride: usize,
        element: usize,
    },
    /// More elements than can be counted.
    #[error("accessor {accessor} has {count} elements, too many")]
    TooMany { accessor: usize, count: usize },
    /// Indices that are not unsigned scalars.
    #[error("accessor {accessor} does not hold indices")]
    NotIndices { accessor: usize },
}

// As many as a mesh may have vertices or indices.
const MAX_ELEMENTS: usize = u32::MAX as usize / 2;

// Elements that are zero without taking room in the file: a few bytes must not claim gigabytes.
const MAX_ZEROS: usize = 1 << 24;

/// Whether `accessor` holds `dimensions` of plain 32-bit floating-point numbers.
pub(super) fn is_float(accessor: &Accessor<'_>, dimensions: Dimensions) -> bool {
    accessor.data_type() == DataType::F32
        && accessor.dimensions() == dimensions
        && !accessor.normalized()
}

/// Reads vectors of `N` 32-bit floating-point numbers.
pub(super) fn read_floats<const N: usize>(
    accessor: &Accessor<'_>,
    buffers: &[Vec<u8>],
) -> Result<Vec<[f32; N]>, AccessorFault> {
    let decode = |bytes: &[u8]| {
        std::array::from_fn(|k| f32::from_bits(little_endian(&bytes[k * 4..k * 4 + 4])))
    };
    read_elements(accessor, buffers, [0.0; N], &decode)
}

/// Reads texture coordinates: floating-point, or bytes and shorts that stand for 0 to 1. `None`
/// for other formats.
pub(super) fn read_uvs(
    accessor: &Accessor<'_>,
    buffers: &[Vec<u8>],
) -> Result<Option<Vec<[f32; 2]>>, AccessorFault> {
    if is_float(accessor, Dimensions::Vec2) {
        return read_floats(accessor, buffers).map(Some);
    }
    let (bytes, largest) = match (accessor.data_type(), accessor.dimensions()) {
        (DataType::U8, Dimensions::Vec2) => (1, 255.0),
        (DataType::U16, Dimensions::Vec2) => (2, 65_535.0),
        _ => return Ok(None),
    };
    if !accessor.normalized() {
        return Ok(None);
    }
    let share = |bytes: &[u8]| little_endian(bytes) as f32 / largest;
    let decode = |element: &[u8]| [share(&element[..bytes]), share(&element[bytes..bytes * 2])];
    read_elements(accessor, buffers, [0.0; 2], &decode).map(Some)
}

/// Reads indices of 8, 16 or 32 bits.
pub(super) fn read_indices(
    accessor: &Accessor<'_>,
    buffers: &[Vec<u8>],
) -> Result<Vec<u32>, AccessorFault> {
    let unsigned = matches!(
        accessor.data_type(),
        DataType::U8 | DataType::U16 | DataType::U32
    );
    if !unsigned || accessor.dimensions() != Dimensions::Scalar {
        let accessor = accessor.index();
        return Err(AccessorFault::NotIndices { accessor });
    }
    read_elements(accessor, buffers, 0, &little_endian)
}

/// The number in up to four bytes.
fn little_endian(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |value, &byte| value << 8 | u32::from(byte))
}

fn read_elements<T: Copy>(
    accessor: &Accessor<'_>,
    buffers: &[Vec<u8>],
    zero: T,
    decode: &dyn Fn(&[u8]) -> T,
) -> Result<Vec<T>, AccessorFault> {
    let (count, view) = (accessor.count(), accessor.view());
    let limit = if view.is_some() {
        MAX_ELEMENTS
    } else {
        MAX_ZEROS
    };
    if count > limit {
        let accessor = accessor.index();
        return Err(AccessorFault::TooMany { accessor, count });
    }
    let range = Range {
        accessor: accessor.index(),
        count,
        element: accessor.size(),
    };
    let mut values: Vec<T> = match view {
        Some(view) => {
            let elements = range.slices(&view, accessor.offset(), buffers)?;
            elements.map(decode).collect()
        }
        None => vec![zero; count],
    };
    if let Some(sparse) = accessor.sparse() {
        replace_sparse(&mut values, &sparse, range, buffers, decode)?;
    }
    Ok(values)
}

/// Overwrites the elements that a sparse accessor lists.
fn replace_sparse<T>(
    values: &mut [T],
    sparse: &Sparse<'_>,
    range: Range,
    buffers: &[Vec<u8>],
    decode: &dyn Fn(&[u8]) -> T,
) -> Result<(), AccessorFault> {
    let (places, replaced) = (sparse.indices(), sparse.values());
    let count = sparse.count();
    let element = match places.index_type() {
        IndexType::U8 => 1,
        IndexType::U16 => 2,
        IndexType::U32 => 4,
    };
    let place_range = Range {
        count,
        element,
        ..range
    };
    let place_bytes = place_range.slices(&places.view(), places.offset(), buffers)?;
    let value_range = Range { count, ..range };
    let value_bytes = value_range.slices(&replaced.view(), replaced.offset(), buffers)?;
    for (place, value) in place_bytes.zip(value_bytes) {
        let slot = values.get_mut(little_endian(place) as usize);
        *slot.ok_or_else(|| range.out_of_bounds())? = decode(value);
    }
    Ok(())
}

/// How many elements of how many bytes an accessor reads from some view.
#[derive(Clone, Copy)]
struct Range {
    accessor: usize,
    count: usize,
    element: usize,
}

impl Range {
    /// The bytes of each element.
    fn slices<'a>(
        self,
        view: &View<'_>,
        offset_in_view: usize,
        buffers: &'a [Vec<u8>],
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, AccessorFault> {
        let Self {
            accessor,
            count,
            element,
        } = self;
        let stride = view.stride().unwrap_or(element);
        if stride < element {
            return Err(AccessorFault::Stride {
                accessor,
                stride,
                element,
            });
        }
        let bytes = self
            .bytes(view, offset_in_view, stride, buffers)
            .ok_or_else(|| self.out_of_bounds())?;
        Ok((0..count).map(move |index| &bytes[index * stride..index * stride + element]))
    }

    fn out_of_bounds(self) -> AccessorFault {
        AccessorFault::OutOfBounds {
            accessor: self.accessor,
        }
    }

    /// The bytes from the first element to the last; `None` if they are not all there.
    fn bytes<'a>(
        self,
        view: &View<'_>,
        offset_in_view: usize,
        stride: usize,
        buffers: &'a [Vec<u8>],
    ) -> Option<&'a [u8]> {
        let buffer = buffers.get(view.buffer().index())?;
        let view_end = view.offset().checked_add(view.length())?;
        let view_bytes = buffer.get(view.offset()..view_end)?;
        let length = match self.count.checked_sub(1) {
            Some(before_last) => before_last.checked_mul(stride)?.checked_add(self.element)?,
            None => 0,
        };
        view_bytes.get(offset_in_view..offset_in_view.checked_add(length)?)
    }
}
