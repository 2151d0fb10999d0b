//! The camera of a layered depth image (§4.2.3).
//!
//! For cameras with parallel axes, the compound field (19) on a plane perpendicular to the axes
//! points to one point. It has the strength of one camera at that point:
//!
//! ```text
//! w_i = f_i² / D_i³
//! q   = Σ w_i o_i / Σ w_i                            (21)
//! C   = (Σ f_i²/D_i²)³ / (Σ f_i²/D_i³)²              (App. v, divided by D_A⁶ D_B⁶)
//! ```
//!
//! `D_i` is the depth of the plane in camera `i`. The paper has two cameras; these sums hold for
//! any number.
//!
//! For cameras that are not parallel, the lines of the field do not meet, and the paper gives no
//! solution. [`convergent_point`] is our solution: a least-squares point.

use super::pose::{PosedCamera, compound_field};
use super::scalar::{Mat3, Real, Vec3};

/// A camera of (21): its position, its focal length and the depth of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParallelCamera {
    /// Centre of projection `o`, in the world.
    pub origin: Vec3,
    /// Focal length `f` in pixels; with oblong pixels the geometric mean of the two.
    pub focal_px: Real,
    /// Depth `D` of the plane along the common axis; greater than zero.
    pub depth: Real,
}

/// The camera that samples a plane with the same density and directions as several parallel
/// cameras together (App. v). The plane is perpendicular to their axes, and the position is the
/// convergent point (21). `None` without cameras.
pub fn equivalent_camera(cameras: &[ParallelCamera]) -> Option<ParallelCamera> {
    let mut weight = 0.0;
    let mut density = 0.0;
    let mut weighted_origin = Vec3::ZERO;
    for camera in cameras {
        // `facing` is the density that this camera adds on the plane.
        let facing = camera.focal_px * camera.focal_px / (camera.depth * camera.depth);
        density += facing;
        weight += facing / camera.depth;
        weighted_origin += camera.origin * (facing / camera.depth);
    }
    // One camera at the weighted mean has both sums at this depth (App. v).
    let depth = density / weight;
    // Without cameras, the depth above is NaN and is not used.
    (weight > 0.0).then(|| ParallelCamera {
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
    /// The line of the compound field through `p`; `None` where the field is zero.
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

/// The point that is nearest to all lines by weighted least squares. The weight of a line is the
/// square of its strength:
///
/// ```text
/// q = argmin Σ |c(p) × (q − p)|²
/// ```
///
/// This is our solution for cameras that are not parallel. It equals (21) if the cameras are
/// parallel and the points are in a plane perpendicular to their axes. `None` if all lines are
/// nearly parallel.
///
/// Distances without weights merged more samples in the example `figure_18`. The weight was chosen
/// on its first ten pairs and confirmed on its further pairs.
pub fn convergent_point(lines: impl IntoIterator<Item = FieldLine>) -> Option<Vec3> {
    // The normal equations: M q = b with M = Σ w (I − d dᵀ) and b = Σ w (I − d dᵀ) p.
    let mut matrix = Mat3::ZERO;
    let mut right_side = Vec3::ZERO;
    let mut total: Real = 0.0;
    for line in lines {
        let d = line.direction;
        let weight = line.strength * line.strength;
        // Projects onto the plane perpendicular to the line.
        let across = Mat3::IDENTITY - Mat3::from_cols(d * d.x, d * d.y, d * d.z);
        matrix += across * weight;
        right_side += across * line.point * weight;
        total += weight;
    }
    // With a total weight of 1, determinants of strong fields do not overflow.
    let (matrix, right_side) = (matrix * total.recip(), right_side * total.recip());
    // If all lines are parallel, the matrix is singular: the point could move along them. Rounding leaves a determinant
    // of a few ε.
    let solvable = matrix.determinant() > 16.0 * Real::EPSILON;
    solvable.then(|| matrix.inverse() * right_side)
}
