//! The image of a small disk: splat kernels (§4.1.1).
//!
//! Write a point of the disk as `P + d` and its depth as `z + d_z`. The projection is *exactly*
//!
//! ```text
//! u(P + d) − u(P) = J d / (1 + d_z/z)
//! ```
//!
//! with `J` the derivative of the projection at `P`. For `e` in the unit disk, let
//! `d = r (a e₁ + b e₂)`. Then the right side is `A e / (1 + g·e)`. The columns of `A = r J (a b)` are
//! the axes of the kernel, and `g = r (a_z, b_z)/z` is its *keystone*.
//!
//! - The paper's kernel is `A e`: an ellipse around the projected centre. Its three steps
//!   (foreshortening by the normal, radial stretch `1/cos φ`, area `c·n`) multiply to `A`;
//!   [`SplatKernel::paper`] takes these steps.
//! - Its authors leave the asymmetry of the true kernel as future work, and expect it from the
//!   curl. The asymmetry is the keystone. An affine shear cannot give it, because an affine image of
//!   a disk is symmetric. The second-order term can: `A e (1 − g·e)`, [`SplatKernel::map_sheared`].
//! - The keystone has two parts, and the curl gives the first:
//!
//! ```text
//! d_z/z = (s × curl c)·d / (3|c|)  +  s·d / ρ,      s = P/ρ
//! ```
//!
//! A disk perpendicular to the sight ray has only the first term. The second term comes from the tilt
//! of the disk and from the fall of the strength with distance. It is present even on the axis, where
//! the curl is zero.

use super::intrinsics::Intrinsics;
use super::scalar::{Real, Vec2, Vec3};

/// A small disk on a surface, in camera space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surfel {
    /// Centre of the disk.
    pub center: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Radius in scene units.
    pub radius: Real,
}

/// Area of a splat in square pixels of the destination image (eq. 15), for one sample of the source
/// camera. Both factors are `c · n` (eq. 16) at the same point.
///
/// For points that no camera sampled, pass samples per unit area as `source_factor`.
#[inline]
pub fn splat_area_px2(destination_factor: Real, source_factor: Real) -> Real {
    destination_factor / source_factor
}

/// The image of a unit disk, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplatKernel {
    /// Projection of the disk's centre, from the principal point.
    pub center_px: Vec2,
    /// Images of the disk's two axes to first order: the columns of `A`.
    pub axes_px: [Vec2; 2],
    /// `g`: relative change of depth along the two axes. Its length is below 1 for a disk in front
    /// of the camera plane.
    pub keystone: Vec2,
}

impl SplatKernel {
    /// The kernel of a disk, with its full keystone.
    pub fn new(camera: &Intrinsics, surfel: &Surfel) -> Self {
        let (a, b) = surfel.axes();
        Self {
            center_px: camera.project_px(surfel.center),
            axes_px: [a, b].map(|axis| camera.displace_px(surfel.center, axis)),
            keystone: Vec2::new(a.z, b.z) / surfel.center.z,
        }
    }

    /// The kernel by the steps of the paper (Fig. 13), without a keystone.
    ///
    /// To first order, its ellipse equals that of [`SplatKernel::new`].
    pub fn paper(camera: &Intrinsics, surfel: &Surfel) -> Self {
        let p = surfel.center;
        let sight = p.normalize();
        let cos_phi = Intrinsics::aspect_ratio(p);
        let facing = -surfel.normal.dot(sight);
        // Directions in the image: along the radius from the principal point, and perpendicular to it. On the axis, any
        // direction is radial.
        let radial = Vec2::new(p.x, p.y).try_normalize().unwrap_or(Vec2::X);
        let tangential = radial.perp();
        let across_sight = [
            radial.extend(0.0).reject_from_normalized(sight).normalize(),
            tangential.extend(0.0),
        ];
        // First factor: the disk is thinner along its projected normal, at equal area.
        let tilt = Vec2::from(across_sight.map(|axis| surfel.normal.dot(axis)));
        let thin = tilt.try_normalize().unwrap_or(Vec2::X);
        let foreshorten =
            |e: Vec2| (e - thin * ((1.0 - facing.abs()) * thin.dot(e))) / facing.abs().sqrt();
        // Second factor: the radial stretch by 1/cos φ, at equal area. Oblong pixels add their own stretch.
        let stretch =
            |e: Vec2| radial * (e.x / cos_phi.sqrt()) + tangential * (e.y * cos_phi.sqrt());
        // Third factor: the size, from the projection factor `c · n`.
        let pixel = camera.focal_px / camera.constant_px2().sqrt();
        let factor = camera.constant_px2() * p.length() * facing.abs() / (p.z * p.z * p.z);
        let size_px = surfel.radius * factor.sqrt();
        Self {
            center_px: camera.project_px(p),
            axes_px: [Vec2::X, Vec2::Y].map(|e| stretch(foreshorten(e)) * pixel * size_px),
            keystone: Vec2::ZERO,
        }
    }

