//! Factors by which an affine map stretches lengths: the largest, the least, and the factors across a sight ray.

use glam::{DMat3, Mat3, Vec3};

use crate::lanes::larger;

/// Relative distance of `MᵀM` from a multiple of the identity, up to which `M` counts as a rotation with one scale (and
/// mirror). It is larger than the rounding of products of rotations, and small against the errors of levels.
const SIMILARITY_TOLERANCE: f32 = 1e-4;

/// Whether `m` turns, mirrors and scales all lengths alike. False for NaN and for zero.
pub(crate) fn is_similarity(m: &Mat3) -> bool {
    let gram = m.transpose() * *m;
    let scale = gram.x_axis.x;
    let difference = gram - Mat3::from_diagonal(Vec3::splat(scale));
    let widest = [difference.x_axis, difference.y_axis, difference.z_axis]
        .map(|column| column.abs().max_element());
    scale > 0.0 && widest.iter().all(|&d| d <= scale * SIMILARITY_TOLERANCE)
}

/// An upper bound of the largest singular value; NaN for NaN. The squared singular values are the
/// eigenvalues of `MᵀM` and of `MMᵀ`, which Gershgorin's circles bound. Newton's steps then approach
/// the largest root of the characteristic polynomial from above.
pub(crate) fn largest_stretch(m: &Mat3) -> f32 {
    // An upper bound, which for a similarity is exact.
    let bound = gershgorin(&(m.transpose() * *m)).min(gershgorin(&(*m * m.transpose())));
    if is_similarity(m) {
        return bound.sqrt();
    }
    // The eigenvalue in double precision, from above.
    let m = m.as_dmat3();
    let newton = largest_eigenvalue(&(m.transpose() * m), f64::from(bound));
    // Rounding to f32 must not fall below.
    let refined = newton.sqrt() as f32 * (1.0 + 4.0 * f32::EPSILON);
    if refined < bound.sqrt() {
        refined
    } else {
        bound.sqrt()
    }
}

/// A lower bound of the smallest singular value, by `|det| ≤ σ_min σ_max²`; loose for maps that
/// flatten, exact for similarities.
pub(crate) fn least_stretch(m: &Mat3, largest: f32) -> f32 {
    let determinant = m.x_axis.dot(m.y_axis.cross(m.z_axis)).abs();
    (determinant / (largest * largest)).min(largest)
}

fn gershgorin(gram: &Mat3) -> f32 {
    let rows = gram.x_axis.abs() + gram.y_axis.abs() + gram.z_axis.abs();
    // Not f32::max, which drops NaN.
    if rows.is_nan() {
        return f32::NAN;
    }
    rows.max_element()
}

/// The largest root of `λ³ − Tλ² + Sλ − D`, from `above`. All roots are real, so Newton's method
/// falls to it monotonically.
fn largest_eigenvalue(gram: &DMat3, above: f64) -> f64 {
    let (a, b, c) = (gram.x_axis, gram.y_axis, gram.z_axis);
    let trace = a.x + b.y + c.z;
    let minors = a.x * b.y - a.y * b.x + a.x * c.z - a.z * c.x + b.y * c.z - b.z * c.y;
    let determinant = a.dot(b.cross(c));
    let mut root = above;
    // Each step stays above the root, so that fewer steps only give a looser bound. In the tests, 12 steps come within
    // 1e-5 of a stretch of 3.
    for _ in 0..12 {
        let slope = (3.0 * root - 2.0 * trace) * root + minors;
        let value = ((root - trace) * root + minors) * root - determinant;
        if slope <= 0.0 || value <= 0.0 {
            break;
        }
        root -= value / slope;
    }
    // More than the rounding of the last step in `f64`.
    root * (1.0 + 1e-9)
}

/// How much a map stretches lengths across a sight ray.
///
/// A displacement `e` in local space moves `(I − ssᵀ) M e` across the unit sight ray `s`, at most
/// `|e| √λ`. `λ` is the greater eigenvalue of the restriction of `A = MMᵀ` to the plane across `s`:
/// ```text
/// λ = (T + √(T² − 4D)) / 2,   T = tr A − sᵀAs,   D = sᵀ adj(A) s
/// ```
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenStretch {
    gram: Mat3,
    adjugate: Mat3,
    trace: f32,
}

/// Bound of the rounding of the quadratic forms above, relative to the trace: some units of the last place of `f32`. With
/// a smaller one, the stretch may be too small; a larger one refines flattened instances.
const ROUNDING: f32 = 1e-6;

impl SeenStretch {
    pub(crate) fn new(m: &Mat3) -> Self {
        let gram = *m * m.transpose();
        let (a, b, c) = (gram.x_axis, gram.y_axis, gram.z_axis);
        Self {
            gram,
            adjugate: Mat3::from_cols(b.cross(c), c.cross(a), a.cross(b)),
            trace: a.x + b.y + c.z,
        }
    }

    /// `√λ` for the unit sight ray `along`, an upper bound up to rounding.
    #[inline(always)]
    pub(crate) fn across(&self, along: Vec3) -> f32 {
        // T and D of the restriction to the plane across the ray, and its greater eigenvalue.
        let trace = self.trace - along.dot(self.gram * along);
        let determinant = along.dot(self.adjugate * along);
        let root = larger(trace * trace - 4.0 * determinant, 0.0).sqrt();
        let eigenvalue = 0.5 * (trace + root) + ROUNDING * self.trace;
        eigenvalue.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    fn turn() -> Mat3 {
        Mat3::from_quat(Quat::from_xyzw(0.1, -0.5, 0.7, 0.5).normalize())
    }

    fn shear() -> Mat3 {
        Mat3::from_cols(Vec3::X, Vec3::new(2.0, 1.0, 0.0), Vec3::new(0.5, 0.3, 1.0))
    }

    fn directions() -> impl Iterator<Item = Vec3> {
        let steps = || (0..9u8).map(|i| f32::from(i) - 4.0);
        steps()
            .flat_map(move |x| steps().flat_map(move |y| steps().map(move |z| Vec3::new(x, y, z))))
            .filter(|v| *v != Vec3::ZERO)
            .map(Vec3::normalize)
    }

    fn lengths(m: &Mat3) -> [f32; 2] {
        let lengths = directions().map(|d| (*m * d).length());
        let bounds = (f32::MAX, 0.0f32);
        let (least, most) = lengths.fold(bounds, |(a, b), x| (a.min(x), b.max(x)));
        [least, most]
    }

    #[test]
    fn stretches_bound_all_lengths() {
        let scale = Mat3::from_diagonal(Vec3::new(0.5, -3.0, 2.0));
        for m in [turn() * scale, scale * turn(), turn() * scale * turn()] {
            assert!((largest_stretch(&m) - 3.0).abs() < 1e-5, "{m}");
        }
        for m in [shear(), turn(), scale] {
            let (largest, [shortest, longest]) = (largest_stretch(&m), lengths(&m));
            assert!(longest <= largest * 1.0001 && largest < longest * 1.02);
            assert!(least_stretch(&m, largest) <= shortest * 1.0001);
        }
    }

    #[test]
    fn stretch_across_a_sight_ray_is_tight() {
        let needle = Mat3::from_diagonal(Vec3::new(0.1, 1.0, 5.0));
        for m in [shear(), needle, turn() * needle] {
            let seen = SeenStretch::new(&m);
            for along in directions().step_by(7) {
                let across = |e: Vec3| (m * e - along * along.dot(m * e)).length();
                let most = directions().map(across).fold(0.0, f32::max);
                let bound = seen.across(along);
                assert!(most <= bound * 1.0001 && bound < most * 1.05);
            }
        }
    }
}
