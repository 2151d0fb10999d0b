//! Figure 10: level surfaces and gradient of the strength (eq. 13, 14), in a cut through the axis.

use std::path::Path;

use camera_field::double::Intrinsics;
use glam::{DVec3, dvec2};
use serde::Serialize;

use super::profile::{Profile, polar, wide_camera};
use crate::canvas::{Canvas, Color, Rect};
use crate::files::WriteError;

/// The numbers of figure 10.
#[derive(Clone, Debug, Serialize)]
pub struct Figure10 {
    /// Values at several angles off the axis.
    pub angles: Vec<GradientAtAngle>,
}

/// Level surface and gradient at an angle off the axis.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct GradientAtAngle {
    /// Angle off the axis, in degrees.
    pub off_axis_deg: f64,
    /// Distance of the level surface, relative to its distance on the axis.
    pub level_radius_over_axis: f64,
    /// Angle between the gradient and the direction to the camera, in degrees: `atan(3/2 tan φ)`.
    pub gradient_off_camera_deg: f64,
    /// Strength on the level surface, relative to its constant: 1 up to rounding.
    pub strength_over_level: f64,
}

/// The strength of the level surface through (0, 0, 1), for a focal length of 1.
const LEVELS: [f64; 6] = [0.6, 1.0, 1.8, 3.6, 9.0, 36.0];
const WIDEST: f64 = 1.22;

pub(super) fn draw(path: &Path) -> Result<Figure10, WriteError> {
    let camera = wide_camera(1.0);
    let mut canvas = Canvas::new(1000, 640);
    let title = "level surfaces (lines) and gradient (arrows) of the strength";
    canvas.title(dvec2(500.0, 26.0), title);
    draw_profile(&mut canvas, &camera, Rect::new(40.0, 50.0, 920.0, 530.0));
    canvas.save(path)?;
    let angles = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0];
    Ok(Figure10 {
        angles: angles.map(|degrees| gradient_at(&camera, degrees)).to_vec(),
    })
}

fn gradient_at(camera: &Intrinsics, off_axis_deg: f64) -> GradientAtAngle {
    let phi = off_axis_deg.to_radians();
    let radius = |phi: f64| camera.level_radius(1.0, phi.cos());
    let p = polar(radius(phi), phi);
    GradientAtAngle {
        off_axis_deg,
        level_radius_over_axis: radius(phi) / radius(0.0),
        gradient_off_camera_deg: camera.gradient(p).angle_between(-p).to_degrees(),
        strength_over_level: camera.strength(p),
    }
}

fn draw_profile(canvas: &mut Canvas, camera: &Intrinsics, area: Rect) {
    let profile = Profile {
        area,
        camera_px: dvec2(area.center().x, area.max().y - 30.0),
        px_per_unit: 330.0,
    };
    // The strength as a shade, within the field of view.
    canvas.shade(area, |pixel| {
        let p = profile.unplace(area.min + pixel);
        if p.z > 0.0 && p.x.abs() <= WIDEST.tan() * p.z {
            Color::scale(0.12 + 0.09 * camera.strength(p).max(1e-9).ln())
        } else {
            Color::WHITE
        }
    });
    canvas.clip_to(Some(area));
    for side in [-WIDEST, WIDEST] {
        canvas.line(
            profile.camera_px,
            profile.place(polar(9.0, side)),
            1.5,
            Color::INK,
        );
    }
    // Level surfaces.
    for level in LEVELS {
        let radius = |phi: f64| camera.level_radius(level, phi.cos());
        profile.polar_curve(canvas, [-WIDEST, WIDEST], 2.0, Color::BLUE, radius);
    }
    // Gradients on all but the innermost.
    for &level in &LEVELS[..5] {
        for step in -5..=5 {
            let phi = f64::from(step) * 0.215;
            let p = polar(camera.level_radius(level, phi.cos()), phi);
            draw_gradient(canvas, &profile, p, camera.gradient(p));
        }
    }
    profile.draw_camera(canvas);
    canvas.clip_to(None);
    canvas.frame(area, Color::GRAY);
    let below = dvec2(area.center().x, area.max().y + 20.0);
    let lines = [
        "orange: gradient, the way the density grows fastest;  dashes: towards the camera",
        "they agree on the axis; off the axis the angle between them is atan(3/2 tan phi)",
    ];
    canvas.captions(below, &lines);
}

/// The direction of the gradient, and a dashed line towards the camera.
fn draw_gradient(canvas: &mut Canvas, profile: &Profile, p: DVec3, gradient: DVec3) {
    let at = profile.place(p);
    let to_camera = (profile.camera_px - at).normalize();
    for dash in 0..4 {
        let [from, to] = [0.0, 5.0].map(|end| at + to_camera * (f64::from(dash) * 10.0 + end));
        canvas.line(from, to, 1.5, Color::INK);
    }
    // The gradient's length says nothing here: all arrows have one.
    let along = (profile.place(p + gradient.normalize() * 1e-3) - at).normalize();
    canvas.arrow(at, at + along * 38.0, 2.2, Color::ORANGE);
    canvas.dot(at, 2.5, Color::INK);
}
