//! Tests of texture filters and mip levels (§4.1.2, §4.1.4), statistics (§4.2.1) and criteria (§4.1.5).
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests may use angles, powers and vectors; selection does not run here"
)]

mod common;

use camera_field::double::{
    FilterKernel, Intrinsics, SphereBound, SurfaceSamples, best_placement, coarsest_level,
    filter_dimension, mip_level,
};
use common::{assert_close, points, unit_vectors, wide_camera, wide_cameras};
use glam::{DMat2, DVec2, DVec3};
use proptest::prelude::*;

proptest! {
    /// Compares the filter kernel with the points where rays of neighbouring pixels meet the surface.
    #[test]
    fn filter_kernel_is_the_texture_between_neighbouring_pixels(
        p in points(), normal in unit_vectors(), texel in 1e-3..1.0_f64, skew in -0.5..0.5_f64,
    ) {
        prop_assume!(normal.dot(p.normalize()).abs() > 0.02);
        let camera = wide_camera(DVec2::new(1e8, 2e8));
        let (a, b) = common::frame(normal);
        let (u, v) = (a * texel, (b + a * skew) * texel);
        let kernel = FilterKernel::new(&camera, p, u, v).unwrap();
        let texture = |step: DVec2| {
            let ray = ((camera.project_px(p) + step) / camera.focal_px).extend(1.0);
            let offset = ray * (p.dot(normal) / ray.dot(normal)) - p;
            let across = offset.dot(b) / texel;
            DVec2::new(offset.dot(a) / texel - across * skew, across)
        };
        let x = texture(DVec2::X) - texture(DVec2::ZERO);
        let y = texture(DVec2::Y) - texture(DVec2::ZERO);
        prop_assert!((x - kernel.texels_per_px_x).length() <= 1e-3 * x.length());
        prop_assert!((y - kernel.texels_per_px_y).length() <= 1e-3 * y.length());
        // The area of the kernel is texels per unit area, divided by c·n.
        let per_area = 1.0 / u.cross(v).length();
        let area = per_area / camera.projection_factor(p, normal).abs();
        assert_close(kernel.area_texels(), area, area, 1e-9);
    }

    /// The filter kernel times the splat kernel is the identity.
    #[test]
    fn filter_kernel_is_the_inverse_of_the_splat(
        camera in wide_cameras(), p in points(), normal in unit_vectors(),
    ) {
        let (a, b) = common::frame(normal);
        prop_assume!(normal.dot(p.normalize()).abs() > 0.02);
        let kernel = FilterKernel::new(&camera, p, a, b).unwrap();
        let filter = DMat2::from_cols(kernel.texels_per_px_x, kernel.texels_per_px_y);
        let splat = DMat2::from_cols(camera.displace_px(p, a), camera.displace_px(p, b));
        let identity = filter * splat;
        prop_assert!((identity - DMat2::IDENTITY).to_cols_array().iter().all(|e| e.abs() < 1e-6));
    }

    /// At the mip level, one texel covers one square pixel.
    #[test]
    fn mip_level_makes_a_texel_as_large_as_a_pixel(
        factor in 1e-3..1e6_f64, texels in 1e-3..1e9_f64, bias in -2.0..2.0_f64,
    ) {
        let level = mip_level(factor, texels, bias);
        let texels_at_level = texels / 4.0_f64.powf(level - bias);
        assert_close(texels_at_level, factor, factor, 1e-9);
        assert_close(filter_dimension(factor).powi(2) * factor, 1.0, 1.0, 1e-12);
    }

    /// Compares the closed forms of eq. 17 and 18 with a midpoint rule on 1600 pieces.
    #[test]
    fn mean_and_deviation_match_numerical_integration(
        p in points(), normal in unit_vectors(), size in 0.01..0.5_f64,
    ) {
        let normal = if normal.dot(p) > 0.0 { -normal } else { normal };
        prop_assume!(-normal.dot(p.normalize()) > 0.02);
        let camera = wide_camera(DVec2::splat(100.0));
        let (a, b) = common::frame(normal);
        let (u, v) = (a * (size * p.z), b * (size * p.z));
        let mut samples = SurfaceSamples::default();
        samples.add_triangle(&camera, [p, p + u, p + v]);
        let inside = [p, p + u, p + v].iter().all(|&corner| camera.contains(corner));
        prop_assume!(inside);
        let densities = midpoints(40).map(|(s, t)| camera.projection_factor(p + u * s + v * t, normal));
        let count = densities.len() as f64;
        let mean = densities.clone().sum::<f64>() / count;
        let variance = densities.map(|density| (density - mean).powi(2)).sum::<f64>() / count;
        assert_close(samples.area, 0.5 * u.length() * v.length(), samples.area, 1e-9);
        assert_close(samples.mean(), mean, mean, 3e-3);
        assert_close(samples.deviation(), variance.sqrt(), mean, 1e-2);
    }

    /// Compares eq. 17 and 18 with rays. Each sample is one square pixel of flux. The number of
    /// samples is `∫ c·da`, and the sum of their densities is `∫ (c·n)² da`.
    #[test]
    fn mean_and_deviation_match_counted_samples(
        p in points(), normal in unit_vectors(), size in 0.02..0.4_f64,
    ) {
        let normal = if normal.dot(p) > 0.0 { -normal } else { normal };
        prop_assume!(-normal.dot(p.normalize()) > 0.1);
        let (a, b) = common::frame(normal);
        let triangle = [p, p + a * (size * p.z), p + b * (size * p.z)];
        let unit = wide_camera(DVec2::ONE).flux_through_triangle_in_view(triangle);
        let camera = wide_camera(DVec2::splat((10_000.0 / unit).sqrt()));
        let corners = triangle.map(|corner| camera.project_px(corner));
        let reach_px = corners[1].distance(corners[0]).max(corners[2].distance(corners[0])) + 2.0;
        prop_assume!(reach_px < 1500.0 && triangle.iter().all(|&corner| camera.contains(corner)));
        let densities = core::cell::Cell::new(0.0);
        let count = common::count_samples(&camera, corners[0], reach_px, |ray| {
            let hit = ray * (p.dot(normal) / ray.dot(normal));
            let hits = common::ray_meets_triangle(ray, triangle);
            if hits {
                densities.set(densities.get() + camera.projection_factor(hit, normal));
            }
            hits
        });
        let mut samples = SurfaceSamples::default();
        samples.add_triangle(&camera, triangle);
        assert_close(samples.flux_px2, count, count, 0.05);
        assert_close(samples.squared_density, densities.get(), densities.get(), 0.05);
    }

    /// Triangles that face away or are behind the camera add nothing.
    #[test]
    fn statistics_skip_invisible_triangles(p in points()) {
        let camera = wide_camera(DVec2::splat(100.0));
        let (a, b) = common::frame(p);
        let (a, b) = (a * (0.01 * p.z), b * (0.01 * p.z));
        let mut samples = SurfaceSamples::default();
        for triangle in [[p, p + a, p + b], [p, p + b, p + a]] {
            if camera.flux_through_triangle(triangle) <= 0.0 {
                samples.add_triangle(&camera, triangle);
            }
            samples.add_triangle(&camera, triangle.map(|corner| -corner));
        }
        prop_assert_eq!(samples, SurfaceSamples::default());
        prop_assert_eq!((samples.mean(), samples.deviation()), (0.0, 0.0));
    }
}

