//! Numbers in buffers. Every range is checked.

use gltf::accessor::sparse::{IndexType, Sparse};
use gltf::accessor::{DataType, Dimensions};
use gltf::{Accessor, buffer::View};

use super::buffers::Buffers;
use super::error::{AccessorFault, PrimitiveFault};
use super::format::{Component, little_endian};
use crate::mesh::MeshError;

/// Largest number of vertices or indices of a mesh.
const MAX_ELEMENTS: usize = u32::MAX as usize / 2;

/// Largest number of elements without a view, which are zero and need no bytes in the file. Otherwise a file of a few
/// bytes could claim gigabytes.
const MAX_ZEROS: usize = 1 << 24;

/// Reads vectors of `N` numbers: the vectors at the ascending indices `only`, or all vectors. Components that the
/// accessor lacks come from `blank`.
///
/// # Panics
/// If the accessor has more than `N` components.
fn read_vectors<const N: usize>(
    accessor: &Accessor<'_>,
    buffers: &Buffers,
    blank: [f32; N],
    only: Option<&[u32]>,
) -> Result<Vec<[f32; N]>, AccessorFault> {
    let components = accessor.dimensions().multiplicity();
    assert!(components <= N, "the format was checked");
    let (component, bytes) = (Component::of(accessor), accessor.data_type().size());
    let decode = |element: &[u8]| {
        let mut vector = blank;
        for (number, bytes) in vector.iter_mut().zip(element.chunks_exact(bytes)) {
            *number = component.number(bytes);
        }
        vector
    };
    // Elements without a view are zero, but components that the accessor lacks keep their blank value.
    let mut zero = blank;
    zero[..components].fill(0.0);
    read_elements(accessor, buffers, zero, only, &decode)
}

/// Reads attributes of a primitive, with one vector for each vertex.
#[derive(Clone, Copy)]
pub(super) struct VertexReader<'a> {
    pub(super) buffers: &'a Buffers,
    pub(super) vertex_count: usize,
    /// Indices of the vertices to read, ascending. All vertices if `None`.
    pub(super) only: Option<&'a [u32]>,
}

impl VertexReader<'_> {
    /// Number of vertices that are read.
    pub(super) fn count(&self) -> usize {
        self.only.map_or(self.vertex_count, <[u32]>::len)
    }

    /// Calls [`read_vectors`]. Faults name the `attribute`.
    pub(super) fn read<const N: usize>(
        &self,
        accessor: &Accessor<'_>,
        blank: [f32; N],
        attribute: &'static str,
    ) -> Result<Vec<[f32; N]>, PrimitiveFault> {
        let (count, vertices) = (accessor.count(), self.vertex_count);
        if count != vertices {
            return Err(PrimitiveFault::Mesh(MeshError::AttributeCount {
                attribute,
                count,
                vertices,
            }));
        }
        let vectors = read_vectors(accessor, self.buffers, blank, self.only);
        vectors.map_err(PrimitiveFault::accessor(attribute))
    }
}

/// Reads numbers of any format and shape, in the order of the elements.
pub(super) fn read_numbers(
    accessor: &Accessor<'_>,
    buffers: &Buffers,
) -> Result<Vec<f32>, AccessorFault> {
    fn all<const N: usize>(a: &Accessor<'_>, b: &Buffers) -> Result<Vec<f32>, AccessorFault> {
        Ok(read_vectors(a, b, [0.0; N], None)?.into_flattened())
    }
    match accessor.dimensions() {
        Dimensions::Scalar => all::<1>(accessor, buffers),
        Dimensions::Vec2 => all::<2>(accessor, buffers),
        Dimensions::Vec3 => all::<3>(accessor, buffers),
        Dimensions::Vec4 | Dimensions::Mat2 => all::<4>(accessor, buffers),
        Dimensions::Mat3 => all::<9>(accessor, buffers),
        Dimensions::Mat4 => all::<16>(accessor, buffers),
    }
}

