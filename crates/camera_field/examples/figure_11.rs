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

const ANGLES_DEG: [f64; 8] = [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0];

fn main() -> Fallible {
    println!("off axis      cos phi    measured, 100 px    measured, 1000 px");
    for degrees in ANGLES_DEG {
        let [cos_phi, coarse, fine] = pattern_at(degrees);
        println!("{degrees:>5} deg{cos_phi:>12.6}{coarse:>20.6}{fine:>21.6}");
    }
    draw("figure_11.svg", (560, 220), draw_patterns)
}

/// Aspect ratio of the pattern at an angle off the axis: the paper's `cos φ`, and measured for focal lengths of 100 and
/// 1000 pixels.
fn pattern_at(off_axis_deg: f64) -> [f64; 3] {
    let phi = off_axis_deg.to_radians();
    let measured = |focal_px: f64| {
        let pattern = pattern(phi, 0.5 / focal_px);
        extent(&pattern, |p| p.x) / extent(&pattern, |p| p.y)
    };
    let cos_phi = Intrinsics::aspect_ratio(polar(1.0, phi));
    [cos_phi, measured(100.0), measured(1000.0)]
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
        for [cos_phi, coarse, fine] in ANGLES_DEG.map(pattern_at) {
            assert!((coarse / cos_phi - 1.0).abs() < 1e-5, "{coarse} {cos_phi}");
            assert!((fine / cos_phi - 1.0).abs() < 1e-6, "{fine} {cos_phi}");
        }
    }
}
