//! Vertex attributes as planes of numbers, exact or on a grid of 16 bits.

use glam::Vec3;

use super::octahedron;
use super::planes::{Predict, Rows};
use super::quantize::{Grid, Grids};
use crate::hierarchy::Vertices;

/// Which attributes there are besides positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Attributes {
    pub(super) bits: u8,
}

const NORMALS: u8 = 1;
const UVS: u8 = 2;
const TANGENTS: u8 = 4;
const UVS_1: u8 = 8;
const COLORS: u8 = 16;

impl Attributes {
    pub(super) fn of(vertices: &Vertices) -> Self {
        let there = [
            (NORMALS, !vertices.normals.is_empty()),
            (UVS, !vertices.uvs.is_empty()),
            (TANGENTS, !vertices.tangents.is_empty()),
            (UVS_1, !vertices.uvs_1.is_empty()),
            (COLORS, !vertices.colors.is_empty()),
        ];
        let there = there.into_iter().filter(|&(_, there)| there);
        Self {
            bits: there.map(|(bit, _)| bit).sum(),
        }
    }

    /// `None` for bits that mean nothing.
    pub(super) fn from_bits(bits: u8) -> Option<Self> {
        (bits < COLORS * 2).then_some(Self { bits })
    }

    fn has(self, bit: u8) -> bool {
        self.bits & bit != 0
    }

    /// How the planes are predicted, in their order.
    pub(super) fn predictors(self, quantized: bool) -> Vec<Predict> {
        let (line, mean) = if quantized {
            (Predict::IntParallelogram, Predict::IntMean)
        } else {
            (Predict::FloatParallelogram, Predict::FloatMean)
        };
        let mut all = vec![line; 3];
        if self.has(NORMALS) {
            all.extend(vec![mean; if quantized { 2 } else { 3 }]);
        }
        if self.has(UVS) {
            all.extend([line; 2]);
        }
        if self.has(TANGENTS) {
            all.extend(vec![mean; if quantized { 3 } else { 4 }]);
        }
        if self.has(UVS_1) {
            all.extend([line; 2]);
        }
        if self.has(COLORS) {
            all.extend([mean; 4]);
        }
        all
    }
}

/// The numbers of `vertices`, in their order.
pub(super) fn to_rows(vertices: &Vertices, grids: Option<&Grids>) -> Rows {
    let planes = to_planes(vertices, grids);
    let mut rows = Rows::zeros(planes.len(), vertices.positions.len());
    for (column, plane) in planes.iter().enumerate() {
        rows.set_column(column, plane);
    }
    rows
}

/// The planes of `vertices`, in their order.
fn to_planes(vertices: &Vertices, grids: Option<&Grids>) -> Vec<Vec<u32>> {
    let Vertices {
        positions,
        normals,
        uvs,
        tangents,
        uvs_1,
        colors,
    } = vertices;
    let mut planes = Vec::new();
    // Positions always have their planes, even if there are no vertices.
    planes.resize(3 * usize::from(positions.is_empty()), Vec::new());
    push_vectors(&mut planes, positions, grids.map(|g| g.position));
    push_directions(&mut planes, normals.iter().copied(), grids.is_some());
    push_vectors(&mut planes, uvs, grids.map(|g| g.uv));
    let along = tangents.iter().map(|tangent| tangent.truncate());
    push_directions(&mut planes, along, grids.is_some());
    if !tangents.is_empty() {
        let sides = tangents.iter().map(|tangent| tangent.w);
        planes.push(match grids {
            Some(_) => sides.map(|side| u32::from(side < 0.0)).collect(),
            None => sides.map(f32::to_bits).collect(),
        });
    }
    push_vectors(&mut planes, uvs_1, grids.map(|g| g.uv_1));
    push_vectors(&mut planes, colors, grids.map(|g| g.color));
    planes
}

