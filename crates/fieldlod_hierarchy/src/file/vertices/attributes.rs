//! Converts vertex attributes to rows of numbers, exact or quantized.

use glam::Vec3;

use crate::file::sections::coded::{Coded, Ends};
use crate::file::vertices::octahedron;
use crate::file::vertices::predict::Predict;
use crate::file::vertices::quantize::{Grid, Grids};
use crate::file::vertices::rows::{Prediction, Rows};
use crate::file::vertices::vertex_normals::vertex_normals;
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

    /// The predictor of each column.
    pub(crate) fn predictors(self, quantized: bool) -> Vec<Predict> {
        let (line, mean) = if quantized {
            (Predict::IntParallelogram, Predict::IntMean)
        } else {
            (Predict::FloatParallelogram, Predict::FloatMean)
        };
        // A direction has two octahedral coordinates if quantized, otherwise three exact ones.
        let (direction, normal, columns) = if quantized {
            (Predict::IntMean, Predict::IntNormal, 2)
        } else {
            (Predict::FloatDirection, Predict::FloatNormal, 3)
        };
        let of = |attribute, predict, columns: usize| {
            let columns = if self.has(attribute) { columns } else { 0 };
            std::iter::repeat_n(predict, columns)
        };
        // Positions come first, because normals are predicted from them.
        let positions = std::iter::repeat_n(line, 3);
        let all = positions
            .chain(of(NORMALS, normal, columns))
            .chain(of(UVS, line, 2))
            .chain(of(TANGENTS, direction, columns))
            .chain(of(TANGENTS, mean, 1))
            .chain(of(UVS_1, line, 2))
            .chain(of(COLORS, mean, 4));
        all.collect()
    }
}

/// Converts each vertex to a row.
pub(crate) fn to_rows(vertices: &Vertices, grids: Option<&Grids>) -> Rows {
    let width = Attributes::of(vertices).predictors(grids.is_some()).len();
    let mut rows = Rows::zeros(width, 0);
    let mut row = Vec::with_capacity(width);
    let is_quantized = grids.is_some();
    for vertex in 0..vertices.positions.len() {
        row.clear();
        push_vector(
            &mut row,
            vertices.positions.get(vertex),
            grids.map(|g| g.position),
        );
        push_direction(
            &mut row,
            vertices.normals.get(vertex).copied(),
            is_quantized,
        );
        push_vector(&mut row, vertices.uvs.get(vertex), grids.map(|g| g.uv));
        let tangent = vertices.tangents.get(vertex);
        push_direction(&mut row, tangent.map(|t| t.truncate()), is_quantized);
        row.extend(tangent.map(|t| {
            if is_quantized {
                u32::from(t.w < 0.0)
            } else {
                t.w.to_bits()
            }
        }));
        push_vector(&mut row, vertices.uvs_1.get(vertex), grids.map(|g| g.uv_1));
        push_vector(
            &mut row,
            vertices.colors.get(vertex),
            grids.map(|g| g.color),
        );
        rows.push(&row);
    }
    rows
}

/// Appends the coordinates of a vector, if it exists: their bits, or their steps on `grids`.
fn push_vector<const N: usize, V: Into<[f32; N]> + Copy>(
    row: &mut Vec<u32>,
    vector: Option<&V>,
    grids: Option<[Grid; N]>,
) {
    let Some(&vector) = vector else { return };
    let numbers = vector.into().into_iter().enumerate();
    row.extend(numbers.map(|(k, number)| match &grids {
        Some(grids) => grids[k].number(number),
        None => number.to_bits(),
    }));
}

fn push_direction(row: &mut Vec<u32>, direction: Option<Vec3>, is_quantized: bool) {
    match direction {
        Some(direction) if is_quantized => row.extend(octahedron::numbers(direction)),
        _ => push_vector(row, direction.as_ref(), None::<[Grid; 3]>),
    }
}

/// Inverse of [`to_rows`]. Vertex `i` has the row `indices[i]`.
pub(crate) fn from_rows(
    rows: &Rows,
    attributes: Attributes,
    grids: Option<&Grids>,
    indices: &[u32],
) -> Vertices {
    let mut columns = Columns {
        rows,
        column: 0,
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
struct Columns<'a> {
    rows: &'a Rows,
    column: usize,
    indices: &'a [u32],
}

impl<'a> Columns<'a> {
    /// The next `N` columns.
    fn numbers<const N: usize>(&mut self) -> impl Iterator<Item = [u32; N]> + use<'a, N> {
        let (rows, column) = (self.rows, self.column);
        self.column += N;
        let indices = self.indices.iter();
        indices.map(move |&index| rows.some(index, column))
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

/// Predicts the normals of the targets of `predictions` from the triangles that were added after
/// `from`. `rows` holds the positions.
pub(crate) fn predicted_normals(
    coded: &Coded,
    from: Ends,
    rows: &Rows,
    grids: Option<&Grids>,
    predictions: &[Prediction],
) -> Vec<[u32; 3]> {
    let position = |vertex: u32| {
        let numbers = rows.some::<3>(vertex + 1, 0);
        Vec3::from_array(match grids {
            Some(grids) => std::array::from_fn(|k| grids.position[k].value(numbers[k])),
            None => numbers.map(f32::from_bits),
        })
    };
    let normals = vertex_normals(coded, from, position);
    let numbers_of = |p: &Prediction| {
        let normal = normals[p.target as usize - 1 - from.vertices];
        match octahedron::numbers(normal) {
            [x, y] if grids.is_some() => [x, y, 0],
            _ => normal.to_array().map(f32::to_bits),
        }
    };
    predictions.iter().map(numbers_of).collect()
}