/// Centroids of the `n²` equal parts of the triangle `s, t ≥ 0, s + t ≤ 1`.
fn midpoints(n: u32) -> impl ExactSizeIterator<Item = (f64, f64)> + Clone {
    let mut centroids = Vec::new();
    let step = 1.0 / f64::from(n);
    for row in 0..n {
        for column in 0..n - row {
            let (s, t) = (f64::from(column) * step, f64::from(row) * step);
            centroids.push((s + step / 3.0, t + step / 3.0));
            if column + row + 1 < n {
                centroids.push((s + step * 2.0 / 3.0, t + step * 2.0 / 3.0));
            }
        }
    }
    centroids.into_iter()
}

/// The samples of a square of side 2 that is turned around y.
fn square_samples(turn: f64, depth: f64) -> SurfaceSamples {
    let camera = Intrinsics::centered(500.0, DVec2::splat(1000.0));
    let corner = |x: f64, y: f64| DVec3::new(x * turn.cos(), y, depth + x * turn.sin());
    let [a, b, c, d] = [
        corner(-1.0, -1.0),
        corner(-1.0, 1.0),
        corner(1.0, 1.0),
        corner(1.0, -1.0),
    ];
    let mut samples = SurfaceSamples::default();
    samples.add_triangle(&camera, [a, b, c]);
    samples.add_triangle(&camera, [a, c, d]);
    samples
}

