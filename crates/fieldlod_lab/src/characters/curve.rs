//! Triangles of a chain of levels by their error.

use crate::measure::geometric_mean;

/// Logarithms of triangles and errors, the finest level first, with growing errors.
pub(super) struct Curve(Vec<(f64, f64)>);

impl Curve {
    pub(super) fn of(levels: &[(usize, f32)]) -> Self {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for &(triangles, error) in levels.iter().filter(|(_, error)| *error > 0.0) {
            let error = f64::from(error).ln();
            // A coarser level that is no worse replaces finer ones.
            points.retain(|(_, finer)| *finer < error);
            points.push(((triangles as f64).ln(), error));
        }
        Self(points)
    }

    /// The logarithm of the triangles at an error, if it is between two levels.
    fn at(&self, error: f64) -> Option<f64> {
        let pairs = self.0.windows(2);
        let mut between = pairs.filter(|pair| (pair[0].1..=pair[1].1).contains(&error));
        let [(from, low), (to, high)] = *between.next()? else {
            return None;
        };
        Some(from + (to - from) * (error - low) / (high - low))
    }

    /// The geometric mean ratio of triangles of other levels to this curve at the same errors. `None` if no error is
    /// between levels of the curve.
    pub(super) fn relative(&self, levels: &[(usize, f32)]) -> Option<f64> {
        let ratios = levels.iter().filter_map(|&(triangles, error)| {
            let own = self.at(f64::from(error).ln())?;
            Some((triangles as f64) / own.exp())
        });
        geometric_mean(ratios)
    }
}
