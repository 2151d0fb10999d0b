//! Figure 11: the sampling pattern across the sight ray, and its aspect ratio (§3.4).

use core::f64::consts::TAU;
use std::path::Path;

use camera_field::double::Intrinsics;
use glam::{DVec2, dvec2, dvec3};
use serde::Serialize;

use super::profile::{Profile, polar};
use crate::canvas::{Canvas, Color, Rect};
use crate::files::WriteError;
use crate::plot::{Axis, Plot, draw_legend};

/// The numbers of figure 11.
#[derive(Clone, Debug, Serialize)]
pub struct Figure11 {
    /// Values at several angles off the axis.
    pub angles: Vec<PatternAtAngle>,
}

/// The pattern of one sample at an angle off the axis: the image of a round pixel on the plane
/// across the sight ray.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PatternAtAngle {
    /// Angle off the axis, in degrees.
    pub off_axis_deg: f64,
    /// The paper's aspect ratio, `cos φ`.
    pub cos_phi: f64,
    /// Width over height of the exact pattern, for a focal length of 100 pixels.
    pub measured_at_100_px: f64,
    /// The same for 1000 pixels.
    pub measured_at_1000_px: f64,
}

const ANGLES_DEG: [f64; 8] = [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0];

pub(super) fn draw(path: &Path) -> Result<Figure11, WriteError> {
    let angles = ANGLES_DEG.map(pattern_at).to_vec();
    let mut canvas = Canvas::new(1240, 640);
    canvas.title(
        dvec2(300.0, 26.0),
        "one sample on the image and off the axis",
    );
    draw_cut(&mut canvas, Rect::new(40.0, 50.0, 520.0, 300.0));
    draw_patterns(&mut canvas, Rect::new(40.0, 410.0, 520.0, 160.0));
    canvas.title(dvec2(920.0, 26.0), "aspect ratio of the sampling pattern");
    draw_chart(&mut canvas, &angles);
    canvas.save(path)?;
    Ok(Figure11 { angles })
}

fn pattern_at(off_axis_deg: f64) -> PatternAtAngle {
    let phi = off_axis_deg.to_radians();
    let measured = |focal_px: f64| {
        let pattern = pattern(phi, 0.5 / focal_px);
        extent(&pattern, |p| p.x) / extent(&pattern, |p| p.y)
    };
    PatternAtAngle {
        off_axis_deg,
        cos_phi: Intrinsics::aspect_ratio(polar(1.0, phi)),
        measured_at_100_px: measured(100.0),
        measured_at_1000_px: measured(1000.0),
    }
}

fn extent(points: &[DVec2], coordinate: impl Fn(&DVec2) -> f64) -> f64 {
    let values = || points.iter().map(&coordinate);
    values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
}

/// Outline of a round pixel of the image at `φ`, projected from the camera onto the plane across
/// the sight ray through the pixel's centre; x along the image's radius. The radius is in units of
/// the focal length, and so is the result.
fn pattern(phi: f64, radius: f64) -> Vec<DVec2> {
    let center = dvec3(phi.tan(), 0.0, 1.0);
    let sight = center.normalize();
    let u_phi = dvec3(phi.cos(), 0.0, -phi.sin());
    (0..720)
        .map(|step| {
            let on_pixel = DVec2::from_angle(f64::from(step) / 720.0 * TAU) * radius;
            // Where the ray meets the plane through the centre, across the sight ray.
            let ray = center + on_pixel.extend(0.0);
            let offset = ray * (center.length() / ray.dot(sight)) - center;
            dvec2(offset.dot(u_phi), offset.y)
        })
        .collect()
}

