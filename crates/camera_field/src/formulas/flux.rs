//! Flux of the field through surfaces (§3.1): the number of samples that fall on them.
//!
//! ```text
//! Φ = ∫ c · da                                                    (8)
//!   = −C/2 · det(P₀, P₁, P₂) / (z₀ z₁ z₂)      for a triangle in view
//! ```
//!
//! This closed form is ours. On the triangle, `n · P` is constant in `c · n = −C (n · P) / z³`, and
//! `∫ z⁻³ da = area / (z₀ z₁ z₂)`. The flux is the signed area of the projected triangle
//! (Property 1), positive when the triangle faces the camera.
//!
//! The normal of a triangle is `(P₁ − P₀) × (P₂ − P₀)` and points to its front. Eq. 8 integrates over
//! *visible* surface, so callers must leave out hidden triangles.

use super::intrinsics::Intrinsics;
use super::scalar::{Real, Vec3};

/// A triangle clipped by the four sides of the frustum has at most this many corners.
const MAX_CORNERS: usize = 7;

/// The part of a triangle inside the field of view: a convex polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClippedTriangle {
    corners: [Vec3; MAX_CORNERS],
    count: usize,
}

impl Intrinsics {
    /// Flux through a triangle: the area of its projection in square pixels. Counts only the
    /// part inside the field of view; negative for a triangle that faces away.
    pub fn flux_through_triangle(&self, triangle: [Vec3; 3]) -> Real {
        self.clip_triangle(triangle)
            .fan()
            .map(|part| self.flux_through_triangle_in_view(part))
            .sum()
    }

    /// Flux through a triangle in front of the camera, without clipping to the field of view.
    #[inline]
    pub fn flux_through_triangle_in_view(&self, [p0, p1, p2]: [Vec3; 3]) -> Real {
        // This is det(P₀, P₁, P₂). Edges avoid the cancellation of nearly equal columns for a small, distant triangle.
        let determinant = p0.dot((p1 - p0).cross(p2 - p0));
        // The plane of the triangle contains the camera. The division below could give NaN if z is zero.
        if determinant == 0.0 {
            return 0.0;
        }
        -0.5 * self.constant_px2() * determinant / (p0.z * p1.z * p2.z)
    }

    /// Flux through a curved patch, given as a point for each pair of parameters in 0..=1.
    ///
    /// The patch is cut into `cells × cells` quads of two triangles. The flux of each triangle is
    /// exact, so the only error is that of the facets. The normal `∂P/∂u × ∂P/∂v` points to the
    /// front. Nothing is allocated.
    pub fn flux_through_patch(&self, cells: u16, point: impl Fn(Real, Real) -> Vec3) -> Real {
        let at = |column: u16, row: u16| {
            point(
                Real::from(column) / Real::from(cells),
                Real::from(row) / Real::from(cells),
            )
        };
        let mut flux = 0.0;
        for row in 0..cells {
            for column in 0..cells {
                // Two triangles for each cell.
                let here = at(column, row);
                let across = at(column + 1, row + 1);
                flux += self.flux_through_triangle([here, at(column + 1, row), across]);
                flux += self.flux_through_triangle([here, across, at(column, row + 1)]);
            }
        }
        flux
    }

    /// Flux through a flat disk, in closed form; not clipped to the view.
    ///
    /// ```text
    /// Φ = π r² (c · n) / (1 − r² (1 − n_z²) / z²)^(3/2)
    /// ```
    ///
    /// The numerator is the area of a splat (eq. 15). The denominator is the effect of perspective
    /// within the splat. The result is infinite or NaN if the disk reaches the camera plane.
    pub fn flux_through_disk(&self, center: Vec3, normal: Vec3, radius: Real) -> Real {
        // The numerator uses the density at the centre for the whole disk.
        let z_cubed = center.z * center.z * center.z;
        let factor = -self.constant_px2() * center.dot(normal) / z_cubed;
        // The denominator corrects for the differences of depth within the disk.
        let slant = (1.0 - normal.z * normal.z).max(0.0);
        // `rest^(3/2)` without a power function.
        let rest = 1.0 - radius * radius * slant / (center.z * center.z);
        core::f64::consts::PI as Real * radius * radius * factor / (rest * rest.sqrt())
    }

    /// The part of a triangle inside the field of view.
    pub(super) fn clip_triangle(&self, triangle: [Vec3; 3]) -> ClippedTriangle {
        let mut clipped = ClippedTriangle::whole(triangle);
        // No near plane is needed: the four sides meet only at the camera, so nothing behind it remains.
        clipped.keep(|p| p.x - self.slope_min.x * p.z);
        clipped.keep(|p| self.slope_max.x * p.z - p.x);
        clipped.keep(|p| p.y - self.slope_min.y * p.z);
        clipped.keep(|p| self.slope_max.y * p.z - p.y);
        clipped
    }
}

impl ClippedTriangle {
    fn whole([p0, p1, p2]: [Vec3; 3]) -> Self {
        let mut corners = [Vec3::ZERO; MAX_CORNERS];
        corners[..3].copy_from_slice(&[p0, p1, p2]);
        Self { corners, count: 3 }
    }

    /// Keeps the part where `inside` is not negative (the step of Sutherland and Hodgman for one plane).
    fn keep(&mut self, inside: impl Fn(Vec3) -> Real) {
        let before = *self;
        self.count = 0;
        for index in 0..before.count {
            let here = before.corners[index];
            let next = before.corners[(index + 1) % before.count];
            let (inside_here, inside_next) = (inside(here), inside(next));
            if inside_here >= 0.0 {
                self.push(here);
            }
            // The edge crosses the plane.
            if (inside_here >= 0.0) != (inside_next >= 0.0) {
                // Both distances have different signs, so the divisor is not zero.
                let share = inside_here / (inside_here - inside_next);
                self.push(here + (next - here) * share);
            }
        }
    }

    fn push(&mut self, corner: Vec3) {
        // Rounding can make a sliver cross a plane more often than a convex polygon may.
        if self.count < MAX_CORNERS {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }

    /// A fan of triangles that covers the polygon.
    pub(super) fn fan(&self) -> impl Iterator<Item = [Vec3; 3]> {
        (2..self.count).map(|last| {
            let [first, .., _] = self.corners;
            [first, self.corners[last - 1], self.corners[last]]
        })
    }
}
