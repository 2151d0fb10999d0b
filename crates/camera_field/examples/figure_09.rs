//! Figure 9: the curl, and how it predicts the density at constant distance (eq. 12).
//!
//! `cargo run -p camera_field --example figure_09 -- paper-out`
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "drawing takes angles and allocates; selection does not run here"
)]

mod drawing;

use std::path::Path;

use camera_field::double::Intrinsics;
use drawing::{
    Area, Fallible, GRAY, INK, OTHER, OURS, arrow, blues, curve, dot, flat, out_folder, picture,
    plane, polar, save, shade, wide_camera,
};
use glam::{DVec2, dvec2, dvec3};
use plotters::style::Color;

/// The curl at an angle off the axis, at distance 1.
#[derive(Clone, Copy, Debug)]
struct CurlAtAngle {
    off_axis_deg: f64,
    /// Strength, relative to that on the axis at the same distance.
    strength_over_axis: f64,
    /// `|curl c| / c` by eq. 12, per unit of length.
    curl_over_strength: f64,
    /// Growth of the strength along φ by central differences, `(1/ρ ∂c/∂φ) / c`.
    growth_over_strength: f64,
}

fn main() -> Fallible {
    println!("off axis    strength / axis    curl / strength    growth / strength");
    for at in figure(&out_folder()?)? {
        println!(
            "{:>5} deg{:>19.4}{:>19.6}{:>21.6}",
            at.off_axis_deg, at.strength_over_axis, at.curl_over_strength, at.growth_over_strength
        );
    }
    Ok(())
}

/// Draws `figure_09.svg` and returns the numbers.
fn figure(folder: &Path) -> Fallible<Vec<CurlAtAngle>> {
    let camera = wide_camera(100.0);
    let path = folder.join("figure_09.svg");
    let whole = picture(&path, (1080, 520))?;
    let (left, right) = whole.split_horizontally(520);
    draw_curl(&left, &camera)?;
    draw_rays(&right)?;
    save(&whole, &path)?;
    let angles = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0];
    Ok(angles.map(|degrees| curl_at(&camera, degrees)).into())
}

fn curl_at(camera: &Intrinsics, off_axis_deg: f64) -> CurlAtAngle {
    let phi = off_axis_deg.to_radians();
    let strength = |phi: f64| camera.strength(polar(1.0, phi));
    let step = 1e-6;
    let growth = (strength(phi + step) - strength(phi - step)) / (2.0 * step);
    CurlAtAngle {
        off_axis_deg,
        strength_over_axis: strength(phi) / strength(0.0),
        curl_over_strength: camera.curl_magnitude(polar(1.0, phi)) / strength(phi),
        growth_over_strength: growth / strength(phi),
    }
}

/// The curl on the plane z = 1, to 45° off the axis: arrows over its length as a shade.
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

/// Rays at equal steps on the image: at one distance they are closer together off the axis.
fn draw_rays(area: &Area) -> Fallible {
    let title = "rays at equal steps on the image (orange); blue: equal distances";
    let mut chart = plane(area, title, dvec2(0.0, 0.6), 245.0)?;
    let widest: f64 = 1.2;
    for step in -26..=26 {
        let ray = dvec3(f64::from(step) / 26.0 * widest.tan(), 0.0, 1.0).normalize();
        curve(&mut chart, [DVec2::ZERO, flat(ray * 1.2)], GRAY)?;
    }
    for radius in [0.5, 1.0] {
        let angles = (-100..=100).map(|step| widest * f64::from(step) / 100.0);
        let points = angles.map(|phi| flat(polar(radius, phi)));
        curve(&mut chart, points, OURS.stroke_width(2))?;
    }
    let image = [dvec2(-0.7, 0.27), dvec2(0.7, 0.27)];
    curve(&mut chart, image, OTHER.stroke_width(2))?;
    dot(&mut chart, DVec2::ZERO, 5, INK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curl_is_the_growth_of_the_strength() {
        let folder = tempfile::tempdir().unwrap();
        for at in figure(folder.path()).unwrap() {
            let tolerance = 1e-6 * (1.0 + at.curl_over_strength);
            let error = at.curl_over_strength - at.growth_over_strength;
            assert!(error.abs() < tolerance, "{at:?}");
        }
        assert!(folder.path().join("figure_09.svg").exists());
    }
}
