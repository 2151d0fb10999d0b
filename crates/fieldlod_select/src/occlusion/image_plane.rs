//! From camera space to the texels of a depth image.

use camera_field::Camera;
use glam::{Mat3, Vec2, Vec3};

use crate::lane::{Lane, V3};

/// Texels along the longer side of the image.
const LONGER_SIDE: f32 = 256.0;
/// Texels along a side at least; sides are multiples of it.
const LEAST_SIDE: usize = 8;
/// What is nearer than this depth has no place in the image.
pub(crate) const NEAREST: f32 = 1e-3;

/// A camera's image as texels, x to the right and y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ImagePlane {
    is_perspective: bool,
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Texels per unit of slope, or per unit of length of an orthographic camera.
    pub(crate) scale: Vec2,
    /// Where the axis is.
    offset: Vec2,
}

/// A box along local axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LocalBox {
    pub(crate) center: Vec3,
    pub(crate) half_size: Vec3,
}

/// A box along the axes of camera space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraBox {
    min: Vec3,
    max: Vec3,
}

impl CameraBox {
    /// Around a box of local space.
    pub(crate) fn around(local: &LocalBox, linear: &Mat3, origin: Vec3) -> Self {
        let half = local.half_size;
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis].map(Vec3::abs);
        let half = x * half.x + y * half.y + z * half.z;
        let center = *linear * local.center + origin;
        Self {
            min: center - half,
            max: center + half,
        }
    }
}

impl ImagePlane {
    pub(crate) fn new(camera: &Camera) -> Self {
        let (is_perspective, min, max, px_per_unit) = match camera {
            Camera::Perspective(camera) => {
                (true, camera.slope_min, camera.slope_max, camera.focal_px)
            }
            Camera::Orthographic(camera) => (false, camera.min, camera.max, camera.pixels_per_unit),
        };
        // In the proportions of the image. Casts saturate, and take NaN to 0.
        let size_px = (max - min) * px_per_unit;
        let longer = size_px.x.max(size_px.y);
        let side = |px: f32| {
            let texels = ((px * (LONGER_SIDE / longer)) as usize).min(LONGER_SIDE as usize);
            texels.next_multiple_of(LEAST_SIDE).max(LEAST_SIDE)
        };
        let (width, height) = (side(size_px.x), side(size_px.y));
        let scale = Vec2::new(width as f32, height as f32) / (max - min);
        Self {
            is_perspective,
            width,
            height,
            scale,
            offset: -min * scale,
        }
    }

    /// Texel coordinates and nearness of points that are not behind the camera.
    #[inline(always)]
    pub(crate) fn project<L: Lane>(&self, point: V3<L>) -> V3<L> {
        let (x, y, z) = if self.is_perspective {
            let nearness = L::one() / point.z;
            (point.x * nearness, point.y * nearness, nearness)
        } else {
            (point.x, point.y, -point.z)
        };
        V3 {
            x: x * L::splat(self.scale.x) + L::splat(self.offset.x),
            y: y * L::splat(self.scale.y) + L::splat(self.offset.y),
            z,
        }
    }

    /// The nearness at a depth.
    #[inline(always)]
    pub(crate) fn nearness<L: Lane>(&self, depth: L) -> L {
        if self.is_perspective {
            L::one() / depth
        } else {
            -depth
        }
    }

    /// Which projected points have a place in the image.
    #[inline(always)]
    pub(crate) fn has_place<L: Lane>(&self, at: V3<L>, depth: L) -> L::Mask {
        let within =
            |at: L, count: usize| L::zero().is_at_most(at) & at.is_below(L::splat(count as f32));
        within(at.x, self.width)
            & within(at.y, self.height)
            & L::splat(NEAREST).is_at_most(depth)
            & depth.is_below(L::infinity())
    }

    /// The texel at coordinates that have a place in the image.
    #[inline(always)]
    pub(crate) fn texel(&self, x: f32, y: f32) -> usize {
        y as usize * self.width + x as usize
    }

    /// Whether a box is certainly not in the image.
    pub(crate) fn is_beyond(&self, bounds: &CameraBox) -> bool {
        let CameraBox { min, max } = bounds;
        if max.z < NEAREST {
            return true;
        }
        // Slopes are widest at one end or the other.
        let depths = match self.is_perspective {
            true if min.z < NEAREST => return false,
            true => [min.z, max.z],
            false => [1.0, 1.0],
        };
        let is_right_of = |least: f32, scale: f32, offset: f32, edge: f32| {
            depths
                .iter()
                .all(|depth| least / depth * scale + offset > edge)
        };
        let is_left_of = |most: f32, scale: f32, offset: f32| {
            depths
                .iter()
                .all(|depth| most / depth * scale + offset < 0.0)
        };
        let (scale, offset) = (self.scale, self.offset);
        is_right_of(min.x, scale.x, offset.x, self.width as f32)
            || is_right_of(min.y, scale.y, offset.y, self.height as f32)
            || is_left_of(max.x, scale.x, offset.x)
            || is_left_of(max.y, scale.y, offset.y)
    }
}
