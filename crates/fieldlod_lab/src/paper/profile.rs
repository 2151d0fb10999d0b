//! A cut through the optical axis: the camera below, depth upwards.

use camera_field::double::Intrinsics;
use glam::{DVec2, DVec3, dvec2, dvec3};

use crate::canvas::{Canvas, Color, Rect};

/// A camera whose image reaches 85° to each side: the figures choose how much of it to show.
pub(super) fn wide_camera(focal_px: f64) -> Intrinsics {
    Intrinsics {
        focal_px: DVec2::splat(focal_px),
        slope_min: DVec2::splat(-12.0),
        slope_max: DVec2::splat(12.0),
    }
}

/// The point at distance `rho`, `phi` off the axis, in the plane of the cut.
pub(super) fn polar(rho: f64, phi: f64) -> DVec3 {
    dvec3(phi.sin(), 0.0, phi.cos()) * rho
}

/// Places points of the cut in a picture.
pub(super) struct Profile {
    pub(super) area: Rect,
    pub(super) camera_px: DVec2,
    pub(super) px_per_unit: f64,
}

impl Profile {
    pub(super) fn place(&self, p: DVec3) -> DVec2 {
        self.camera_px + dvec2(p.x, -p.z) * self.px_per_unit
    }

    pub(super) fn unplace(&self, pixel: DVec2) -> DVec3 {
        let offset = (pixel - self.camera_px) / self.px_per_unit;
        dvec3(offset.x, 0.0, -offset.y)
    }

    /// The curve through the points at `radius(φ)`, between two angles.
    pub(super) fn polar_curve(
        &self,
        canvas: &mut Canvas,
        angles: [f64; 2],
        width: f64,
        color: Color,
        radius: impl Fn(f64) -> f64,
    ) {
        let points: Vec<DVec2> = (0..=200)
            .map(|step| angles[0] + (angles[1] - angles[0]) * f64::from(step) / 200.0)
            .map(|phi| self.place(polar(radius(phi), phi)))
            .collect();
        canvas.polyline(&points, width, color);
    }

    /// The optical axis and the centre of projection.
    pub(super) fn draw_camera(&self, canvas: &mut Canvas) {
        let top = dvec2(self.camera_px.x, self.area.min.y + 6.0);
        canvas.arrow(self.camera_px, top, 1.5, Color::INK);
        canvas.dot(self.camera_px, 5.0, Color::INK);
        let below = self.camera_px + dvec2(0.0, 16.0);
        canvas.caption(below, "centre of projection");
    }
}
