//! Tests of the camera of a layered depth image (eq. 19–21, appendices iv and v).
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests may use angles, powers and vectors; selection does not run here"
)]

mod common;

use camera_field::double::{
    FieldLine, Intrinsics, ParallelCamera, Pose, PosedCamera, compound_field, convergent_point,
    equivalent_camera,
};
use common::{assert_close, unit_vectors, wide_camera};
use glam::{DVec2, DVec3};
use proptest::prelude::*;

/// Two cameras that look along z, in front of the plane z = 0.
fn parallel_pair() -> impl Strategy<Value = [ParallelCamera; 2]> {
    let one = || {
        (
            100.0..900.0_f64,
            -2.0..2.0_f64,
            -2.0..2.0_f64,
            1.0..20.0_f64,
        )
            .prop_map(|(focal_px, x, y, depth)| ParallelCamera {
                origin: DVec3::new(x, y, -depth),
                focal_px,
                depth,
            })
    };
    [one(), one()]
}

fn looking_along_z(focal_px: f64, origin: DVec3) -> PosedCamera {
    let pose = Pose::looking_at(origin, origin + DVec3::Z, DVec3::NEG_Y);
    PosedCamera {
        intrinsics: wide_camera(DVec2::splat(focal_px)),
        pose,
    }
}

fn posed(cameras: &[ParallelCamera]) -> Vec<PosedCamera> {
    cameras
        .iter()
        .map(|c| looking_along_z(c.focal_px, c.origin))
        .collect()
}

proptest! {
    /// Compares with (21) and appendix v as the paper prints them, for two cameras.
    #[test]
    fn equivalent_camera_matches_the_printed_equations([a, b] in parallel_pair()) {
        let (fa2, fb2) = (a.focal_px.powi(2), b.focal_px.powi(2));
        let weights = b.depth.powi(3) * fa2 + a.depth.powi(3) * fb2;
        let origin = (b.depth.powi(3) * fa2 * a.origin + a.depth.powi(3) * fb2 * b.origin) / weights;
        let squares = b.depth.powi(2) * fa2 + a.depth.powi(2) * fb2;
        let depth = (b.depth.powi(3) * fa2 * a.depth + a.depth.powi(3) * fb2 * b.depth) / weights;
        let found = equivalent_camera(&[a, b]).unwrap();
        prop_assert!(found.origin.distance(origin) <= 1e-12 * (1.0 + origin.length()));
        assert_close(found.focal_px, squares.powf(1.5) / weights, found.focal_px, 1e-12);
        assert_close(found.depth, depth, depth, 1e-12);
        assert_close(found.depth, -found.origin.z, depth, 1e-12);
    }

    /// On the plane, the field of the equivalent camera equals the compound field.
    #[test]
    fn equivalent_camera_has_the_compound_field_on_the_plane(
        cameras in parallel_pair(), x in -3.0..3.0_f64, y in -3.0..3.0_f64,
    ) {
        let found = equivalent_camera(&cameras).unwrap();
        let equivalent = looking_along_z(found.focal_px, found.origin);
        let p = DVec3::new(x, y, 0.0);
        let both = posed(&cameras);
        prop_assume!(both.iter().all(|camera| camera.contains(p)));
        let compound = compound_field(&both, p);
        prop_assert!((equivalent.field(p) - compound).length() <= 1e-9 * compound.length());
        // Appendix iv: the density towards the plane's normal.
        let density: f64 = cameras.iter().map(|c| (c.focal_px / c.depth).powi(2)).sum();
        assert_close(compound.dot(DVec3::NEG_Z), density, density, 1e-9);
    }

    /// If the lines meet in a point, the least-squares point is this point.
    #[test]
    fn convergent_point_generalises_the_parallel_case(cameras in parallel_pair()) {
        let both = posed(&cameras);
        let grid = (-3..=3).flat_map(|x| (-3..=3).map(move |y| DVec3::new(x.into(), y.into(), 0.0)));
        let lines: Vec<_> = grid
            .filter(|&p| both.iter().all(|camera| camera.contains(p)))
            .filter_map(|p| FieldLine::through(&both, p))
            .collect();
        prop_assume!(lines.len() > 8);
        let found = convergent_point(lines).unwrap();
        let expected = equivalent_camera(&cameras).unwrap().origin;
        prop_assert!(found.distance(expected) <= 1e-6 * (1.0 + expected.length()));
    }

    /// For cameras that are not parallel, no point nearby has a smaller sum of squared moments.
    #[test]
    fn convergent_point_has_the_least_squared_moments(
        toe_in in -0.6..0.6_f64, apart in 0.5..3.0_f64, direction in unit_vectors(),
    ) {
        let cameras = [(-apart, toe_in), (apart, -toe_in)].map(|(x, turn)| PosedCamera {
            intrinsics: wide_camera(DVec2::splat(300.0)),
            pose: Pose::looking_at(
                DVec3::X * x, DVec3::new(x + turn.sin(), 0.0, turn.cos()), DVec3::NEG_Y,
            ),
        });
        let points = (0..60).map(|i| {
            let t = f64::from(i);
            DVec3::new((t * 1.7).sin() * 2.0, (t * 2.3).cos() * 2.0, 6.0 + (t * 0.9).sin() * 2.0)
        });
        let lines: Vec<_> = points.filter_map(|p| FieldLine::through(&cameras, p)).collect();
        let moment = |line: &FieldLine, q: DVec3| line.strength * line.distance(q);
        let sum = |q: DVec3| lines.iter().map(|line| moment(line, q).powi(2)).sum::<f64>();
        let found = convergent_point(lines.iter().copied()).unwrap();
        for step in [1e-3, 1e-2, 1.0] {
            prop_assert!(sum(found) <= sum(found + direction * step));
        }
    }
}

#[test]
fn no_convergent_point_without_lines_that_meet() {
    assert_eq!(convergent_point([]), None);
    assert_eq!(equivalent_camera(&[]), None);
    let line = |x: f64| FieldLine {
        point: DVec3::X * x,
        direction: DVec3::Z,
        strength: 1.0,
    };
    assert_eq!(convergent_point([line(0.0), line(1.0)]), None);
    let behind = Intrinsics::centered(300.0, DVec2::splat(200.0));
    let camera = PosedCamera {
        intrinsics: behind,
        pose: Pose::looking_at(DVec3::ZERO, DVec3::Z, DVec3::NEG_Y),
    };
    assert_eq!(FieldLine::through(&[camera], DVec3::NEG_Z), None);
}
