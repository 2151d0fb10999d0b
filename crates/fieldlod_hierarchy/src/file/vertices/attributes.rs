//! Converts vertex attributes to columns of numbers, exact or quantized.

use glam::Vec3;

use crate::file::vertices::attribute_columns::Columns;
use crate::file::vertices::octahedron;
use crate::file::vertices::planes::Plane;
use crate::file::vertices::quantize::{Grid, Grids};
use crate::vertices::Vertices;

/// The set of attributes besides positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Attributes {
    pub(crate) bits: u8,
}

const NORMALS: u8 = 1;
const UVS: u8 = 2;
const TANGENTS: u8 = 4;
const UVS_1: u8 = 8;
const COLORS: u8 = 16;

impl Attributes {
    pub(crate) fn of(vertices: &Vertices) -> Self {
        let bit = |bit: u8, is_present: bool| if is_present { bit } else { 0 };
        Self {
            bits: bit(NORMALS, !vertices.normals.is_empty())
                | bit(UVS, !vertices.uvs.is_empty())
                | bit(TANGENTS, !vertices.tangents.is_empty())
                | bit(UVS_1, !vertices.uvs_1.is_empty())
                | bit(COLORS, !vertices.colors.is_empty()),
        }
    }

    /// Returns `None` if unknown bits are set.
    pub(crate) fn from_bits(bits: u8) -> Option<Self> {
        (bits < COLORS * 2).then_some(Self { bits })
    }

    fn has(self, bit: u8) -> bool {
        self.bits & bit != 0
    }

    /// How each column is written.
    pub(crate) fn planes(self, is_quantized: bool) -> Vec<Plane> {
        use Plane::{Floats, Integers, ThirdOfUnit};
        // A direction has two octahedral coordinates if quantized, otherwise three exact ones.
        let (number, direction) = if is_quantized {
            (Integers, &[Integers; 2][..])
        } else {
            (Floats, &[Floats, Floats, ThirdOfUnit][..])
        };
        let attributes = [
            (true, &[number; 3][..]),
            (self.has(NORMALS), direction),
            (self.has(UVS), &[number; 2]),
            (self.has(TANGENTS), direction),
            (self.has(TANGENTS), &[number]),
            (self.has(UVS_1), &[number; 2]),
            (self.has(COLORS), &[number; 4]),
        ];
        let present = attributes.into_iter().filter(|(is_present, _)| *is_present);
        present.flat_map(|(_, planes)| planes).copied().collect()
    }
}

/// Converts the attributes of vertices to columns.
pub(crate) fn to_columns(vertices: &Vertices, grids: Option<&Grids>) -> Columns {
    let is_quantized = grids.is_some();
    if vertices.positions.is_empty() {
        return Columns::new(Attributes::of(vertices).planes(is_quantized).len());
    }
    let mut columns = Columns::default();
    push_vectors(&mut columns, &vertices.positions, grids.map(|g| g.position));
    push_directions(&mut columns, &vertices.normals, is_quantized);
    push_vectors(&mut columns, &vertices.uvs, grids.map(|g| g.uv));
    let tangents = vertices.tangents.iter();
    let directions: Vec<Vec3> = tangents.clone().map(|t| t.truncate()).collect();
    push_directions(&mut columns, &directions, is_quantized);
    if is_quantized {
        push_column(&mut columns, tangents.map(|t| u32::from(t.w < 0.0)));
    } else {
        push_column(&mut columns, tangents.map(|t| t.w.to_bits()));
    }
    push_vectors(&mut columns, &vertices.uvs_1, grids.map(|g| g.uv_1));
    push_vectors(&mut columns, &vertices.colors, grids.map(|g| g.color));
    columns
}

/// Appends a column, unless the attribute is missing.
fn push_column(columns: &mut Columns, numbers: impl ExactSizeIterator<Item = u32>) {
    if numbers.len() > 0 {
        columns.columns.push(numbers.collect());
    }
}

