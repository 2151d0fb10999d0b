//! Texture filters and mip levels (§4.1.2, §4.1.4), statistics (§4.2.1) and levels of detail (§4.2.2).

use crate::common::*;

proptest! {
    /// Compares the filter kernel with the points where rays of neighbouring pixels meet the surface.
    #[test]
    fn filter_kernel_is_the_texture_between_neighbouring_pixels(
        (p, normal) in facing(0.02), texel in 1e-3..1.0_f64, skew in -0.5..0.5_f64,
    ) {
        let camera = wide_camera(dvec2(1e8, 2e8));
        let (a, b) = frame(normal);
        let (u, v) = (a * texel, (b + a * skew) * texel);
        let kernel = FilterKernel::new(&camera, p, u, v).unwrap();
        let texture = |step: DVec2| {
            let ray = ((camera.project_px(p) + step) / camera.focal_px).extend(1.0);
            let offset = ray * (p.dot(normal) / ray.dot(normal)) - p;
            let across = offset.dot(b) / texel;
            dvec2(offset.dot(a) / texel - across * skew, across)
        };
        for (axis, found) in [(DVec2::X, kernel.texels_per_px_x), (DVec2::Y, kernel.texels_per_px_y)] {
            let expected = texture(axis) - texture(DVec2::ZERO);
            prop_assert!((expected - found).length() <= 1e-3 * expected.length());
        }
        // The area of the kernel is texels per unit area, divided by c·n.
        let area = 1.0 / u.cross(v).length() / camera.projection_factor(p, normal);
        assert_close(kernel.area_texels(), area, area, 1e-9);
    }

    /// At the mip level, one texel covers one square pixel.
    #[test]
    fn mip_level_matches_texel_to_pixel_size(
        factor in 1e-3..1e6_f64, texels in 1e-3..1e9_f64, bias in -2.0..2.0_f64,
    ) {
        let level = mip_level(factor, texels, bias);
        assert_close(texels / 4.0_f64.powf(level - bias), factor, factor, 1e-9);
        assert_close(filter_dimension(factor).powi(2) * factor, 1.0, 1.0, 1e-12);
    }

    /// Compares the closed forms of eq. 17 and 18 with a midpoint rule on 1600 pieces.
    #[test]
    fn mean_and_deviation_match_numerical_integration(
        (p, normal) in facing(0.02), size in 0.01..0.5_f64,
    ) {
        let camera = square_camera(100.0);
        let (a, b) = frame(normal);
        let (u, v) = (a * (size * p.z), b * (size * p.z));
        let triangle = [p, p + u, p + v];
        prop_assume!(triangle.iter().all(|&corner| camera.contains(corner)));
        let mut samples = SurfaceSamples::default();
        samples.add_triangle(&camera, triangle);
        let density = |(s, t): (f64, f64)| camera.projection_factor(p + u * s + v * t, normal);
        let densities = midpoints(40).into_iter().map(density);
        let count = densities.len() as f64;
        let mean = densities.clone().sum::<f64>() / count;
        let variance = densities.map(|density| (density - mean).powi(2)).sum::<f64>() / count;
        assert_close(samples.area, 0.5 * u.length() * v.length(), samples.area, 1e-9);
        assert_close(samples.mean(), mean, mean, 3e-3);
        assert_close(samples.deviation(), variance.sqrt(), mean, 1e-2);
    }

    /// Triangles that face away or are behind the camera add nothing.
    #[test]
    fn statistics_skip_invisible_triangles(p in points()) {
        let camera = square_camera(100.0);
        let (a, b) = frame(p);
        let corners = [p, p + a * (0.01 * p.z), p + b * (0.01 * p.z)];
        let mut samples = SurfaceSamples::default();
        samples.add_triangle(&camera, corners);
        samples.add_triangle(&camera, corners.map(|corner| -corner));
        prop_assert_eq!(samples, SurfaceSamples::default());
        prop_assert_eq!((samples.mean(), samples.deviation()), (0.0, 0.0));
    }
}

/// Centroids of the `n²` equal parts of the triangle `s, t ≥ 0, s + t ≤ 1`.
fn midpoints(n: u32) -> Vec<(f64, f64)> {
    let cells = (0..n).flat_map(|row| (0..n - row).map(move |column| (column, row)));
    let centroids = cells.flat_map(|(column, row)| {
        let parts = if column + row + 1 < n {
            &[1.0, 2.0][..]
        } else {
            &[1.0]
        };
        let at = move |cell: u32, third: f64| (f64::from(cell) + third / 3.0) / f64::from(n);
        parts
            .iter()
            .map(move |&third| (at(column, third), at(row, third)))
    });
    centroids.collect()
}

/// The samples of a square of side 2 that is turned around y.
fn square_samples(turn: f64, depth: f64) -> SurfaceSamples {
    let camera = Intrinsics::centered(500.0, DVec2::splat(1000.0));
    let corner = |x: f64, y: f64| dvec3(x * turn.cos(), y, depth + x * turn.sin());
    let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    let [a, b, c, d] = corners.map(|(x, y)| corner(x, y));
    let mut samples = SurfaceSamples::default();
    samples.add_triangle(&camera, [a, b, c]);
    samples.add_triangle(&camera, [a, c, d]);
    samples
}

#[test]
fn best_placement_is_near_and_frontal() {
    let placements = [(1.2, 4.0), (0.0, 4.0), (0.0, 6.0)].map(|(turn, z)| square_samples(turn, z));
    assert_eq!(best_placement(&placements), Some(1));
    assert_eq!(best_placement(&[]), None);
    assert_eq!(
        best_placement(&[placements[1]; 3]),
        Some(0),
        "the first of equals"
    );
    // A square perpendicular to the axis is sampled evenly, with the density f²/z².
    let mean = placements[1].mean();
    assert_close(mean, 500.0 * 500.0 / 16.0, mean, 1e-12);
    assert!(placements[1].deviation() < 1e-3 * mean);
}

/// With statistics of visible surface only, a camera close to a small piece would win.
#[test]
fn whole_surface_statistics_count_unseen_surface() {
    let sees = |flux_px2: f64, density: f64, area: f64| SurfaceSamples {
        flux_px2,
        squared_density: flux_px2 * density,
        area,
    };
    let placements = [sees(100.0, 100.0, 1.0), sees(200.0, 50.0, 4.0)];
    assert_eq!(best_placement(&placements), Some(0));
    let on_whole = placements.map(|samples| samples.over_whole_surface(4.0));
    assert_eq!(best_placement(&on_whole), Some(1));
}

#[test]
fn edge_on_surfaces_have_no_finite_filter() {
    for factor in [0.0, -3.0, f64::NAN] {
        assert_eq!(filter_dimension(factor), f64::INFINITY);
        assert_eq!(mip_level(factor, 100.0, 0.0), f64::INFINITY);
    }
    let edge_on = FilterKernel::new(&square_camera(1.0), DVec3::Z, DVec3::Z, DVec3::X);
    assert_eq!(edge_on, None);
}
