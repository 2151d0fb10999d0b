//! Curves of triangles against image error, and their interpolation at equal error.

use serde::Serialize;

use super::pose::Pose;
use crate::measure::ImageError;
use crate::method::Method;

/// The thresholds of all curves, in pixels. They contain [`COMPARED_AT_PX`](super::COMPARED_AT_PX). 0 draws full detail.
/// Steps are about √2: larger ones interpolate over wider gaps, smaller ones draw more pictures.
pub(super) const THRESHOLDS_PX: [f32; 14] = [
    0.0, 0.15, 0.2, 0.28, 0.4, 0.56, 0.75, 1.0, 1.35, 1.8, 2.5, 3.5, 5.0, 8.0,
];

/// The triangles and the image error of the cut at one threshold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// The threshold, in pixels.
    pub threshold_px: f64,
    /// Triangles of the units in view.
    pub triangles: u64,
    /// The difference of the picture from the reference.
    pub error: ImageError,
}

/// One method at all thresholds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// The method.
    pub method: Method,
    /// The points, from the finest to the coarsest threshold.
    pub points: Vec<Point>,
}

impl Curve {
    /// The point at one of the thresholds.
    pub(super) fn at_threshold(&self, threshold_px: f64) -> Option<&Point> {
        let mut points = self.points.iter();
        points.find(|point| (point.threshold_px - threshold_px).abs() < 1e-4)
    }
}

/// The curves of all methods from one pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseResult {
    /// The pose.
    pub pose: Pose,
    /// One curve per method.
    pub curves: Vec<Curve>,
}

impl PoseResult {
    /// The curve of a method.
    #[must_use]
    pub fn curve(&self, method: Method) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.method == method)
    }
}

/// A measure of image error at which methods are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Root mean squared difference of the picture.
    Rmse,
    /// Mean distance between outlines.
    Silhouette,
    /// Mean of FLIP.
    Flip,
}

impl Measure {
    /// All measures.
    pub const ALL: [Self; 3] = [Self::Rmse, Self::Silhouette, Self::Flip];

    /// A short name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rmse => "image RMSE",
            Self::Silhouette => "silhouette",
            Self::Flip => "FLIP",
        }
    }

    /// The measure's value at a point.
    #[must_use]
    pub fn of(self, point: &Point) -> f64 {
        match self {
            Self::Rmse => point.error.rmse,
            Self::Silhouette => point.error.silhouette_px,
            Self::Flip => point.error.flip.unwrap_or(0.0),
        }
    }
}

/// Interpolates the triangles of a curve at an error, on logarithmic scales; `None` outside of the curve. The curve is
/// made monotone first, because errors jitter by a few per cent. An error below those of all levels costs full detail,
/// if the curve contains it.
pub(super) fn triangles_at_error(curve: &Curve, measure: Measure, error: f64) -> Option<f64> {
    let pair = |point: &Point| (point.triangles as f64, measure.of(point));
    at_error(curve.points.iter().map(pair), error)
}

/// Interpolates the threshold of a curve at a number of triangles; `None` outside of the curve.
pub(super) fn threshold_at_triangles(curve: &Curve, triangles: f64) -> Option<f64> {
    let of_point = |point: &Point| (point.triangles as f64, point.threshold_px);
    let mut points: Vec<(f64, f64)> = curve.points.iter().map(of_point).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pairs = points.windows(2);
    let pair = pairs.find(|pair| pair[0].0 <= triangles && triangles <= pair[1].0)?;
    let [(least, from), (greatest, to)] = [pair[0], pair[1]];
    let share = if greatest > least {
        (triangles - least) / (greatest - least)
    } else {
        0.0
    };
    Some(from + share * (to - from))
}

