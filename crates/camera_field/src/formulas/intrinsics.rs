//! The field of a pinhole camera in its own space (§2.2, §3.2–3.4).
//!
//! ```text
//! c(P)      = −C P / z³            C = f_x f_y            (6)
//! |c|       =  C ρ / z³                                   (5)
//! curl c    =  3C (−y, x, 0) / z⁴                         (12)
//! ρ(k, φ)   = √(C / (k cos³φ))                            (13), where |c| = k
//! grad |c|  =  C (x, y, z − 3ρ²/z) / (ρ z³)               (14), Cartesian
//! ```
//!
//! Deviation from the paper: pixels need not be square, so `C = f_x f_y` replaces `f²`. The
//! equations above hold, because the density of samples depends only on the area of a pixel. Only
//! the shape of the sampling pattern (§3.4) depends on `f_x / f_y`; see
//! [`Intrinsics::pattern_aspect_ratio`].

use super::scalar::{Real, Vec2, Vec3};

/// A perspective camera: focal lengths and the edges of its image.
///
/// The edges are slopes, `x/z` and `y/z`. They also describe off-centre frusta: tiles, shifted
/// lenses and the eyes of a headset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Focal lengths `(f_x, f_y)`, in pixels: pixels per unit of slope.
    pub focal_px: Vec2,
    /// Slopes `(x/z, y/z)` at the left and upper edges of the image.
    pub slope_min: Vec2,
    /// Slopes `(x/z, y/z)` at the right and lower edges; greater than `slope_min`.
    pub slope_max: Vec2,
}

impl Intrinsics {
    /// A centred camera with square pixels, from its focal length and image size in pixels.
    #[inline]
    pub fn centered(focal_px: Real, image_px: Vec2) -> Self {
        let half_slope = image_px * 0.5 / focal_px;
        Self {
            focal_px: Vec2::splat(focal_px),
            slope_min: -half_slope,
            slope_max: half_slope,
        }
    }

    /// The camera-sampling constant `C = f_x f_y` of eq. 12, in square pixels.
    #[inline]
    pub fn constant_px2(&self) -> Real {
        self.focal_px.x * self.focal_px.y
    }

    /// Width and height of the image in pixels.
    #[inline]
    pub fn image_px(&self) -> Vec2 {
        (self.slope_max - self.slope_min) * self.focal_px
    }

    /// Returns `true` if `p` is inside the field of view. False for NaN and for the position of the camera.
    #[inline]
    pub fn contains(&self, p: Vec3) -> bool {
        p.z > 0.0
            && p.x >= self.slope_min.x * p.z
            && p.x <= self.slope_max.x * p.z
            && p.y >= self.slope_min.y * p.z
            && p.y <= self.slope_max.y * p.z
    }

    /// Projects `p` to the image, in pixels from the principal point.
    #[inline]
    pub fn project_px(&self, p: Vec3) -> Vec2 {
        Vec2::new(p.x, p.y) / p.z * self.focal_px
    }

    /// The camera-sampling field (eq. 6): samples per unit area, pointing to the camera.
    /// Zero outside the field of view.
    #[inline]
    pub fn field(&self, p: Vec3) -> Vec3 {
        if self.contains(p) {
            p * (-self.constant_px2() / (p.z * p.z * p.z))
        } else {
            Vec3::ZERO
        }
    }

    /// Strength of the field (eq. 5): samples per unit area of a surface perpendicular to
    /// the sight ray. Zero outside the field of view.
    #[inline]
    pub fn strength(&self, p: Vec3) -> Real {
        if self.contains(p) {
            self.constant_px2() * p.length() / (p.z * p.z * p.z)
        } else {
            0.0
        }
    }

    /// Projection factor `c · n` (eq. 16): samples per unit area of a surface with the unit
    /// normal `normal`. Positive when the normal faces the camera. Zero outside the field of view.
    #[inline]
    pub fn projection_factor(&self, p: Vec3, normal: Vec3) -> Real {
        self.field(p).dot(normal)
    }

