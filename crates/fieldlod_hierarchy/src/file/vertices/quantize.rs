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
    /// tangents differ by at most 0.125°. Bounds are adapted to the rounded triangles.
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
    /// Grids over the extent of `vertices`.
    pub(crate) fn around(vertices: &Vertices) -> Self {
        let Vertices {
            positions,
            uvs,
            uvs_1,
            colors,
            ..
        } = vertices;
        Self {
            position: std::array::from_fn(|k| Grid::around(positions.iter().map(|v| v[k]))),
            uv: std::array::from_fn(|k| Grid::around(uvs.iter().map(|v| v[k]))),
            uv_1: std::array::from_fn(|k| Grid::around(uvs_1.iter().map(|v| v[k]))),
            color: std::array::from_fn(|k| Grid::around(colors.iter().map(|v| v[k]))),
        }
    }

    pub(crate) fn are_usable(&self) -> bool {
        let grids: &[Grid] = bytemuck::cast_slice(std::slice::from_ref(self));
        grids.iter().all(|grid| grid.is_usable())
    }
}

/// Replaces the vertices of a hierarchy and adapts its bounds. Also returns the largest distance that a
/// position moves, in local units.
pub(crate) fn with_vertices(hierarchy: &Hierarchy, vertices: Vertices) -> (Hierarchy, f32) {
    let pairs = hierarchy.vertices.positions.iter().zip(&vertices.positions);
    let distances = pairs.map(|(from, to)| from.as_dvec3().distance(to.as_dvec3()));
    // Rounded up: the conversion to `f32` must not make the bound smaller than a distance.
    let error_in_local = (distances.fold(0.0, f64::max) as f32).next_up();
    let mut hierarchy = Hierarchy {
        vertices,
        ..hierarchy.clone()
    };
    // No vertex leaves a sphere by more than it moves. Boxes are computed again, because culling needs tight boxes.
    for group in &mut hierarchy.groups {
        group.bounds.radius += error_in_local;
    }
    for index in 0..hierarchy.units.len() {
        let unit = &hierarchy.units[index];
        let used = hierarchy.vertices_of(unit).iter();
        let positions = used.map(|&vertex| hierarchy.vertices.positions[vertex as usize]);
        hierarchy.units[index].aabb = Aabb::around(positions).unwrap_or(unit.aabb);
    }
    (hierarchy, error_in_local)
}
