//! Finds the threshold at which one selection has the image error of another.

use serde::Serialize;

use super::frame::{Frame, Measured};
use crate::render::RenderError;

/// Relative difference below which errors count as equal. A larger difference shows in the table; a smaller one
/// costs tries, because pictures change in steps.
pub(super) const EQUAL: f64 = 0.004;
/// The largest number of thresholds to try. Fewer may stop before the errors are equal; each try draws all frames.
const MAX_TRIES: usize = 9;
/// The first guess of p, where errors grow with the p-th power of the threshold. The later tries measure p, so another
/// guess only costs tries.
const FIRST_POWER: f64 = 0.4;
/// Bounds of a measured p. Two nearly equal errors can give any p, and a negative p would step away from the
/// solution.
const POWERS: (f64, f64) = (0.05, 2.0);
/// Largest step of the logarithm of the threshold: a factor of 4.5. With a larger step, a wrong p leaves the range of
/// useful thresholds.
const MAX_LOG_STEP: f64 = 1.5;

/// The result of one selection, over all frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Whether visible flux is enabled.
    pub visible_flux: bool,
    /// The threshold, in pixels.
    pub threshold_px: f64,
    /// Mean triangles in view.
    pub triangles: f64,
    /// Triangles relative to the selection without visible flux.
    pub share: f64,
    /// The largest share of a single frame.
    pub worst_share: f64,
    /// Root mean squared error of the pictures, on a scale of 255.
    pub rmse: f64,
    /// Mean of FLIP, from 0 to 1.
    pub flip: f64,
}

/// All frames at one threshold.
struct Run {
    visible_flux: bool,
    threshold_px: f64,
    frames: Vec<Measured>,
}

impl Run {
    fn new(
        frames: &[Frame],
        visible_flux: bool,
        threshold_px: f64,
        with_flip: bool,
    ) -> Result<Self, RenderError> {
        let measure = |frame: &Frame| frame.measure(threshold_px as f32, visible_flux, with_flip);
        Ok(Self {
            visible_flux,
            threshold_px,
            frames: frames.iter().map(measure).collect::<Result<_, _>>()?,
        })
    }

    fn mean(&self, of: impl Fn(&Measured) -> f64) -> f64 {
        self.frames.iter().map(of).sum::<f64>() / self.frames.len().max(1) as f64
    }

    fn rmse(&self) -> f64 {
        self.mean(|frame| frame.error.rmse.powi(2)).sqrt()
    }

    fn triangles(&self) -> f64 {
        self.mean(|frame| frame.triangles as f64)
    }

    fn row(&self, base: &Self) -> Row {
        let pairs = self.frames.iter().zip(&base.frames);
        let shares = pairs.map(|(frame, base)| frame.triangles as f64 / base.triangles as f64);
        Row {
            visible_flux: self.visible_flux,
            threshold_px: self.threshold_px,
            triangles: self.triangles(),
            share: self.triangles() / base.triangles(),
            worst_share: shares.fold(0.0, f64::max),
            rmse: self.rmse(),
            flip: self.mean(|frame| frame.error.flip.unwrap_or_default()),
        }
    }
}

/// Measures the selection without visible flux at `error_px`, and with it at the same image error.
///
/// # Errors
/// [`RenderError`] if the device is lost.
pub(super) fn rows(frames: &[Frame], error_px: f64) -> Result<[Row; 2], RenderError> {
    let base = Run::new(frames, false, error_px, true)?;
    let threshold_px = threshold_at_equal_error(base.rmse(), error_px, |threshold_px| {
        Ok(Run::new(frames, true, threshold_px, false)?.rmse())
    })?;
    // FLIP takes most of the time, so the search skips it.
    let with_flux = Run::new(frames, true, threshold_px, true)?;
    Ok([base.row(&base), with_flux.row(&base)])
}

/// Tries thresholds by the secant method on logarithmic scales. Returns the try whose error is nearest to `rmse`.
fn threshold_at_equal_error(
    rmse: f64,
    first: f64,
    mut rmse_at: impl FnMut(f64) -> Result<f64, RenderError>,
) -> Result<f64, RenderError> {
    let mut log_ratio_at = |log: f64| Ok::<f64, RenderError>((rmse_at(log.exp())? / rmse).ln());
    let mut tried = (first.ln(), log_ratio_at(first.ln())?);
    let mut best = tried;
    let mut last: Option<(f64, f64)> = None;
    for _ in 1..MAX_TRIES {
        if tried.1.abs() < EQUAL {
            break;
        }
        let power = match last {
            Some((log_threshold, log_ratio)) => (tried.1 - log_ratio) / (tried.0 - log_threshold),
            None => FIRST_POWER,
        };
        let power = if power.is_finite() {
            power.clamp(POWERS.0, POWERS.1)
        } else {
            FIRST_POWER
        };
        let next = tried.0 - (tried.1 / power).clamp(-MAX_LOG_STEP, MAX_LOG_STEP);
        last = Some(tried);
        tried = (next, log_ratio_at(next)?);
        if tried.1.abs() < best.1.abs() {
            best = tried;
        }
    }
    Ok(best.0.exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn search_finds_threshold_of_a_power_law() {
        let law = |threshold: f64| Ok(3.0 * threshold.powf(0.7));
        let found = threshold_at_equal_error(1.8, 1.0, law).unwrap();
        assert!((law(found).unwrap() / 1.8 - 1.0).abs() < EQUAL, "{found}");
    }
}
