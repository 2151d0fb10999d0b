//! Quantization of vertex attributes to 16 bits.

use bytemuck::{Pod, Zeroable};

use crate::bounds::Aabb;
use crate::hierarchy::Hierarchy;
use crate::vertices::Vertices;

/// Precision of vertex attributes in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Exact.
    #[default]
    Lossless,
    /// Positions, texture coordinates and colours have 65536 values per axis of their extent. Normals and
    /// tangents differ by at most 0.125°. Spheres, boxes and deviations contain the rounding.
    Quantized16,
}

/// 65536 equally spaced values, starting at `min`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Grid {
    min: f64,
    step: f64,
}

impl Grid {
    const LAST: u32 = u16::MAX as u32;

    fn around(values: impl Iterator<Item = f32>) -> Self {
        let ends = (f32::INFINITY, f32::NEG_INFINITY);
        let finite = values.filter(|value| value.is_finite());
        let (min, max) = finite.fold(ends, |(min, max), x| (min.min(x), max.max(x)));
        if min > max {
            return Self::default();
        }
        // In `f64`, because the difference of two large values may exceed the range of `f32`.
        let (min, max) = (f64::from(min), f64::from(max));
        let step = (max - min) / f64::from(Self::LAST);
        Self { min, step }
    }

    /// Returns `true` if all values are finite.
    pub(crate) fn is_usable(self) -> bool {
        // All values lie between the first and the last.
        let end = self.min + self.step * f64::from(Self::LAST);
        self.step >= 0.0 && (self.min as f32).is_finite() && (end as f32).is_finite()
    }

    pub(crate) fn number(self, value: f32) -> u32 {
        if self.step > 0.0 {
            let steps = (f64::from(value) - self.min) / self.step;
            (steps.round() as u32).min(Self::LAST)
        } else {
            0
        }
    }

    pub(crate) fn value(self, number: u32) -> f32 {
        (self.min + self.step * f64::from(number.min(Self::LAST))) as f32
    }
}

/// The grids of all attributes except directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Grids {
    pub(crate) position: [Grid; 3],
    pub(crate) uv: [Grid; 2],
    pub(crate) uv_1: [Grid; 2],
    pub(crate) color: [Grid; 4],
}

impl Grids {
    /// Grids over the extent of `vertices`. Positions are rounded to a grid over `position_box`, if there is one.
    pub(crate) fn around(vertices: &Vertices, position_box: Option<Aabb>) -> Self {
        let Vertices {
            positions,
            uvs,
            uvs_1,
            colors,
            ..
        } = vertices;
        Self {
            position: std::array::from_fn(|k| match position_box {
                Some(aabb) => Grid::around([aabb.min[k], aabb.max[k]].into_iter()),
                None => Grid::around(positions.iter().map(|v| v[k])),
            }),
            uv: std::array::from_fn(|k| Grid::around(uvs.iter().map(|v| v[k]))),
            uv_1: std::array::from_fn(|k| Grid::around(uvs_1.iter().map(|v| v[k]))),
            color: std::array::from_fn(|k| Grid::around(colors.iter().map(|v| v[k]))),
        }
    }

    /// The largest distance of a rounded position from the exact one. Primitives with the same grid have equal errors,
    /// so that they still change levels together.
    pub(crate) fn position_error(&self) -> f32 {
        let squares = self.position.map(|grid| {
            let last = grid.min + grid.step * f64::from(Grid::LAST);
            let largest = grid.min.abs().max(last.abs());
            (grid.step * 0.5 + largest * f64::from(f32::EPSILON) * 0.5).powi(2)
        });
        (squares.into_iter().sum::<f64>().sqrt() as f32).next_up()
    }

    pub(crate) fn are_usable(&self) -> bool {
        let grids: &[Grid] = bytemuck::cast_slice(std::slice::from_ref(self));
        grids.iter().all(|grid| grid.is_usable())
    }
}

/// Replaces the vertices of a hierarchy by vertices that are at most `error_in_local` away. Adapts its bounds and
/// deviations.
pub(crate) fn with_vertices(
    hierarchy: &Hierarchy,
    vertices: Vertices,
    error_in_local: f32,
) -> Hierarchy {
    let mut hierarchy = Hierarchy {
        vertices,
        ..hierarchy.clone()
    };
    // No point leaves a sphere, and no surface leaves the source, by more than vertices move. Boxes are computed again,
    // because culling needs tight boxes.
    for group in &mut hierarchy.groups {
        group.bounds.radius += error_in_local;
        group.deviation_in_local += error_in_local;
    }
    for index in 0..hierarchy.units.len() {
        let unit = &hierarchy.units[index];
        let used = hierarchy.vertices_of(unit).iter();
        let positions = used.map(|&vertex| hierarchy.vertices.positions[vertex as usize]);
        hierarchy.units[index].aabb = Aabb::around(positions).unwrap_or(unit.aabb);
    }
    hierarchy
}
