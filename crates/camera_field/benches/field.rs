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

use camera_field::{
    FilterKernel, Intrinsics, ParallelCamera, PlanarCamera, Spherical, SplatKernel, SurfaceSamples,
    Surfel, double, equivalent_camera, mip_level, splat_area_px2,
};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DVec2, DVec3, Vec2, Vec3};

const POINTS: usize = 512;
const RADIUS: f32 = 0.3;

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

fn point_quantities(criterion: &mut Criterion) {
    time(criterion, "the loop alone", |_, p, _| p.z, |_, p, _| p.z);
    time(
        criterion,
        "strength (5)",
        |c, p, _| c.strength(p),
        |c, p, _| c.strength(p),
    );
    time(
        criterion,
        "field (6)",
        |c, p, _| c.field(p).z,
        |c, p, _| c.field(p).z,
    );
    time(
        criterion,
        "curl (12)",
        |c, p, _| c.curl_magnitude(p),
        |c, p, _| c.curl_magnitude(p),
    );
    time(
        criterion,
        "gradient (14)",
        |c, p, _| c.gradient(p).z,
        |c, p, _| c.gradient(p).z,
    );
    time(
        criterion,
        "projection factor (16)",
        Intrinsics::projection_factor,
        double::Intrinsics::projection_factor,
    );
    time(
        criterion,
        "aspect ratio",
        |_, p, _| Intrinsics::aspect_ratio(p),
        |_, p, _| double::Intrinsics::aspect_ratio(p),
    );
    time(
        criterion,
        "pixel scale",
        |c, p, _| c.pixel_scale(p),
        |c, p, _| c.pixel_scale(p),
    );
    time(
        criterion,
        "planar field (4)",
        |c, p, _| planar(c).field(Vec2::new(p.x, p.z)).y,
        |c, p, _| -c.focal_px.x / p.z,
    );
}

fn spherical_forms(criterion: &mut Criterion) {
    time(
        criterion,
        "spherical field (7), with conversion",
        |c, p, _| c.spherical_field(Spherical::from_cartesian(p)),
        |c, p, _| c.spherical_field(double::Spherical::from_cartesian(p)),
    );
    time(
        criterion,
        "level radius (13)",
        |c, p, _| c.level_radius(50.0, Intrinsics::aspect_ratio(p)),
        |c, p, _| c.level_radius(50.0, double::Intrinsics::aspect_ratio(p)),
    );
    time(
        criterion,
        "pattern aspect ratio",
        |c, p, _| c.pattern_aspect_ratio(p),
        |c, p, _| c.pattern_aspect_ratio(p),
    );
}

/// Times two parallel cameras. The second is moved from the first by a tenth of the point's position.
fn layered_depth_images(criterion: &mut Criterion) {
    time(
        criterion,
        "equivalent camera of two (21, App. v)",
        |c, p, _| {
            let pair =
                [(Vec3::ZERO, 50.0), (p * 0.1, 40.0)].map(|(origin, depth)| ParallelCamera {
                    origin,
                    focal_px: c.focal_px.x,
                    depth,
                });
            equivalent_camera(&pair).map_or(0.0, |camera| camera.focal_px + camera.origin.x)
        },
        |c, p, _| {
            let pair =
                [(DVec3::ZERO, 50.0), (p * f64::from(0.1_f32), 40.0)].map(|(origin, depth)| {
                    double::ParallelCamera {
                        origin,
                        focal_px: c.focal_px.x,
                        depth,
                    }
                });
            double::equivalent_camera(&pair).map_or(0.0, |camera| camera.focal_px + camera.origin.x)
        },
    );
}

fn planar(camera: &Intrinsics) -> PlanarCamera {
    PlanarCamera {
        focal_px: camera.focal_px.x,
        slope_min: camera.slope_min.x,
        slope_max: camera.slope_max.x,
    }
}

