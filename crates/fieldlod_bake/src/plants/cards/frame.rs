//! Rectangles on planes.

use fieldlod_hierarchy::Card;
use glam::{Mat3, UVec2, Vec2, Vec3};

use super::planes::{Facet, Plane};

/// No edge is shorter than this, as a share of the other: such a rectangle is a line.
const SHORTEST: f32 = 1e-6;
/// How many directions of its edges are tried, over a quarter turn.
const TURNS: usize = 16;
/// A sixteenth of a quarter turn.
const TURN: Vec2 = Vec2::new(0.995_184_7, 0.098_017_14);

/// A rectangle around triangles that are laid on its plane.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    /// Triangles, by their indices.
    pub(super) facets: Vec<u32>,
    pub(super) middle: Vec3,
    /// Along both edges, and the normal.
    pub(super) axes: Mat3,
    /// Along the edges, from the middle.
    pub(super) min: Vec2,
    pub(super) max: Vec2,
}

impl Frame {
    /// The smallest of some directions; `None` around nothing.
    pub(super) fn around(plane: &Plane, facets: Vec<u32>, all: &[Facet]) -> Option<Self> {
        let corners = || facets.iter().flat_map(|&facet| all[facet as usize].corners);
        let (x, y) = plane.normal.any_orthonormal_pair();
        let area = |frame: &Self| (frame.max - frame.min).element_product();
        let mut direction = Vec2::X;
        let mut smallest: Option<Self> = None;
        for _ in 0..TURNS {
            let across = x * direction.x + y * direction.y;
            let mut frame = Self {
                facets: Vec::new(),
                middle: plane.middle,
                axes: Mat3::from_cols(across, plane.normal.cross(across), plane.normal),
                min: Vec2::MAX,
                max: Vec2::MIN,
            };
            for corner in corners() {
                let at = frame.place(corner).truncate();
                (frame.min, frame.max) = (frame.min.min(at), frame.max.max(at));
            }
            if smallest.as_ref().is_none_or(|one| area(&frame) < area(one)) {
                smallest = Some(frame);
            }
            direction = direction.rotate(TURN);
        }
        let is_drawn = |frame: &Self| {
            let size = frame.max - frame.min;
            size.is_finite() && size.min_element() > SHORTEST * size.max_element()
        };
        let frame = smallest.filter(is_drawn)?;
        Some(Self {
            facets,
            ..frame.lying()
        })
    }

    /// A point along both edges and the normal, from the middle.
    pub(super) fn place(&self, point: Vec3) -> Vec3 {
        self.axes.transpose() * (point - self.middle)
    }

    /// The card, where lengths of the frame are in a unit, with its first texel and its size.
    pub(super) fn card(&self, unit_in_local: f32, first: UVec2, size: UVec2) -> Card {
        let Mat3 { x_axis, y_axis, .. } = self.axes;
        let corner = self.middle + x_axis * self.min.x + y_axis * self.min.y;
        let edges = self.max - self.min;
        let short = |texels: UVec2| texels.to_array().map(|texels| texels as u16);
        Card {
            corner: corner * unit_in_local,
            across: x_axis * edges.x * unit_in_local,
            down: y_axis * edges.y * unit_in_local,
            first_texel: short(first),
            size_texels: short(size),
        }
    }

    /// Turned so that it is at least as wide as high.
    fn lying(self) -> Self {
        let size = self.max - self.min;
        if size.x >= size.y {
            return self;
        }
        let Mat3 {
            x_axis,
            y_axis,
            z_axis,
        } = self.axes;
        Self {
            axes: Mat3::from_cols(y_axis, -x_axis, z_axis),
            min: Vec2::new(self.min.y, -self.max.x),
            max: Vec2::new(self.max.y, -self.min.x),
            ..self
        }
    }
}
