//! Texture filtering and mip levels (§4.1.2, §4.1.4): the inverse of splatting.
//!
//! A splat is the image of the piece of surface of one sample. A texture filter is the piece of
//! surface under one pixel, in texels. Its area is `texels per unit area / (c·n)`, and the square
//! root of the area is the filter's dimension for a mip level:
//!
//! ```text
//! level = log₂ √(texels per unit area / (c·n)) + bias
//! ```
//!
//! The dimension is the geometric mean of the two half axes of the filter. Hardware that filters
//! isotropically uses the longer axis, so it chooses a higher level at grazing angles.

use super::intrinsics::Intrinsics;
use super::scalar::{Real, Vec2, Vec3};

/// Side of the square of surface under one pixel, `√(1 / (c·n))`, in scene units (§4.1.4).
/// Infinite if the surface is edge-on or faces away.
#[inline]
pub fn filter_dimension(projection_factor: Real) -> Real {
    if projection_factor > 0.0 {
        (1.0 / projection_factor).sqrt()
    } else {
        Real::INFINITY
    }
}

/// Mip level for a surface with the projection factor `c · n` (eq. 16) and
/// `texels_per_area` texels per unit area at level 0, plus `bias` levels.
///
/// The level is not clamped. It is negative if a texel covers more than a pixel, and infinite if the
/// surface is edge-on or faces away.
#[expect(
    clippy::disallowed_methods,
    reason = "mip levels are for drawing; geometry is not chosen by them"
)]
#[inline]
pub fn mip_level(projection_factor: Real, texels_per_area: Real, bias: Real) -> Real {
    let texels_across = filter_dimension(projection_factor) * texels_per_area.sqrt();
    texels_across.log2() + bias
}

/// The piece of texture under one pixel, to first order: Heckbert's elliptical filter. The fields
/// are conjugate half axes of the ellipse, for a pixel of radius 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterKernel {
    /// Movement in texels for a step of one pixel along image x.
    pub texels_per_px_x: Vec2,
    /// Movement in texels for a step of one pixel along image y.
    pub texels_per_px_y: Vec2,
}

impl FilterKernel {
    /// The kernel at `p` on a surface. `texel_u` and `texel_v` are the steps from texel to texel, in
    /// scene units. `None` if the surface is edge-on.
    pub fn new(camera: &Intrinsics, p: Vec3, texel_u: Vec3, texel_v: Vec3) -> Option<Self> {
        let u_px = camera.displace_px(p, texel_u);
        let v_px = camera.displace_px(p, texel_v);
        // The inverse of the matrix with the columns `u_px` and `v_px`.
        let determinant = u_px.perp_dot(v_px);
        (determinant != 0.0).then(|| Self {
            texels_per_px_x: Vec2::new(v_px.y, -u_px.y) / determinant,
            texels_per_px_y: Vec2::new(-v_px.x, u_px.x) / determinant,
        })
    }

    /// Texels under one pixel: `texels per unit area / (c·n)`.
    #[inline]
    pub fn area_texels(&self) -> Real {
        self.texels_per_px_x.perp_dot(self.texels_per_px_y).abs()
    }
}
