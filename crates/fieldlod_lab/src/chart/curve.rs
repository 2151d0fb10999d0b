//! What a method gives at a range of thresholds in one pose, and that read at equal error.

use serde::{Deserialize, Serialize};

use super::pose::Pose;
use crate::measure::ImageError;
use crate::method::Method;

/// The thresholds that all methods run at, in pixels.
pub(super) const THRESHOLDS_PX: [f32; 13] = [
    0.15, 0.2, 0.28, 0.4, 0.56, 0.75, 1.0, 1.35, 1.8, 2.5, 3.5, 5.0, 8.0,
];

/// The methods whose costs are charted: their pictures are compared by FLIP, too.
pub(super) const CHARTED: [Method; 5] = [
    Method::Quality,
    Method::ClusterlodOnOurLevels,
    Method::Clusterlod,
    Method::Godot43,
    Method::Oracle,
];

/// Costs and error of the cut that one threshold gives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The threshold, in pixels; of the oracle, in squared levels of error per triangle.
    pub threshold: f64,
    /// Triangles of the units that touch the view.
    pub triangles: u64,
    /// The number of those units, and so of draw commands.
    pub units: u64,
    /// The difference of the picture from the reference.
    pub error: ImageError,
    /// Time to choose from scratch on one thread, in microseconds: ours by the `Selector`,
    /// clusterlod's by a scan of eight groups at once, others by plain code.
    pub select_us: f64,
    /// Time to draw, in milliseconds.
    pub frame_ms: f64,
}

/// One method over the thresholds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// The method.
    pub method: Method,
    /// The points, from the finest to the coarsest threshold.
    pub points: Vec<Point>,
}

impl Curve {
    /// The point at a threshold that the sweep ran at.
    pub(super) fn at_threshold(&self, threshold: f64) -> Option<&Point> {
        let mut points = self.points.iter();
        points.find(|point| (point.threshold - threshold).abs() < 1e-4)
    }
}

/// The curves of all methods from one pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseResult {
    /// The pose.
    pub pose: Pose,
    /// One curve for each method.
    pub curves: Vec<Curve>,
}

impl PoseResult {
    /// The curve of a method.
    #[must_use]
    pub fn curve(&self, method: Method) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.method == method)
    }
}

/// The measure of error that is held equal between methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Root mean squared difference of the picture.
    Rmse,
    /// Share of pixels that are off.
    ShareOff,
    /// Distance of outlines.
    Silhouette,
    /// FLIP.
    Flip,
}

impl Measure {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Rmse, Self::ShareOff, Self::Silhouette, Self::Flip];

    /// A short name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rmse => "image RMSE",
            Self::ShareOff => "pixels off",
            Self::Silhouette => "silhouette",
            Self::Flip => "FLIP",
        }
    }

    /// The measure's value at a point.
    #[must_use]
    pub fn of(self, point: &Point) -> f64 {
        match self {
            Self::Rmse => point.error.rmse,
            Self::ShareOff => point.error.share_off,
            Self::Silhouette => point.error.silhouette_px,
            // Nothing to compare where it was not asked for.
            Self::Flip => point.error.flip.unwrap_or(0.0),
        }
    }
}

/// The triangles that a method needs for an error: interpolated between its points, both on logarithmic
/// scales, after the curve is made to fall (errors jitter by a few per cent; neighbours that are out
/// of order share their mean). `None` outside of the curve.
pub(super) fn triangles_at_error(curve: &Curve, measure: Measure, error: f64) -> Option<f64> {
    let points = curve.points.iter();
    at_error(
        points.map(|point| (point.triangles as f64, measure.of(point))),
        error,
    )
}

/// Any other cost of a method at a number of triangles: between the points on both sides.
pub(super) fn cost_at_triangles(
    curve: &Curve,
    triangles: f64,
    cost: impl Fn(&Point) -> f64,
) -> Option<f64> {
    let of_point = |point: &Point| (point.triangles as f64, cost(point));
    let mut points: Vec<(f64, f64)> = curve.points.iter().map(of_point).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The neighbours on both sides, and what lies between them.
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

/// As [`triangles_at_error`], for pairs of triangles and error.
fn at_error(points: impl Iterator<Item = (f64, f64)>, error: f64) -> Option<f64> {
    // On logarithmic scales, from few triangles to many.
    let usable = points.filter(|(cost, error)| *cost > 0.0 && *error > 0.0);
    let mut logs: Vec<(f64, f64)> = usable
        .map(|(cost, error)| (cost.ln(), error.ln()))
        .collect();
    logs.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
    logs.dedup_by_key(|point| point.0);
    // The first pair of neighbours between which the error is met.
    let falling = falling(&logs);
    let wanted = error.ln();
    let crossing = |pair: &&[(f64, f64)]| pair[0].1 >= wanted && wanted >= pair[1].1;
    let pair = falling.windows(2).find(crossing)?;
    let [(cost_0, error_0), (cost_1, error_1)] = [pair[0], pair[1]];
    let share = if error_0 > error_1 {
        (error_0 - wanted) / (error_0 - error_1)
    } else {
        0.0
    };
    Some((cost_0 + share * (cost_1 - cost_0)).exp())
}

/// The nearest curve, by least squares, whose errors never grow with the cost: neighbours out of order
/// are pooled (M. Ayer et al., 1955).
fn falling(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for &(_, error) in points {
        // A point joins the pools before it for as long as its error is the greater.
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
    let errors = pools
        .iter()
        .flat_map(|&(error, count)| std::iter::repeat_n(error, count));
    points
        .iter()
        .zip(errors)
        .map(|(point, error)| (point.0, error))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error = 1000 / triangles: any error is met by 1000 / error triangles, between points too.
    #[test]
    fn a_power_law_is_interpolated_exactly() {
        let points = || {
            [100.0, 200.0, 500.0, 1000.0]
                .map(|t| (t, 1000.0 / t))
                .into_iter()
        };
        for error in [1.0, 1.5, 3.0, 7.0, 10.0] {
            let found = at_error(points(), error).unwrap();
            assert!(
                (found - 1000.0 / error).abs() < 1e-6 * found,
                "{error} {found}"
            );
        }
        assert_eq!(at_error(points(), 10.5), None);
        assert_eq!(at_error(points(), 0.9), None);
    }

    #[test]
    fn other_costs_follow_the_triangles() {
        let point = |triangles, frame_ms| Point {
            threshold: 1.0,
            triangles,
            units: 1,
            error: ImageError::default(),
            select_us: 0.0,
            frame_ms,
        };
        let points = vec![point(300, 4.0), point(100, 2.0)];
        let curve = Curve {
            method: Method::Quality,
            points,
        };
        let cost = |triangles| cost_at_triangles(&curve, triangles, |point| point.frame_ms);
        assert_eq!(cost(150.0), Some(2.5));
        assert_eq!(cost(301.0), None);
    }

    #[test]
    fn points_out_of_order_share_their_mean() {
        let points = [(0.0, 4.0), (1.0, 1.0), (2.0, 3.0), (3.0, 0.0)];
        let expected = [(0.0, 4.0), (1.0, 2.0), (2.0, 2.0), (3.0, 0.0)];
        assert_eq!(falling(&points), expected);
    }
}