fn push_vectors<const N: usize, V: Into<[f32; N]> + Copy>(
    planes: &mut Vec<Vec<u32>>,
    vectors: &[V],
    grids: Option<[Grid; N]>,
) {
    for k in 0..N * usize::from(!vectors.is_empty()) {
        let numbers = vectors.iter().map(|&vector| vector.into()[k]);
        planes.push(match grids {
            Some(grids) => numbers.map(|x| grids[k].number(x)).collect(),
            None => numbers.map(f32::to_bits).collect(),
        });
    }
}

fn push_directions(
    planes: &mut Vec<Vec<u32>>,
    directions: impl Iterator<Item = Vec3>,
    quantized: bool,
) {
    let directions: Vec<Vec3> = directions.collect();
    if !quantized {
        return push_vectors(planes, &directions, None::<[Grid; 3]>);
    }
    let numbers: Vec<[u32; 2]> = directions.into_iter().map(octahedron::numbers).collect();
    for k in 0..2 * usize::from(!numbers.is_empty()) {
        planes.push(numbers.iter().map(|pair| pair[k]).collect());
    }
}

/// Undoes [`to_rows`]: the vertices at `places` of the rows.
pub(super) fn from_rows(
    rows: &Rows,
    attributes: Attributes,
    grids: Option<&Grids>,
    places: &[u32],
) -> Vertices {
    let mut taker = Taker {
        rows,
        column: 0,
        places,
    };
    let positions = taker.vectors(true, grids.map(|g| g.position));
    let normals = taker.directions(attributes.has(NORMALS), grids.is_some());
    let uvs = taker.vectors(attributes.has(UVS), grids.map(|g| g.uv));
    let along = taker.directions(attributes.has(TANGENTS), grids.is_some());
    let sides = taker.sides(attributes.has(TANGENTS), grids.is_some());
    let uvs_1 = taker.vectors(attributes.has(UVS_1), grids.map(|g| g.uv_1));
    let colors = taker.vectors(attributes.has(COLORS), grids.map(|g| g.color));
    let tangents = along.into_iter().zip(sides);
    Vertices {
        positions,
        normals,
        uvs,
        tangents: tangents.map(|(along, side)| along.extend(side)).collect(),
        uvs_1,
        colors,
    }
}

/// Takes columns, one after the other.
struct Taker<'a> {
    rows: &'a Rows,
    column: usize,
    places: &'a [u32],
}

impl<'a> Taker<'a> {
    /// The numbers of the next columns.
    fn numbers<const N: usize>(&mut self) -> impl Iterator<Item = [u32; N]> + use<'a, N> {
        let (rows, column) = (self.rows, self.column);
        self.column += N;
        let places = self.places.iter();
        places.map(move |&place| rows.some(place, column))
    }

    fn vectors<const N: usize, V: From<[f32; N]>>(
        &mut self,
        there: bool,
        grids: Option<[Grid; N]>,
    ) -> Vec<V> {
        if !there {
            return Vec::new();
        }
        let numbers = self.numbers();
        // Not `map` on the arrays: it may stay a call.
        match grids {
            None => numbers
                .map(|n: [u32; N]| std::array::from_fn(|k| f32::from_bits(n[k])).into())
                .collect(),
            Some(grids) => numbers
                .map(|n: [u32; N]| std::array::from_fn(|k| grids[k].value(n[k])).into())
                .collect(),
        }
    }

    fn directions(&mut self, there: bool, quantized: bool) -> Vec<Vec3> {
        if !there || !quantized {
            return self.vectors(there, None::<[Grid; 3]>);
        }
        self.numbers().map(octahedron::direction).collect()
    }

    fn sides(&mut self, there: bool, quantized: bool) -> Vec<f32> {
        if !there {
            return Vec::new();
        }
        let numbers = self.numbers();
        if quantized {
            numbers
                .map(|[side]| if side == 0 { 1.0 } else { -1.0 })
                .collect()
        } else {
            numbers.map(|[side]| f32::from_bits(side)).collect()
        }
    }
}
