//! Figure 11: the sampling pattern perpendicular to the sight ray, and its aspect ratio (§3.4).
//!
//! `cargo run -p camera_field --example figure_11 -- paper-out`
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "drawing takes angles and allocates; selection does not run here"
)]

mod drawing;

use core::f64::consts::TAU;

use camera_field::double::Intrinsics;
use drawing::{Area, Color, Fallible, OTHER, curve, draw, fill, plane, polar};
use glam::{DVec2, dvec2, dvec3};

/// The pattern of one sample at an angle off the axis: a round pixel, projected onto the plane perpendicular to the
/// sight ray.
#[derive(Clone, Copy, Debug)]
struct PatternAtAngle {
    /// The paper's aspect ratio, `cos φ`.
    cos_phi: f64,
    /// Width over height of the exact pattern, for a focal length of 100 pixels.
    measured_at_100_px: f64,
    /// Width over height of the exact pattern, for a focal length of 1000 pixels.
    measured_at_1000_px: f64,
}

const ANGLES_DEG: [f64; 8] = [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0];

fn main() -> Fallible {
    println!("off axis      cos phi    measured, 100 px    measured, 1000 px");
    for degrees in ANGLES_DEG {
        let at = pattern_at(degrees);
        println!(
            "{degrees:>5} deg{:>12.6}{:>20.6}{:>21.6}",
            at.cos_phi, at.measured_at_100_px, at.measured_at_1000_px
        );
    }
    draw("figure_11.svg", (560, 220), draw_patterns)
}

fn pattern_at(off_axis_deg: f64) -> PatternAtAngle {
    let phi = off_axis_deg.to_radians();
    let measured = |focal_px: f64| {
        let pattern = pattern(phi, 0.5 / focal_px);
        extent(&pattern, |p| p.x) / extent(&pattern, |p| p.y)
    };
    PatternAtAngle {
        cos_phi: Intrinsics::aspect_ratio(polar(1.0, phi)),
        measured_at_100_px: measured(100.0),
        measured_at_1000_px: measured(1000.0),
    }
}

fn extent(points: &[DVec2], coordinate: impl Fn(&DVec2) -> f64) -> f64 {
    let values = || points.iter().map(&coordinate);
    values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
}

/// Outline of a round pixel of the image at `φ`, projected from the camera onto a plane through the pixel's centre. The
/// plane is perpendicular to the sight ray, with x along the image's radius. Lengths are in focal lengths.
fn pattern(phi: f64, radius: f64) -> Vec<DVec2> {
    let center = dvec3(phi.tan(), 0.0, 1.0);
    let sight = center.normalize();
    let u_phi = dvec3(phi.cos(), 0.0, -phi.sin());
    let point = |step: u32| {
        let on_pixel = DVec2::from_angle(f64::from(step) / 720.0 * TAU) * radius;
        // Intersection of the ray and the plane.
        let ray = center + on_pixel.extend(0.0);
        let offset = ray * (center.length() / ray.dot(sight)) - center;
        dvec2(offset.dot(u_phi), offset.y)
    };
    (0..720).map(point).collect()
}

/// Draws patterns along the sight ray, each scaled to one height.
fn draw_patterns(area: &Area) -> Fallible {
    let title = "one sample at 0, 30, 60 and 75 degrees, seen along the sight ray";
    let mut chart = plane(area, title, dvec2(1.5, 0.0), 130.0)?;
    for (index, degrees) in [0.0_f64, 30.0, 60.0, 75.0].into_iter().enumerate() {
        let outline = pattern(degrees.to_radians(), 1e-3);
        let scale = 0.8 / extent(&outline, |p| p.y);
        let place = |p: &DVec2| *p * scale + dvec2(index as f64, 0.0);
        fill(&mut chart, outline.iter().map(place), OTHER.mix(0.4))?;
        curve(&mut chart, outline.iter().map(place), OTHER.stroke_width(2))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pattern_aspect_ratio_is_the_cosine() {
        for at in ANGLES_DEG.map(pattern_at) {
            let [coarse, fine] = [at.measured_at_100_px, at.measured_at_1000_px];
            assert!((coarse / at.cos_phi - 1.0).abs() < 1e-5, "{at:?}");
            assert!((fine / at.cos_phi - 1.0).abs() < 1e-6, "{at:?}");
        }
    }
}
