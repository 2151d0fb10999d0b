//! Nanoseconds per evaluation of each quantity: scalar `f32`, one thread.
//!
//! Every quantity is checked against the `f64` build of the same formula before it is timed. A pass
//! runs over many points, and the harness reports the time of one point.
#![expect(
    clippy::disallowed_types,
    reason = "the points are allocated before the timing starts"
)]

use std::hint::black_box;
use std::time::Instant;

use camera_field::{Intrinsics, double};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DVec2, DVec3, Vec2, Vec3, Vec3Swizzles};

const POINTS: usize = 512;

/// Points of a 1920 × 1080 view between depth 2 and 50, with normals towards the camera.
fn points(camera: &Intrinsics) -> Vec<(Vec3, Vec3)> {
    let share = |index: usize, factor: f32| (index as f32 * factor).fract();
    (0..POINTS)
        .map(|index| {
            let across = Vec2::new(share(index, 0.618_034), share(index, 0.754_877));
            // Points keep away from the edge, where a rounded point may be outside of the view.
            let across = across * 0.998 + 0.001;
            let slope = camera.slope_min + across * (camera.slope_max - camera.slope_min);
            let p = slope.extend(1.0) * (2.0 + 48.0 * share(index, 0.569_84));
            let tilt = Vec3::new(share(index, 0.31), share(index, 0.57), 0.0) - 0.5;
            (p, (tilt - p.normalize()).normalize())
        })
        .collect()
}

fn double_camera(camera: &Intrinsics) -> double::Intrinsics {
    double::Intrinsics {
        focal_px: camera.focal_px.as_dvec2(),
        slope_min: camera.slope_min.as_dvec2() - DVec2::splat(1e-6),
        slope_max: camera.slope_max.as_dvec2() + DVec2::splat(1e-6),
    }
}

/// Checks `quantity` against `expected` at every point, then times it.
fn time(
    criterion: &mut Criterion,
    name: &str,
    quantity: impl Fn(&Intrinsics, Vec3, Vec3) -> f32,
    expected: impl Fn(&double::Intrinsics, DVec3, DVec3) -> f64,
) {
    let camera = Intrinsics::centered(935.0, Vec2::new(1920.0, 1080.0));
    let exact = double_camera(&camera);
    let points = points(&camera);
    for &(p, n) in &points {
        let value = f64::from(quantity(&camera, p, n));
        let truth = expected(&exact, p.as_dvec3(), n.as_dvec3());
        assert!(
            (value - truth).abs() <= 2e-3 * truth.abs() + 1e-3,
            "{name} at {p}: {value} is not {truth}"
        );
    }
    criterion.bench_function(name, |bencher| {
        bencher.iter_custom(|rounds| {
            let started = Instant::now();
            for round in 0..rounds {
                let &(p, n) = black_box(&points[round as usize % POINTS]);
                black_box(quantity(black_box(&camera), p, n));
            }
            started.elapsed()
        });
    });
}

/// Compiles each formula for `f32` and for `f64`, and times the first. A formula gets the camera, a point and a normal.
macro_rules! benches {
    ($($name:literal: |$c:pat_param, $p:ident, $n:pat_param| $formula:expr;)+) => {
        fn formulas(criterion: &mut Criterion) {
            $(time(
                criterion,
                $name,
                |$c, $p, $n| {
                    #[allow(unused_imports, reason = "methods need no import")]
                    use camera_field::*;
                    $formula
                },
                |$c, $p, $n| {
                    #[allow(unused_imports, reason = "methods need no import")]
                    use camera_field::double::*;
                    $formula
                },
            );)+
        }
    };
}

/// A right triangle at a point, with legs of 0.1 units.
macro_rules! triangle {
    ($p:expr, $n:expr) => {{
        let (a, b) = $n.any_orthonormal_pair();
        [$p, $p + a * 0.1, $p + b * 0.1]
    }};
}

/// A disk with a radius of 0.3 units.
macro_rules! surfel {
    ($p:expr, $n:expr) => {
        Surfel {
            center: $p,
            normal: $n,
            radius: 0.3,
        }
    };
}

benches! {
    "the loop alone": |_, p, _| p.z;
    "strength (5)": |c, p, _| c.strength(p);
    "field (6)": |c, p, _| c.field(p).z;
    "curl (12)": |c, p, _| c.curl_magnitude(p);
    "gradient (14)": |c, p, _| c.gradient(p).z;
    "projection factor (16)": |c, p, n| c.projection_factor(p, n);
    "aspect ratio": |_, p, _| Intrinsics::aspect_ratio(p);
    "pixel scale": |c, p, _| c.pixel_scale(p);
    "planar field (4)": |c, p, _| {
        let (slope_min, slope_max) = (c.slope_min.x, c.slope_max.x);
        PlanarCamera { focal_px: c.focal_px.x, slope_min, slope_max }.field(p.xz()).y
    };
    "spherical field (7), with conversion":
        |c, p, _| c.spherical_field(Spherical::from_cartesian(p));
    "level radius (13)": |c, p, _| c.level_radius(50.0, Intrinsics::aspect_ratio(p));
    "pattern aspect ratio": |c, p, _| c.pattern_aspect_ratio(p);
    // The second camera is moved from the first by a tenth of the point's position.
    "equivalent camera of two (21, App. v)": |c, p, _| {
        let camera = |origin, depth| ParallelCamera { origin, focal_px: c.focal_px.x, depth };
        let pair = [camera(p * 0.0, 50.0), camera(p * 0.1, 40.0)];
        equivalent_camera(&pair).map_or(0.0, |camera| camera.focal_px + camera.origin.x)
    };
    "flux through a triangle (8)": |c, p, n| c.flux_through_triangle_in_view(triangle!(p, n));
    "flux through a clipped triangle (8)":
        |c, p, n| c.flux_through_triangle(triangle!(p * 0.9, n));
    "flux through a disk": |c, p, n| c.flux_through_disk(p, n, 0.3);
    "mean and deviation of a triangle (17, 18)": |c, p, n| {
        let mut samples = SurfaceSamples::default();
        samples.add_triangle(c, triangle!(p * 0.9, n));
        samples.mean() + 1e-3 * samples.deviation()
    };
    "splat area (15)": |c, p, n| splat_area_px2(c.projection_factor(p, n), 3.0);
    "splat kernel, exact": |c, p, n| SplatKernel::new(c, &surfel!(p, n)).area_px2();
    "splat kernel, the paper's steps":
        |c, p, n| SplatKernel::paper(c, &surfel!(p, n)).affine_area_px2();
    "texture filter kernel": |c, p, n| {
        let (u, v) = n.any_orthonormal_pair();
        FilterKernel::new(c, p, u, v).map_or(0.0, |kernel| 1e6 * kernel.area_texels())
    };
    "mip level": |c, p, n| mip_level(c.projection_factor(p, n), 1e6, 0.0);
    "touches sphere": |c, p, _| if Camera::Perspective(*c).touches_sphere(p, 0.3) { 1.0 } else { 0.0 };
    "strength over a sphere": |c, p, _| Camera::Perspective(*c).strength_over_sphere(p, 0.3);
    "pixel scale over a sphere": |c, p, _| Camera::Perspective(*c).pixel_scale_over_sphere(p, 0.3);
}

criterion_group!(field, formulas);
criterion_main!(field);