fn integrals(criterion: &mut Criterion) {
    time(
        criterion,
        "flux through a triangle (8)",
        |c, p, n| c.flux_through_triangle_in_view(triangle(p, n)),
        |c, p, n| c.flux_through_triangle_in_view(triangle_double(p, n)),
    );
    time(
        criterion,
        "flux through a clipped triangle (8)",
        |c, p, n| c.flux_through_triangle(triangle(p * 0.9, n)),
        |c, p, n| c.flux_through_triangle(triangle_double(p * f64::from(0.9_f32), n)),
    );
    time(
        criterion,
        "flux through a disk",
        |c, p, n| c.flux_through_disk(p, n, RADIUS),
        |c, p, n| c.flux_through_disk(p, n, RADIUS.into()),
    );
    time(
        criterion,
        "mean and deviation of a triangle (17, 18)",
        |c, p, n| {
            let mut samples = SurfaceSamples::default();
            samples.add_triangle(c, triangle(p * 0.9, n));
            samples.mean() + 1e-3 * samples.deviation()
        },
        |c, p, n| {
            let mut samples = double::SurfaceSamples::default();
            samples.add_triangle(c, triangle_double(p * f64::from(0.9_f32), n));
            samples.mean() + 1e-3 * samples.deviation()
        },
    );
}

fn triangle(p: Vec3, n: Vec3) -> [Vec3; 3] {
    let (a, b) = n.any_orthonormal_pair();
    [p, p + a * 0.1, p + b * 0.1]
}

fn triangle_double(p: DVec3, n: DVec3) -> [DVec3; 3] {
    triangle(p.as_vec3(), n.as_vec3()).map(DVec3::from)
}

fn applications(criterion: &mut Criterion) {
    time(
        criterion,
        "splat area (15)",
        |c, p, n| splat_area_px2(c.projection_factor(p, n), 3.0),
        |c, p, n| c.projection_factor(p, n) / 3.0,
    );
    time(
        criterion,
        "splat kernel, exact",
        |c, p, n| {
            let surfel = Surfel {
                center: p,
                normal: n,
                radius: RADIUS,
            };
            SplatKernel::new(c, &surfel).area_px2()
        },
        |c, p, n| c.flux_through_disk(p, n, RADIUS.into()),
    );
    time(
        criterion,
        "splat kernel, the paper's steps",
        |c, p, n| {
            let surfel = Surfel {
                center: p,
                normal: n,
                radius: RADIUS,
            };
            SplatKernel::paper(c, &surfel).affine_area_px2()
        },
        |c, p, n| {
            let radius = f64::from(RADIUS);
            std::f64::consts::PI * radius * radius * c.projection_factor(p, n)
        },
    );
    time(
        criterion,
        "texture filter kernel",
        |c, p, n| {
            let (u, v) = n.any_orthonormal_pair();
            FilterKernel::new(c, p, u, v).map_or(0.0, |kernel| 1e6 * kernel.area_texels())
        },
        |c, p, n| 1e6 / c.projection_factor(p, n),
    );
    time(
        criterion,
        "mip level",
        |c, p, n| mip_level(c.projection_factor(p, n), 1e6, 0.0),
        |c, p, n| double::mip_level(c.projection_factor(p, n), 1e6, 0.0),
    );
}

fn sphere_bounds(criterion: &mut Criterion) {
    time(
        criterion,
        "touches sphere",
        |c, p, _| f32::from(u8::from(c.touches_sphere(p, RADIUS))),
        |c, p, _| f64::from(u8::from(c.touches_sphere(p, RADIUS.into()))),
    );
    time(
        criterion,
        "strength over a sphere",
        |c, p, _| c.strength_over_sphere(p, RADIUS).or_infinity(),
        |c, p, _| c.strength_over_sphere(p, RADIUS.into()).or_infinity(),
    );
    time(
        criterion,
        "pixel scale over a sphere",
        |c, p, _| c.pixel_scale_over_sphere(p, RADIUS).or_infinity(),
        |c, p, _| c.pixel_scale_over_sphere(p, RADIUS.into()).or_infinity(),
    );
}

criterion_group!(
    benches,
    point_quantities,
    spherical_forms,
    layered_depth_images,
    integrals,
    applications,
    sphere_bounds
);
criterion_main!(benches);
