//! The camera of a layered depth image (eq. 19–21, appendices iv and v).

use crate::common::*;

/// Two cameras that look along z, in front of the plane z = 0.
fn parallel_pair() -> impl Strategy<Value = [ParallelCamera; 2]> {
    let one = (
        100.0..900.0_f64,
        -2.0..2.0_f64,
        -2.0..2.0_f64,
        1.0..20.0_f64,
    );
    let one = one.prop_map(|(focal_px, x, y, depth)| ParallelCamera {
        origin: dvec3(x, y, -depth),
        focal_px,
        depth,
    });
    prop::array::uniform2(one)
}

fn posed_in_parallel(camera: &ParallelCamera) -> PosedCamera {
    posed(
        square_camera(camera.focal_px),
        camera.origin,
        camera.origin + DVec3::Z,
    )
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
        assert_near(found.origin, origin, 1.0 + origin.length(), 1e-12);
        assert_close(found.focal_px, squares.powf(1.5) / weights, found.focal_px, 1e-12);
        assert_close(found.depth, depth, depth, 1e-12);
        assert_close(found.depth, -found.origin.z, depth, 1e-12);
    }

    /// On the plane, the field of the equivalent camera equals the compound field.
    #[test]
    fn equivalent_camera_matches_compound_field_on_plane(
        cameras in parallel_pair(), x in -3.0..3.0_f64, y in -3.0..3.0_f64,
    ) {
        let equivalent = posed_in_parallel(&equivalent_camera(&cameras).unwrap());
        let p = dvec3(x, y, 0.0);
        let both = cameras.each_ref().map(posed_in_parallel);
        prop_assume!(both.iter().all(|camera| camera.contains(p)));
        let compound = compound_field(&both, p);
        assert_near(equivalent.field(p), compound, compound.length(), 1e-9);
        // Appendix iv: the density towards the plane's normal.
        let density: f64 = cameras.iter().map(|c| (c.focal_px / c.depth).powi(2)).sum();
        assert_close(compound.dot(DVec3::NEG_Z), density, density, 1e-9);
    }

    /// If the lines meet in a point, the least-squares point is this point.
    #[test]
    fn convergent_point_generalises_the_parallel_case(cameras in parallel_pair()) {
        let both = cameras.each_ref().map(posed_in_parallel);
        let grid = (-3..=3).flat_map(|x| (-3..=3).map(move |y| dvec3(x.into(), y.into(), 0.0)));
        let in_both = grid.filter(|&p| both.iter().all(|camera| camera.contains(p)));
        let lines: Vec<_> = in_both.filter_map(|p| FieldLine::through(&both, p)).collect();
        prop_assume!(lines.len() > 8);
        let expected = equivalent_camera(&cameras).unwrap().origin;
        assert_near(convergent_point(lines).unwrap(), expected, 1.0 + expected.length(), 1e-6);
    }

    /// For cameras that are not parallel, no point nearby has a smaller sum of squared moments.
    #[test]
    fn convergent_point_has_the_least_squared_moments(
        toe_in in -0.6..0.6_f64, apart in 0.5..3.0_f64, direction in unit_vectors(),
    ) {
        let cameras = [(-apart, toe_in), (apart, -toe_in)].map(|(x, turn)| {
            posed(square_camera(300.0), DVec3::X * x, dvec3(x + turn.sin(), 0.0, turn.cos()))
        });
        let points = (0..60).map(|i| {
            let t = f64::from(i);
            dvec3((t * 1.7).sin() * 2.0, (t * 2.3).cos() * 2.0, 6.0 + (t * 0.9).sin() * 2.0)
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
fn strong_and_weak_lines_meet() {
    for strength in [1e-60, 1e60] {
        let line = |direction: DVec3| FieldLine {
            point: DVec3::ONE - direction * 5.0,
            direction,
            strength,
        };
        let found = convergent_point([line(DVec3::X), line(DVec3::Z)]).unwrap();
        assert!(found.distance(DVec3::ONE) < 1e-9, "{found}");
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
    let camera = posed(square_camera(300.0), DVec3::ZERO, DVec3::Z);
    assert_eq!(FieldLine::through(&[camera], DVec3::NEG_Z), None);
}