    /// Area of the paper's ellipse, `π r² (c · n)`, in square pixels.
    #[inline]
    pub fn affine_area_px2(&self) -> Real {
        core::f64::consts::PI as Real * self.axes_px[0].perp_dot(self.axes_px[1]).abs()
    }

    /// Area of the disk's exact image; see [`Intrinsics::flux_through_disk`].
    #[inline]
    pub fn area_px2(&self) -> Real {
        // `rest^(3/2)` without a power function.
        let rest = 1.0 - self.keystone.length_squared();
        self.affine_area_px2() / (rest * rest.sqrt())
    }

    /// Maps a point `e` of the unit disk by the paper's kernel: `A e`.
    #[inline]
    pub fn map_affine(&self, e: Vec2) -> Vec2 {
        self.center_px + self.axes_px[0] * e.x + self.axes_px[1] * e.y
    }

    /// Maps a point `e` of the unit disk by our asymmetric kernel, of second order: `A e (1 − g·e)`.
    #[inline]
    pub fn map_sheared(&self, e: Vec2) -> Vec2 {
        self.map_affine(e * (1.0 - self.keystone.dot(e)))
    }

    /// Projects a point `e` of the unit disk exactly: `A e / (1 + g·e)`.
    #[inline]
    pub fn map_exact(&self, e: Vec2) -> Vec2 {
        self.map_affine(e / (1.0 + self.keystone.dot(e)))
    }

    /// The inverse of [`SplatKernel::map_exact`]: the point of the disk's plane at a pixel, in radii
    /// of the disk. The pixel is inside the splat if the length of the point is at most 1.
    #[inline]
    pub fn unmap_exact(&self, pixel: Vec2) -> Vec2 {
        // `e = x / (1 + g·x)` gives `g·e = g·x / (1 + g·x)`, so `x = e / (1 − g·e)`.
        let e = self.unmap_affine(pixel);
        e / (1.0 - self.keystone.dot(e))
    }

    /// The inverse of [`SplatKernel::map_affine`].
    #[inline]
    pub fn unmap_affine(&self, pixel: Vec2) -> Vec2 {
        let [a, b] = self.axes_px;
        let offset = pixel - self.center_px;
        Vec2::new(offset.perp_dot(b), a.perp_dot(offset)) / a.perp_dot(b)
    }

    /// The inverse of [`SplatKernel::map_sheared`], on the branch through the centre. `None` for
    /// pixels beyond the fold of the second-order map. The fold is outside of the splat if the
    /// keystone is shorter than 1/2.
    #[inline]
    pub fn unmap_sheared(&self, pixel: Vec2) -> Option<Vec2> {
        let e = self.unmap_affine(pixel);
        // `e = x (1 − g·x)` gives a quadratic equation for `g·x`. This form of its solution has no difference of nearly
        // equal numbers, and holds for `g = 0`.
        let discriminant = 1.0 - 4.0 * self.keystone.dot(e);
        (discriminant >= 0.0).then(|| e * (2.0 / (1.0 + discriminant.sqrt())))
    }

    /// The exact image as an ellipse: its centre, and two conjugate half axes, which need not be
    /// perpendicular. The centre of the ellipse is not the projection of the disk's centre.
    pub fn ellipse(&self) -> (Vec2, [Vec2; 2]) {
        let rest = 1.0 - self.keystone.length_squared();
        let along = self.keystone.try_normalize().unwrap_or(Vec2::X);
        let image = |e: Vec2| self.map_affine(e) - self.center_px;
        let center = self.map_affine(-self.keystone / rest);
        (
            center,
            [image(along / rest), image(along.perp() / rest.sqrt())],
        )
    }
}

impl Surfel {
    /// Two perpendicular radii of the disk.
    pub fn axes(&self) -> (Vec3, Vec3) {
        let (a, b) = self.normal.any_orthonormal_pair();
        (a * self.radius, b * self.radius)
    }

    /// The part of the keystone that the curl gives, `r (s × curl c)·(a, b) / (3|c|)`.
    ///
    /// It is the whole keystone of a disk perpendicular to the sight ray. [`SplatKernel::keystone`]
    /// has both parts.
    pub fn keystone_from_curl(&self, camera: &Intrinsics) -> Vec2 {
        let strength = camera.strength(self.center);
        if strength == 0.0 {
            return Vec2::ZERO;
        }
        let sight = self.center.normalize();
        let shear = sight.cross(camera.curl(self.center)) / (3.0 * strength);
        let (a, b) = self.axes();
        Vec2::new(shear.dot(a), shear.dot(b))
    }
}

impl Intrinsics {
    /// Movement of the image of `p`, in pixels, for a small displacement of `p`, to first order.
    #[inline]
    pub fn displace_px(&self, p: Vec3, displacement: Vec3) -> Vec2 {
        let lateral = Vec2::new(displacement.x, displacement.y);
        let slope = Vec2::new(p.x, p.y) / p.z;
        (lateral - slope * displacement.z) / p.z * self.focal_px
    }
}