/// Does the work of [`triangles_at_error`] on pairs of triangles and error.
pub(crate) fn at_error(points: impl Iterator<Item = (f64, f64)>, error: f64) -> Option<f64> {
    // Full detail has no error, and an empty picture no triangles: neither has a logarithm.
    let points: Vec<(f64, f64)> = points.filter(|(cost, _)| *cost > 0.0).collect();
    let (exact, usable): (Vec<_>, Vec<_>) = points.iter().partition(|(_, error)| *error <= 0.0);
    let logs = usable
        .into_iter()
        .map(|(cost, error)| (cost.ln(), error.ln()));
    let mut logs: Vec<(f64, f64)> = logs.collect();
    logs.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
    // Different cuts can have equally many triangles. The sort puts the largest error first, which is the one kept.
    logs.dedup_by_key(|point| point.0);
    let falling = falling(&logs);
    let wanted = error.ln();
    let crossing = |pair: &&[(f64, f64)]| pair[0].1 >= wanted && wanted >= pair[1].1;
    let Some(pair) = falling.windows(2).find(crossing) else {
        let full = exact.iter().map(|(cost, _)| *cost).reduce(f64::min)?;
        // Without any error, different cuts cannot be compared: no outline is in the picture, for example.
        let is_below = match falling.last() {
            Some(least) => wanted < least.1,
            None => exact.iter().all(|(cost, _)| *cost == full),
        };
        return is_below.then_some(full);
    };
    let [(cost_0, error_0), (cost_1, error_1)] = [pair[0], pair[1]];
    let share = if error_0 > error_1 {
        (error_0 - wanted) / (error_0 - error_1)
    } else {
        0.0
    };
    Some((cost_0 + share * (cost_1 - cost_0)).exp())
}

/// Isotonic regression: the nearest curve by least squares whose errors never grow with the cost. Neighbours that are
/// out of order get their mean (M. Ayer et al., 1955).
fn falling(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for &(_, error) in points {
        // A point joins the earlier pools while its error is larger than theirs.
        let mut pool = (error, 1usize);
        while let Some(&(before, count)) = pools.last()
            && before < pool.0
        {
            let all = count + pool.1;
            pool.0 = (before * count as f64 + pool.0 * pool.1 as f64) / all as f64;
            pool.1 = all;
            pools.pop();
        }
        pools.push(pool);
    }
    let pools = pools.iter();
    let errors = pools.flat_map(|&(error, count)| std::iter::repeat_n(error, count));
    let pairs = points.iter().zip(errors);
    pairs.map(|(point, error)| (point.0, error)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// If the error is 1000 / triangles, an error needs 1000 / error triangles, also between points.
    #[test]
    fn power_law_is_interpolated_exactly() {
        let triangles = [100.0, 200.0, 500.0, 1000.0];
        let points = || triangles.into_iter().map(|t| (t, 1000.0 / t));
        for error in [1.0, 1.5, 3.0, 7.0, 10.0] {
            let found = at_error(points(), error).unwrap();
            let is_near = (found - 1000.0 / error).abs() < 1e-6 * found;
            assert!(is_near, "{error} {found}");
        }
        assert_eq!(at_error(points(), 10.5), None);
        assert_eq!(at_error(points(), 0.9), None);
    }

    #[test]
    fn error_below_all_levels_costs_full_detail() {
        let points = || [(100.0, 4.0), (200.0, 2.0), (800.0, 0.0)].into_iter();
        assert_eq!(at_error(points(), 1.0), Some(800.0));
        assert_eq!(at_error(points(), 5.0), None);
        assert_eq!(at_error(points().skip(2), 1.0), Some(800.0));
        assert_eq!(
            at_error([(100.0, 0.0), (800.0, 0.0)].into_iter(), 0.0),
            None
        );
    }

    #[test]
    fn thresholds_are_interpolated_by_triangles() {
        let point = |triangles, threshold_px| Point {
            threshold_px,
            triangles,
            error: ImageError::default(),
        };
        let curve = Curve {
            method: Method::Quality,
            points: vec![point(300, 2.0), point(100, 4.0)],
        };
        assert_eq!(threshold_at_triangles(&curve, 150.0), Some(3.5));
        assert_eq!(threshold_at_triangles(&curve, 301.0), None);
    }

    #[test]
    fn points_out_of_order_get_their_mean() {
        let points = [(0.0, 4.0), (1.0, 1.0), (2.0, 3.0), (3.0, 0.0)];
        let expected = [(0.0, 4.0), (1.0, 2.0), (2.0, 2.0), (3.0, 0.0)];
        assert_eq!(falling(&points), expected);
    }
}