/// Appends a column for each coordinate: its bits, or its steps on `grids`.
fn push_vectors<const N: usize, V: Into<[f32; N]> + Copy>(
    columns: &mut Columns,
    vectors: &[V],
    grids: Option<[Grid; N]>,
) {
    for k in 0..N {
        let coordinates = vectors.iter().map(|&vector| vector.into()[k]);
        match grids {
            Some(grids) => push_column(columns, coordinates.map(|x| grids[k].number(x))),
            None => push_column(columns, coordinates.map(f32::to_bits)),
        }
    }
}

fn push_directions(columns: &mut Columns, directions: &[Vec3], is_quantized: bool) {
    if !is_quantized {
        push_vectors(columns, directions, None::<[Grid; 3]>);
        return;
    }
    let numbers: Vec<[u32; 2]> = directions
        .iter()
        .copied()
        .map(octahedron::numbers)
        .collect();
    for k in 0..2 {
        push_column(columns, numbers.iter().map(|numbers| numbers[k]));
    }
}

/// Inverse of [`to_columns`]. Vertex `i` has the numbers at `indices[i]`.
pub(crate) fn from_columns(
    columns: &Columns,
    attributes: Attributes,
    grids: Option<&Grids>,
    indices: &[u32],
) -> Vertices {
    let mut columns = ColumnReader {
        columns: columns.columns.iter(),
        indices,
    };
    let positions = columns.vectors(true, grids.map(|g| g.position));
    let normals = columns.directions(attributes.has(NORMALS), grids.is_some());
    let uvs = columns.vectors(attributes.has(UVS), grids.map(|g| g.uv));
    let directions = columns.directions(attributes.has(TANGENTS), grids.is_some());
    let signs = columns.signs(attributes.has(TANGENTS), grids.is_some());
    let uvs_1 = columns.vectors(attributes.has(UVS_1), grids.map(|g| g.uv_1));
    let colors = columns.vectors(attributes.has(COLORS), grids.map(|g| g.color));
    let tangents = directions.into_iter().zip(signs);
    Vertices {
        positions,
        normals,
        uvs,
        tangents: tangents.map(|(t, sign)| t.extend(sign)).collect(),
        uvs_1,
        colors,
    }
}

/// Reads columns in order.
struct ColumnReader<'a> {
    columns: std::slice::Iter<'a, Vec<u32>>,
    indices: &'a [u32],
}

impl<'a> ColumnReader<'a> {
    /// The next `N` columns.
    fn numbers<const N: usize>(&mut self) -> impl Iterator<Item = [u32; N]> + use<'a, N> {
        let mut next = || self.columns.next().expect("there is a column");
        let columns: [&Vec<u32>; N] = std::array::from_fn(|_| next());
        let indices = self.indices.iter();
        // Array `map` is not always inlined.
        indices.map(move |&index| std::array::from_fn(|k| columns[k][index as usize]))
    }

    fn vectors<const N: usize, V: From<[f32; N]>>(
        &mut self,
        is_present: bool,
        grids: Option<[Grid; N]>,
    ) -> Vec<V> {
        if !is_present {
            return Vec::new();
        }
        let numbers = self.numbers();
        // Array `map` is not always inlined.
        match grids {
            None => numbers
                .map(|n: [u32; N]| std::array::from_fn(|k| f32::from_bits(n[k])).into())
                .collect(),
            Some(grids) => numbers
                .map(|n: [u32; N]| std::array::from_fn(|k| grids[k].value(n[k])).into())
                .collect(),
        }
    }

    fn directions(&mut self, is_present: bool, quantized: bool) -> Vec<Vec3> {
        if !is_present || !quantized {
            return self.vectors(is_present, None::<[Grid; 3]>);
        }
        self.numbers().map(octahedron::direction).collect()
    }

    fn signs(&mut self, is_present: bool, quantized: bool) -> Vec<f32> {
        if !is_present {
            return Vec::new();
        }
        let numbers = self.numbers();
        if quantized {
            numbers
                .map(|[sign]| if sign == 0 { 1.0 } else { -1.0 })
                .collect()
        } else {
            numbers.map(|[sign]| f32::from_bits(sign)).collect()
        }
    }
}
