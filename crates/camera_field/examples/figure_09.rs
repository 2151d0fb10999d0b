//! Figure 9: the curl equals the growth of the density away from the axis at constant distance (eq. 12).
//!
//! `cargo run -p camera_field --example figure_09 -- paper-out`
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "drawing takes angles and allocates; selection does not run here"
)]

mod drawing;

use camera_field::double::Intrinsics;
use drawing::{Area, Fallible, INK, arrow, blues, draw, plane, polar, shade, wide_camera};
use glam::{DVec2, dvec2, dvec3};

const ANGLES_DEG: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0];

fn main() -> Fallible {
    let camera = wide_camera(100.0);
    println!("off axis    strength / axis    curl / strength    growth / strength");
    for degrees in ANGLES_DEG {
        let [strength, curl, growth] = curl_at(&camera, degrees);
        println!("{degrees:>5} deg{strength:>19.4}{curl:>19.6}{growth:>21.6}");
    }
    draw("figure_09.svg", (520, 520), |area| draw_curl(area, &camera))
}

/// At an angle off the axis, at distance 1: the strength, relative to that on the axis; `|curl c| / c` by eq. 12; and
/// the growth of the strength along φ by central differences, `(1/ρ ∂c/∂φ) / c`.
fn curl_at(camera: &Intrinsics, off_axis_deg: f64) -> [f64; 3] {
    let phi = off_axis_deg.to_radians();
    let strength = |phi: f64| camera.strength(polar(1.0, phi));
    let step = 1e-6;
    let growth = (strength(phi + step) - strength(phi - step)) / (2.0 * step);
    let curl = camera.curl_magnitude(polar(1.0, phi));
    [
        strength(phi) / strength(0.0),
        curl / strength(phi),
        growth / strength(phi),
    ]
}

/// Draws the curl on the plane z = 1 as arrows, and its length as a shade.
fn draw_curl(area: &Area, camera: &Intrinsics) -> Fallible {
    let title = "curl on a plane across the axis, 45 degrees to each side";
    let mut chart = plane(area, title, DVec2::ZERO, 240.0)?;
    let greatest = camera.curl_magnitude(dvec3(1.0, 1.0, 1.0));
    shade(&mut chart, 1.0 / 30.0, |at| {
        let is_inside = at.abs().max_element() < 1.0;
        is_inside.then(|| blues(camera.curl_magnitude(at.extend(1.0)) / greatest * 0.75))
    })?;
    for (row, column) in (0..12).flat_map(|row| (0..12).map(move |column| (row, column))) {
        let middle = (dvec2(f64::from(column), f64::from(row)) + 0.5) / 6.0 - 1.0;
        let half = camera.curl(middle.extend(1.0)).truncate() / greatest * 0.075;
        if half.length() > 1e-3 {
            arrow(&mut chart, middle - half, middle + half, INK)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curl_is_the_growth_of_the_strength() {
        for degrees in ANGLES_DEG {
            let [_, curl, growth] = curl_at(&wide_camera(100.0), degrees);
            assert!((curl - growth).abs() < 1e-6 * (1.0 + curl), "{degrees}");
        }
    }
}