#[test]
fn the_best_placement_is_near_and_frontal() {
    let placements = [
        square_samples(1.2, 4.0),
        square_samples(0.0, 4.0),
        square_samples(0.0, 6.0),
    ];
    assert_eq!(best_placement(&placements), Some(1));
    assert_eq!(best_placement(&[]), None);
    assert_eq!(
        best_placement(&[placements[1]; 3]),
        Some(0),
        "the first of equals"
    );
    // A square perpendicular to the axis is sampled evenly, with the density f²/z².
    assert_close(
        placements[1].mean(),
        500.0 * 500.0 / 16.0,
        placements[1].mean(),
        1e-12,
    );
    assert!(placements[1].deviation() < 1e-3 * placements[1].mean());
}

/// With statistics of visible surface only, a camera close to a small piece would win.
#[test]
fn whole_surface_statistics_count_unseen_surface() {
    let seen_little = SurfaceSamples {
        flux_px2: 100.0,
        squared_density: 100.0 * 100.0,
        area: 1.0,
    };
    let seen_all = SurfaceSamples {
        flux_px2: 200.0,
        squared_density: 200.0 * 50.0,
        area: 4.0,
    };
    assert_eq!(best_placement(&[seen_little, seen_all]), Some(0));
    let on_whole = [seen_little, seen_all].map(|samples| samples.over_whole_surface(4.0));
    assert_eq!(best_placement(&on_whole), Some(1));
}

#[test]
fn edge_on_surfaces_have_no_finite_filter() {
    for factor in [0.0, -3.0, f64::NAN] {
        assert_eq!(filter_dimension(factor), f64::INFINITY);
        assert_eq!(mip_level(factor, 100.0, 0.0), f64::INFINITY);
    }
    let camera = wide_camera(DVec2::ONE);
    let edge_on = FilterKernel::new(&camera, DVec3::Z, DVec3::Z, DVec3::X);
    assert_eq!(edge_on, None);
}

#[test]
fn criteria_match_the_field() {
    let camera = wide_camera(DVec2::splat(100.0));
    let p = DVec3::new(3.0, 4.0, 5.0);
    let criteria = camera.lod_criteria(p, DVec3::NEG_Z).unwrap();
    assert_eq!(criteria.strength, camera.strength(p));
    assert_eq!(
        criteria.projection_factor,
        camera.projection_factor(p, DVec3::NEG_Z)
    );
    assert_eq!(criteria.aspect_ratio, Intrinsics::aspect_ratio(p));
    // 3 tan φ / ρ, with tan φ = 1 here.
    assert_close(criteria.relative_curl, 3.0 / p.length(), 1.0, 1e-12);
    assert_eq!(camera.lod_criteria(-p, DVec3::NEG_Z), None);
}

#[test]
fn the_coarsest_level_within_the_error_is_chosen() {
    let errors = [0.0, 0.01, 0.1, 1.0];
    let level = |scale| coarsest_level(&errors, SphereBound::Bounded(scale), 1.0);
    assert_eq!(
        [level(0.5), level(5.0), level(50.0), level(500.0)],
        [3, 2, 1, 0]
    );
    assert_eq!(level(0.0), 3, "outside the view");
    assert_eq!(coarsest_level(&errors, SphereBound::Unbounded, 1.0), 0);
    assert_eq!(coarsest_level(&[], SphereBound::Bounded(1.0), 1.0), 0);
}
