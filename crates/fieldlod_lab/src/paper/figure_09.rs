//! Figure 9: the curl, and what it says of the density at constant distance (eq. 12).

use std::path::Path;

use camera_field::double::Intrinsics;
use glam::{DVec2, dvec2, dvec3};
use serde::Serialize;

use super::profile::{Profile, polar, wide_camera};
use crate::canvas::{Canvas, Color, Rect};
use crate::files::WriteError;

/// The numbers of figure 9.
#[derive(Clone, Debug, Serialize)]
pub struct Figure9 {
    /// Values at several angles off the axis.
    pub angles: Vec<CurlAtAngle>,
}

/// The curl at an angle off the axis, at distance 1, relative to the strength there.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CurlAtAngle {
    /// Angle off the axis, in degrees.
    pub off_axis_deg: f64,
    /// Strength, relative to that on the axis at the same distance.
    pub strength_over_axis: f64,
    /// `|curl c| / c` by eq. 12, per unit of length.
    pub curl_over_strength: f64,
    /// Growth of the strength along φ by central differences, `(1/ρ ∂c/∂φ) / c`.
    pub growth_over_strength: f64,
}

pub(super) fn draw(path: &Path) -> Result<Figure9, WriteError> {
    // Left the curl itself, right what it says of neighbouring rays.
    let camera = wide_camera(100.0);
    let mut canvas = Canvas::new(1240, 620);
    canvas.title(dvec2(310.0, 28.0), "curl on a plane across the axis");
    draw_curl(&mut canvas, &camera, Rect::new(70.0, 60.0, 480.0, 480.0));
    canvas.title(dvec2(920.0, 28.0), "a cut through the axis");
    draw_sampling_lines(&mut canvas, Rect::new(640.0, 60.0, 560.0, 480.0));
    canvas.save(path)?;
    let angles = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0];
    Ok(Figure9 {
        angles: angles.map(|degrees| curl_at(&camera, degrees)).to_vec(),
    })
}

fn curl_at(camera: &Intrinsics, off_axis_deg: f64) -> CurlAtAngle {
    let phi = off_axis_deg.to_radians();
    let strength = |phi: f64| camera.strength(polar(1.0, phi));
    // By central differences.
    let step = 1e-6;
    let growth = (strength(phi + step) - strength(phi - step)) / (2.0 * step);
    CurlAtAngle {
        off_axis_deg,
        strength_over_axis: strength(phi) / strength(0.0),
        curl_over_strength: camera.curl_magnitude(polar(1.0, phi)) / strength(phi),
        growth_over_strength: growth / strength(phi),
    }
}

/// Arrows of the curl over its length as a shade, on the plane z = 1 to 45° off axis.
fn draw_curl(canvas: &mut Canvas, camera: &Intrinsics, area: Rect) {
    let point = |pixel: DVec2| (pixel / area.size * 2.0 - 1.0).extend(1.0);
    // The curl's length as a shade.
    let greatest = camera.curl_magnitude(dvec3(1.0, 1.0, 1.0));
    canvas.shade(area, |pixel| {
        Color::scale(camera.curl_magnitude(point(pixel)) / greatest * 0.75)
    });
    // The curl as arrows, twelve by twelve.
    for row in 0..12 {
        for column in 0..12 {
            let pixel = dvec2(f64::from(column) + 0.5, f64::from(row) + 0.5) * 40.0;
            let curl = camera.curl(point(pixel)).truncate() / greatest * 36.0;
            let middle = area.min + pixel;
            canvas.arrow(middle - curl * 0.5, middle + curl * 0.5, 1.6, Color::INK);
        }
    }
    canvas.frame(area, Color::GRAY);
    let below = dvec2(area.center().x, area.max().y + 20.0);
    let lines = [
        "arrows: curl c;  shade: its length, 0 on the axis",
        "(edges of the square: 45 deg off axis)",
    ];
    canvas.captions(below, &lines);
}

/// Sight rays at equal steps on the image: at one distance they are closer together off the axis.
fn draw_sampling_lines(canvas: &mut Canvas, area: Rect) {
    let profile = Profile {
        area,
        camera_px: dvec2(area.center().x, area.max().y - 30.0),
        px_per_unit: 360.0,
    };
    let widest: f64 = 1.2;
    canvas.clip_to(Some(area));
    for step in -26..=26 {
        let slope = f64::from(step) / 26.0 * widest.tan();
        let ray = dvec3(slope, 0.0, 1.0).normalize();
        canvas.line(
            profile.camera_px,
            profile.place(ray * 1.8),
            1.0,
            Color::GRAY,
        );
    }
    // Curves of equal distance, and the image plane.
    for radius in [0.5, 1.0] {
        profile.polar_curve(canvas, [-widest, widest], 2.0, Color::BLUE, |_| radius);
    }
    let image_plane = [-1.3, 1.3].map(|x| profile.place(dvec3(x, 0.0, 0.3)));
    canvas.polyline(&image_plane, 2.0, Color::ORANGE);
    profile.draw_camera(canvas);
    canvas.clip_to(None);
    // The field turns, faster further off the axis.
    for phi in [0.25, 0.8] {
        let at = profile.place(polar(1.0, phi));
        canvas.dot(at, 5.0, Color::RED);
        draw_turn(canvas, at - dvec2(0.0, 30.0), 6.0 + 12.0 * phi.tan());
    }
    let below = dvec2(area.center().x, area.max().y + 20.0);
    let lines = [
        "rays at equal steps on the image (orange); blue: equal distance",
        "red: the field turns clockwise, faster where density grows faster",
    ];
    canvas.captions(below, &lines);
}

/// A clockwise arrow around a point.
fn draw_turn(canvas: &mut Canvas, center: DVec2, radius: f64) {
    let at = |angle: f64| center + DVec2::from_angle(angle) * radius;
    let points: Vec<DVec2> = (0..=40)
        .map(|step| at(-2.6 + 4.4 * f64::from(step) / 40.0))
        .collect();
    canvas.polyline(&points, 2.0, Color::RED);
    canvas.arrow(at(1.6), at(2.2), 2.0, Color::RED);
}
