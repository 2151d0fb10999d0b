//! A camera from a renderer's projection matrix.

use core::fmt;

use super::intrinsics::Intrinsics;
use super::orthographic::OrthographicIntrinsics;
use super::scalar::{Mat3, Mat4, Real, Vec2, Vec3};

/// Turns view space (x right, y up, looking down −z) into camera space
/// (x right, y down, z = depth). It is its own inverse.
pub const CAMERA_FROM_VIEW: Mat3 = Mat3::from_diagonal(Vec3::new(1.0, -1.0, -1.0));

/// A perspective or an orthographic camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Camera {
    /// A pinhole camera, the subject of the paper.
    Perspective(Intrinsics),
    /// The limiting constant field, our extension.
    Orthographic(OrthographicIntrinsics),
}

/// The reason why a projection matrix has no camera-sampling field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ProjectionError {
    /// The matrix contains a NaN or an infinity outside its depth row.
    NotFinite,
    /// The viewport has no pixels, or its size is not finite.
    EmptyViewport,
    /// The matrix flattens the image: it has no finite, non-empty range of slopes.
    Degenerate,
    /// The image axes are not those of the view (rotation, shear, an oblique direction), or
    /// the eye is not at the origin of view space.
    Sheared,
    /// The view does not look down −z.
    LooksBackwards,
}

impl fmt::Display for ProjectionError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NotFinite => "the projection matrix is not finite",
            Self::EmptyViewport => "the viewport is empty or not finite",
            Self::Degenerate => "the projection matrix flattens the image",
            Self::Sheared => "the projection matrix shears or rotates the image",
            Self::LooksBackwards => "the projection matrix does not look down -z",
        })
    }
}

impl std::error::Error for ProjectionError {}

impl Camera {
    /// Reads the camera from `clip_from_view` and the viewport, which is in physical pixels. View
    /// space has x right and y up, and looks down −z.
    ///
    /// The depth row is ignored: finite, infinite and reversed depth give the same camera. A
    /// mirrored image (negative scale in x or y) gives the camera of the image that is not mirrored.
    ///
    /// # Errors
    /// [`ProjectionError`] for matrices that are not finite, flat, sheared or look backwards, and
    /// for empty viewports.
    pub fn from_projection(
        clip_from_view: &Mat4,
        viewport_px: Vec2,
    ) -> Result<Self, ProjectionError> {
        if !(viewport_px.is_finite() && viewport_px.x > 0.0 && viewport_px.y > 0.0) {
            return Err(ProjectionError::EmptyViewport);
        }
        // Tests for zero are exact: projections are built with these zeros.
        let rows = ProjectionRows::read(clip_from_view)?;
        // The divisor of the image: a constant, or the distance along −z.
        let [.., w_from_z, w_constant] = rows.w;
        if w_from_z == 0.0 && w_constant > 0.0 {
            orthographic(&rows, viewport_px)
        } else if w_constant == 0.0 && w_from_z < 0.0 {
            perspective(&rows, viewport_px)
        } else if w_from_z == 0.0 && w_constant == 0.0 {
            Err(ProjectionError::Degenerate)
        } else if w_from_z < 0.0 {
            // The eye is before or behind the origin.
            Err(ProjectionError::Sheared)
        } else {
            Err(ProjectionError::LooksBackwards)
        }
    }

    /// Returns `true` if `p` is inside the field of view.
    #[inline]
    pub fn contains(&self, p: Vec3) -> bool {
        match self {
            Self::Perspective(camera) => camera.contains(p),
            Self::Orthographic(camera) => camera.contains(p),
        }
    }

    /// Aspect ratio of the sampling pattern (§3.4) for square pixels; 1 for an orthographic camera.
    #[inline]
    pub fn aspect_ratio(&self, p: Vec3) -> Real {
        match self {
            Self::Perspective(_) => Intrinsics::aspect_ratio(p),
            Self::Orthographic(_) => 1.0,
        }
    }
}