/// The cut of Fig. 11c: equal pixels on the image, and the planes across their sight rays.
fn draw_cut(canvas: &mut Canvas, area: Rect) {
    let profile = Profile {
        area,
        camera_px: dvec2(area.min.x + 110.0, area.max().y - 30.0),
        px_per_unit: 190.0,
    };
    canvas.clip_to(Some(area));
    let image = [-0.5, 2.6].map(|x| profile.place(dvec3(x, 0.0, 1.0)));
    canvas.polyline(&image, 1.5, Color::GRAY);
    // Three pixels, each with the rays through its edges.
    for degrees in [0.0_f64, 30.0, 60.0] {
        let phi = degrees.to_radians();
        let half = 0.14;
        let on_image = |side: f64| dvec3(phi.tan() + side, 0.0, 1.0);
        let [left, right] = [on_image(-half), on_image(half)];
        for edge in [left, right] {
            canvas.line(
                profile.camera_px,
                profile.place(edge * 1.02),
                1.0,
                Color::PALE,
            );
        }
        // The pixel on the image, and its pattern across the sight ray.
        let center = profile.place(on_image(0.0));
        canvas.line(profile.camera_px, center, 1.5, Color::INK);
        canvas.line(profile.place(left), profile.place(right), 5.0, Color::BLUE);
        let reach = extent(&pattern(phi, half), |p| p.x) * 0.5;
        let across = dvec3(phi.cos(), 0.0, -phi.sin()) * reach;
        let ends = [on_image(0.0) - across, on_image(0.0) + across].map(|p| profile.place(p));
        canvas.polyline(&ends, 5.0, Color::ORANGE);
        let label = format!("{degrees:.0} deg");
        canvas.caption(center - dvec2(0.0, 24.0), &label);
    }
    canvas.clip_to(None);
    canvas.dot(profile.camera_px, 5.0, Color::INK);
    let at = dvec2(area.min.x + 200.0, area.max().y - 20.0);
    draw_legend(
        canvas,
        at,
        &[
            ("sample on the image", Color::BLUE),
            ("across the sight ray", Color::ORANGE),
        ],
    );
}

/// The patterns seen along the sight ray, each scaled to one height.
fn draw_patterns(canvas: &mut Canvas, area: Rect) {
    let shown = [0.0_f64, 30.0, 60.0, 75.0];
    for (index, degrees) in shown.into_iter().enumerate() {
        // The outline, scaled to one height.
        let outline = pattern(degrees.to_radians(), 1e-3);
        let scale = 110.0 / extent(&outline, |p| p.y);
        let center = area.min + dvec2(65.0 + 130.0 * index as f64, 70.0);
        let points: Vec<DVec2> = outline.iter().map(|p| center + *p * scale).collect();
        canvas.polygon(&points, Color::ORANGE.faded(110));
        canvas.loop_line(&points, 2.0, Color::ORANGE);
        let label = format!("{degrees:.0} deg: {:.2}", degrees.to_radians().cos());
        canvas.caption(center + dvec2(0.0, 78.0), &label);
    }
    let below = dvec2(area.center().x, area.max().y + 20.0);
    let text = "seen along the sight ray; image radius to the right";
    canvas.caption(below, text);
}

fn draw_chart(canvas: &mut Canvas, angles: &[PatternAtAngle]) {
    let chart = Plot {
        area: Rect::new(680.0, 80.0, 500.0, 440.0),
        x: Axis::linear("angle off the axis, degrees", 0.0..=90.0, 15.0, 0),
        y: Axis::linear("width / height", 0.0..=1.0, 0.2, 1),
    };
    chart.draw_frame(canvas);
    // The formula as a curve, what was measured as dots.
    let cosine: Vec<DVec2> = (0..=90)
        .map(|degrees| dvec2(degrees.into(), f64::from(degrees).to_radians().cos()))
        .collect();
    chart.curve(canvas, &cosine, Color::BLUE);
    let measured: Vec<DVec2> = angles
        .iter()
        .map(|at| dvec2(at.off_axis_deg, at.measured_at_1000_px))
        .collect();
    chart.dots(canvas, &measured, Color::ORANGE);
    draw_legend(
        canvas,
        dvec2(710.0, 460.0),
        &[
            ("cos phi", Color::BLUE),
            ("measured, f = 1000 px (dots)", Color::ORANGE),
        ],
    );
}
