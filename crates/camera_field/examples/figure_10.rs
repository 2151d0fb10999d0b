//! Figure 10: level surfaces and gradient of the strength (eq. 13, 14), in a plane through the axis.
//!
//! `cargo run -p camera_field --example figure_10 -- paper-out`
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "drawing takes angles and allocates; selection does not run here"
)]

mod drawing;

use camera_field::double::Intrinsics;
use drawing::{
    Area, Color, Fallible, OTHER, OURS, arrow, blues, contains, curve, draw, flat, plane, polar,
    shade, wide_camera,
};
use glam::{dvec2, dvec3};

const ANGLES_DEG: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0];
/// Strengths of the drawn level surfaces, for a focal length of 1.
const LEVELS: [f64; 5] = [0.6, 1.0, 1.8, 3.6, 9.0];
/// Half of the drawn field of view, in radians.
const WIDEST: f64 = 1.22;

fn main() -> Fallible {
    let camera = wide_camera(1.0);
    println!("off axis    level radius / axis    gradient off camera    strength / level");
    for degrees in ANGLES_DEG {
        let [radius, turn_deg, strength] = gradient_at(&camera, degrees);
        println!("{degrees:>5} deg{radius:>23.4}{turn_deg:>19.3} deg{strength:>20.12}");
    }
    draw("figure_10.svg", (920, 560), |area| draw_cut(area, &camera))
}

/// Returns three numbers at an angle off the axis: the distance of the level surface, relative to that on the axis; the
/// angle between gradient and camera direction, `atan(3/2 tan φ)`, in degrees; the strength, relative to the level.
fn gradient_at(camera: &Intrinsics, off_axis_deg: f64) -> [f64; 3] {
    let phi = off_axis_deg.to_radians();
    let radius = |phi: f64| camera.level_radius(1.0, phi.cos());
    let p = polar(radius(phi), phi);
    let turn = camera.gradient(p).angle_between(-p);
    [
        radius(phi) / radius(0.0),
        turn.to_degrees(),
        camera.strength(p),
    ]
}

fn draw_cut(area: &Area, camera: &Intrinsics) -> Fallible {
    let title = "strength (shade), level surfaces (blue), gradient (orange)";
    let mut chart = plane(area, title, dvec2(0.0, 0.72), 330.0)?;
    shade(&mut chart, 0.02, |at| {
        let p = dvec3(at.x, 0.0, at.y);
        let is_in_view = p.z > 0.0 && p.x.abs() <= WIDEST.tan() * p.z;
        is_in_view.then(|| blues(0.12 + 0.09 * camera.strength(p).ln()))
    })?;
    for level in LEVELS {
        let at = |phi: f64| polar(camera.level_radius(level, phi.cos()), phi);
        let angles = (-100..=100).map(|step| WIDEST * f64::from(step) / 100.0);
        let points = angles.map(|phi| flat(at(phi)));
        curve(&mut chart, points, OURS.stroke_width(2))?;
        for step in -5..=5 {
            let p = at(f64::from(step) * 0.215);
            let along = flat(camera.gradient(p).normalize()) * 0.11;
            if contains(&chart, flat(p)) {
                arrow(&mut chart, flat(p), flat(p) + along, OTHER)?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_surfaces_and_gradients_match_their_formulas() {
        for degrees in ANGLES_DEG {
            let [_, turn_deg, strength] = gradient_at(&wide_camera(1.0), degrees);
            assert!((strength - 1.0).abs() < 1e-12, "{degrees}: {strength}");
            let expected = (1.5 * degrees.to_radians().tan()).atan();
            let error = turn_deg - expected.to_degrees();
            assert!(error.abs() < 1e-5, "{degrees}: {turn_deg}");
        }
    }
}
