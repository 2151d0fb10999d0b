//! The edges of a view: sides as planes, and the two views that groups enter and leave.

use glam::Vec3;
use wide::f32x8;

use crate::decide::conservative::CameraParts;

/// For each side of a perspective view, what `x` or `y` and what `z` counts in the distance inside.
pub(super) type Sides = [[f32x8; 2]; 4];

/// Two values of which each lane takes one: of groups that were not refined, and of those that were.
#[derive(Clone, Copy)]
pub(super) struct ByMemory {
    pub(super) entering: f32,
    pub(super) leaving: f32,
}

impl ByMemory {
    pub(super) const BIT: Self = Self {
        entering: 0.0,
        leaving: 1.0,
    };
}

/// What the tests of all instances need of a view.
pub(crate) struct IntervalView {
    /// `1/S`.
    pub(super) least_cosine: ByMemory,
    /// Sides that groups enter and, where others, leave.
    pub(super) entering: Sides,
    pub(super) leaving: Option<Sides>,
}

impl IntervalView {
    pub(in crate::decide) fn new(entering: &CameraParts, leaving: &CameraParts) -> Self {
        Self {
            least_cosine: ByMemory {
                entering: 1.0 / entering.secant,
                leaving: 1.0 / leaving.secant,
            },
            entering: sides(entering),
            leaving: (leaving.camera != entering.camera).then(|| sides(leaving)),
        }
    }
}

fn sides(parts: &CameraParts) -> Sides {
    let side = |(inward, _): (Vec3, f32)| [inward.x + inward.y, inward.z].map(f32x8::splat);
    parts.sides.map(side)
}

/// How far inside the nearest side a point is.
#[inline]
pub(super) fn least_inside(sides: &Sides, [x, y, z]: [f32x8; 3]) -> f32x8 {
    let inside = |side: usize, across: f32x8| across * sides[side][0] + z * sides[side][1];
    let smaller = |a: f32x8, b: f32x8| a.simd_lt(b).bitselect(a, b);
    smaller(
        smaller(inside(0, x), inside(1, x)),
        smaller(inside(2, y), inside(3, y)),
    )
}

/// For each lane one of two values, by its bit.
#[inline]
pub(super) fn lanes(values: ByMemory, was_refined: u32) -> f32x8 {
    match was_refined {
        0 => f32x8::splat(values.entering),
        0xff => f32x8::splat(values.leaving),
        _ => f32x8::from(std::array::from_fn(|lane| {
            if was_refined >> lane & 1 == 1 {
                values.leaving
            } else {
                values.entering
            }
        })),
    }
}