/// Reads indices of 8, 16 or 32 bits.
pub(super) fn read_indices(
    accessor: &Accessor<'_>,
    buffers: &Buffers,
) -> Result<Vec<u32>, AccessorFault> {
    let unsigned = matches!(
        accessor.data_type(),
        DataType::U8 | DataType::U16 | DataType::U32
    );
    if !unsigned || accessor.dimensions() != Dimensions::Scalar {
        let accessor = accessor.index();
        return Err(AccessorFault::NotIndices { accessor });
    }
    read_elements(accessor, buffers, 0, None, &little_endian)
}

fn read_elements<T: Copy>(
    accessor: &Accessor<'_>,
    buffers: &Buffers,
    zero: T,
    only: Option<&[u32]>,
    decode: &dyn Fn(&[u8]) -> T,
) -> Result<Vec<T>, AccessorFault> {
    let (count, view) = (accessor.count(), accessor.view());
    let most = match view {
        Some(_) => MAX_ELEMENTS,
        None => MAX_ZEROS,
    };
    let range = Range {
        accessor: accessor.index(),
        count,
        element: accessor.size(),
    };
    // The limit is checked before anything is allocated.
    if count > most {
        let accessor = range.accessor;
        return Err(AccessorFault::TooMany { accessor, count });
    }
    let mut values: Vec<T> = match view {
        Some(view) => {
            let element = range.elements(&view, accessor.offset(), buffers)?;
            let decode = |at: usize| decode(element(at));
            match only {
                Some(only) => only.iter().map(|&at| decode(at as usize)).collect(),
                None => (0..count).map(decode).collect(),
            }
        }
        None => vec![zero; only.map_or(count, <[u32]>::len)],
    };
    if let Some(sparse) = accessor.sparse() {
        replace_sparse(&mut values, &sparse, range, buffers, only, decode)?;
    }
    Ok(values)
}

/// Overwrites the elements that a sparse accessor lists.
fn replace_sparse<T>(
    values: &mut [T],
    sparse: &Sparse<'_>,
    range: Range,
    buffers: &Buffers,
    only: Option<&[u32]>,
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
    let place = place_range.elements(&places.view(), places.offset(), buffers)?;
    let value_range = Range { count, ..range };
    let value = value_range.elements(&replaced.view(), replaced.offset(), buffers)?;
    for at in 0..count {
        let place = little_endian(place(at));
        if place as usize >= range.count {
            return Err(range.out_of_bounds());
        }
        // Values that are not read have no slot. `only` is sorted.
        let slot = match only {
            Some(only) => only.binary_search(&place).ok(),
            None => Some(place as usize),
        };
        if let Some(slot) = slot {
            values[slot] = decode(value(at));
        }
    }
    Ok(())
}

/// The elements that an accessor reads from a view: their number, and bytes of each.
#[derive(Clone, Copy)]
struct Range {
    accessor: usize,
    count: usize,
    element: usize,
}

impl Range {
    /// The bytes of each element, by its index.
    fn elements<'a>(
        self,
        view: &View<'_>,
        offset_in_view: usize,
        buffers: &'a Buffers,
    ) -> Result<impl Fn(usize) -> &'a [u8] + use<'a>, AccessorFault> {
        let (accessor, element) = (self.accessor, self.element);
        let stride = view.stride().unwrap_or(element);
        if stride < element {
            return Err(AccessorFault::Stride {
                accessor,
                stride,
                element,
            });
        }
        // The last element may end before its stride does.
        let end = |count: usize| (count - 1).checked_mul(stride)?.checked_add(element);
        let length = if self.count > 0 {
            end(self.count)
        } else {
            Some(0)
        };
        let bytes = buffers.view(view).and_then(|bytes| {
            let end = offset_in_view.checked_add(length?)?;
            bytes.get(offset_in_view..end)
        });
        let bytes = bytes.ok_or_else(|| self.out_of_bounds())?;
        Ok(move |index| &bytes[index * stride..index * stride + element])
    }

    fn out_of_bounds(self) -> AccessorFault {
        AccessorFault::OutOfBounds {
            accessor: self.accessor,
        }
    }
}