    /// Aspect ratio of the sampling pattern, `cos φ = z/ρ` (§3.4), for square pixels.
    ///
    /// It is 1 on the axis. It is small where neighbouring samples are much closer together along
    /// the radius of the image than across it.
    #[inline]
    pub fn aspect_ratio(p: Vec3) -> Real {
        p.z / p.length()
    }

    /// Aspect ratio of the sampling pattern for oblong pixels: the ratio of the minor to the major
    /// axis of the ellipse of one sample. Our extension of §3.4.
    ///
    /// Equal to [`Intrinsics::aspect_ratio`] where `f_x = f_y`.
    #[inline]
    pub fn pattern_aspect_ratio(&self, p: Vec3) -> Real {
        let (slope_x, slope_y) = (p.x / p.z, p.y / p.z);
        let (fx, fy) = (self.focal_px.x, self.focal_px.y);
        // z² J Jᵀ, with `J` the derivative of the projection. Its eigenvalues are z² times the squared pixel scales.
        let xx = fx * fx * (1.0 + slope_x * slope_x);
        let yy = fy * fy * (1.0 + slope_y * slope_y);
        let xy = fx * fy * slope_x * slope_y;
        // The larger eigenvalue follows from the trace, the smaller one from the determinant.
        let half_trace = 0.5 * (xx + yy);
        let half_difference = 0.5 * (xx - yy);
        let greatest = half_trace + (half_difference * half_difference + xy * xy).sqrt();
        let determinant = fx * fx * fy * fy * (1.0 + slope_x * slope_x + slope_y * slope_y);
        determinant.sqrt() / greatest
    }

    /// Curl of the field (eq. 12). Its length is the rate at which the strength grows away
    /// from the axis at constant distance. Zero outside the field of view.
    #[inline]
    pub fn curl(&self, p: Vec3) -> Vec3 {
        if self.contains(p) {
            let z2 = p.z * p.z;
            Vec3::new(-p.y, p.x, 0.0) * (3.0 * self.constant_px2() / (z2 * z2))
        } else {
            Vec3::ZERO
        }
    }

    /// Length of [`Intrinsics::curl`]: `3C sin φ / (ρ³ cos⁴ φ)` (eq. 12).
    #[inline]
    pub fn curl_magnitude(&self, p: Vec3) -> Real {
        self.curl(p).length()
    }

    /// Divergence of the field (eq. 9): zero everywhere in front of the camera.
    #[inline]
    pub const fn divergence(&self, _p: Vec3) -> Real {
        0.0
    }

    /// Gradient of the strength (eq. 14) in Cartesian form: the direction in which the
    /// sampling density grows fastest. Zero outside the field of view.
    ///
    /// It points to the camera only on the optical axis.
    #[inline]
    pub fn gradient(&self, p: Vec3) -> Vec3 {
        if !self.contains(p) {
            return Vec3::ZERO;
        }
        let rho = p.length();
        // The Cartesian form needs no angles, so selection gets the same bits on every machine.
        let scale = self.constant_px2() / (rho * p.z * p.z * p.z);
        Vec3::new(p.x, p.y, p.z - 3.0 * rho * rho / p.z) * scale
    }

    /// Distance `ρ` at which the strength equals `strength`, at an angle off the axis given by
    /// its cosine (eq. 13).
    #[inline]
    pub fn level_radius(&self, strength: Real, cos_phi: Real) -> Real {
        (self.constant_px2() / (strength * cos_phi * cos_phi * cos_phi)).sqrt()
    }

    /// Largest movement in pixels per unit of displacement perpendicular to the sight ray:
    /// `f ρ/z² = √(c / cos φ)`, for a displacement along the radius of the image. For oblong pixels,
    /// the larger focal length gives an upper bound. Zero outside the field of view.
    #[inline]
    pub fn pixel_scale(&self, p: Vec3) -> Real {
        if self.contains(p) {
            self.focal_px.x.max(self.focal_px.y) * p.length() / (p.z * p.z)
        } else {
            0.0
        }
    }

    /// `1 / cos φ` at the widest corner of the image: the largest secant in the field of view.
    #[inline]
    pub fn max_secant(&self) -> Real {
        let widest = self.slope_min.abs().max(self.slope_max.abs());
        (1.0 + widest.length_squared()).sqrt()
    }
}