/// The rows of a projection matrix that determine the image, as coefficients of x, y, z and 1.
struct ProjectionRows {
    x: [Real; 4],
    y: [Real; 4],
    w: [Real; 4],
}

impl ProjectionRows {
    fn read(clip_from_view: &Mat4) -> Result<Self, ProjectionError> {
        let columns = clip_from_view.to_cols_array_2d();
        let row = |index: usize| columns.map(|column| column[index]);
        let rows = Self {
            x: row(0),
            y: row(1),
            w: row(3),
        };
        let mut entries = rows.x.iter().chain(&rows.y).chain(&rows.w);
        if !entries.all(|entry| entry.is_finite()) {
            return Err(ProjectionError::NotFinite);
        }
        if rows.x[1] != 0.0 || rows.y[0] != 0.0 || rows.w[0] != 0.0 || rows.w[1] != 0.0 {
            return Err(ProjectionError::Sheared);
        }
        Ok(rows)
    }
}

fn perspective(rows: &ProjectionRows, viewport_px: Vec2) -> Result<Camera, ProjectionError> {
    // A shift grows with depth and moves the edges of the image. An offset would move the eye.
    let ([.., x_shift, x_offset], [.., y_shift, y_offset]) = (rows.x, rows.y);
    if x_offset != 0.0 || y_offset != 0.0 {
        return Err(ProjectionError::Sheared);
    }
    let image = Image::new(rows, [x_shift, y_shift], -rows.w[2], viewport_px)?;
    Ok(Camera::Perspective(Intrinsics {
        focal_px: image.px_per_unit,
        slope_min: image.min,
        slope_max: image.max,
    }))
}

fn orthographic(rows: &ProjectionRows, viewport_px: Vec2) -> Result<Camera, ProjectionError> {
    let ([.., x_oblique, x_offset], [.., y_oblique, y_offset]) = (rows.x, rows.y);
    if x_oblique != 0.0 || y_oblique != 0.0 {
        return Err(ProjectionError::Sheared);
    }
    let image = Image::new(rows, [-x_offset, -y_offset], rows.w[3], viewport_px)?;
    Ok(Camera::Orthographic(OrthographicIntrinsics {
        pixels_per_unit: image.px_per_unit,
        min: image.min,
        max: image.max,
    }))
}

/// Scale and edges of an image, in slopes or in scene units.
struct Image {
    px_per_unit: Vec2,
    min: Vec2,
    max: Vec2,
}

impl Image {
    fn new(
        rows: &ProjectionRows,
        shift: [Real; 2],
        w_scale: Real,
        viewport_px: Vec2,
    ) -> Result<Self, ProjectionError> {
        let (x_scale, y_scale) = (rows.x[0], rows.y[1]);
        let (x_min, x_max) = edges(x_scale, shift[0], w_scale)?;
        // Camera y points down, so the upper edge of clip space has the smallest y.
        let (y_min, y_max) = edges(-y_scale, shift[1], w_scale)?;
        // Clip space is two units across.
        let px_per_unit = Vec2::new(x_scale.abs(), y_scale.abs()) / w_scale * viewport_px * 0.5;
        if !(px_per_unit.is_finite() && px_per_unit.min_element() > 0.0) {
            return Err(ProjectionError::Degenerate);
        }
        Ok(Self {
            px_per_unit,
            min: Vec2::new(x_min, y_min),
            max: Vec2::new(x_max, y_max),
        })
    }
}

/// The two solutions of `scale · slope − shift = ±w_scale`, in order.
fn edges(scale: Real, shift: Real, w_scale: Real) -> Result<(Real, Real), ProjectionError> {
    let one = (shift - w_scale) / scale;
    let other = (shift + w_scale) / scale;
    let (least, greatest) = (one.min(other), one.max(other));
    if least.is_finite() && greatest.is_finite() && least < greatest {
        Ok((least, greatest))
    } else {
        Err(ProjectionError::Degenerate)
    }
}
