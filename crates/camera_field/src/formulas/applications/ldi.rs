//! Where to put the one camera of a layered depth image (§4.2.3).
//!
//! For cameras with parallel axes the compound field (19) of a plane across the axes points to
//! one point, and has the strength there of one camera at that point:
//!
//! ```text
//! w_i = f_i² / D_i³
//! q   = Σ w_i o_i / Σ w_i                            (21)
//! C   = (Σ f_i²/D_i²)³ / (Σ f_i²/D_i³)²              (App. v, divided by D_A⁶ D_B⁶)
//! ```
//!
//! `D_i` is the depth of the plane in camera `i`. Written as sums these hold for any number of
//! cameras, where the paper has two.
//!
//! For cameras that are not parallel the lines of the field do not meet, and the paper leaves
//! the question open. [`convergent_point`] answers it with a least-squares point.

use super::pose::{PosedCamera, compound_field};
use super::scalar::{Mat3, Real, Vec3};

/// One of the cameras of (21): its position, focal length and the depth of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParallelCamera {
    /// Centre of projection `o`, in the world.
    pub origin: Vec3,
    /// Focal length `f` in pixels; with oblong pixels the geometric mean of the two.
    pub focal_px: Real,
    /// Depth `D` of the plane along the common axis; greater than zero.
    pub depth: Real,
}

/// The camera whose field equals the compound field on the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EquivalentCamera {
    /// The convergent point (21).
    pub origin: Vec3,
    /// Its focal length in pixels (App. v).
    pub focal_px: Real,
    /// Depth of the plane from the convergent point.
    pub depth: Real,
}

/// The camera that samples a plane as densely, and from the same directions, as several parallel
/// cameras together (21, App. v). The plane is perpendicular to their axes. `None` without cameras.
pub fn equivalent_camera(cameras: &[ParallelCamera]) -> Option<EquivalentCamera> {
    let mut weight = 0.0;
    let mut density = 0.0;
    let mut weighted_origin = Vec3::ZERO;
    for camera in cameras {
        // The density that this camera adds on its axis, and its part of the sum of (21).
        let facing = camera.focal_px * camera.focal_px / (camera.depth * camera.depth);
        density += facing;
        weight += facing / camera.depth;
        weighted_origin += camera.origin * (facing / camera.depth);
    }
    // One camera at the weighted mean has both sums at this depth (App. v).
    let depth = density / weight;
    (weight > 0.0).then(|| EquivalentCamera {
        origin: weighted_origin / weight,
        focal_px: density.sqrt() * depth,
        depth,
    })
}

/// A line through a point along the compound field there (19).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldLine {
    /// A point of the scene.
    pub point: Vec3,
    /// Direction of the compound field at the point, of length 1.
    pub direction: Vec3,
    /// Strength of the compound field: samples per unit area.
    pub strength: Real,
}

impl FieldLine {
    /// The line of the compound field through `p`; `None` where no camera sees it.
    pub fn through(cameras: &[PosedCamera], p: Vec3) -> Option<Self> {
        let field = compound_field(cameras, p);
        let strength = field.length();
        (strength > 0.0).then(|| Self {
            point: p,
            direction: field / strength,
            strength,
        })
    }

    /// Distance of a point from the line.
    pub fn distance(&self, q: Vec3) -> Real {
        (q - self.point).cross(self.direction).length()
    }
}

/// The point about which the field of the lines has the least sum of squared moments:
///
/// ```text
/// q = argmin Σ |c(p) × (q − p)|²
/// ```
///
/// that is, the point nearest to all lines, each weighted by the square of its strength. This is
/// our answer for cameras that are not parallel. It equals (21) where the cameras are parallel and
/// the points lie in a plane across their axes. `None` if the lines are all parallel.
///
/// Distances without the weight are the more obvious choice, but they measured worse (example `figure_18`: the
/// weight was chosen on its first ten pairs and confirmed on its further pairs).
pub fn convergent_point(lines: impl IntoIterator<Item = FieldLine>) -> Option<Vec3> {
    // The normal equations: M q = b with M = Σ w (I − d dᵀ) and b = Σ w (I − d dᵀ) p.
    let mut matrix = Mat3::ZERO;
    let mut right_side = Vec3::ZERO;
    let mut total: Real = 0.0;
    for line in lines {
        let d = line.direction;
        let weight = line.strength * line.strength;
        // Projects onto the plane across the line.
        let across = Mat3::IDENTITY - Mat3::from_cols(d * d.x, d * d.y, d * d.z);
        matrix += across * weight;
        right_side += across * line.point * weight;
        total += weight;
    }
    // Lines that are all parallel leave a direction open.
    let solvable = matrix.determinant() > 16.0 * Real::EPSILON * total * total * total;
    solvable.then(|| matrix.inverse() * right_side)
}
