//! The threshold at which a method's pictures are as near to full detail as another's, and what that draws.

use serde::{Deserialize, Serialize};

use super::choice::Visibility;
use super::frame::{Frame, Measured};
use super::world::World;
use crate::render::RenderError;

/// By how much errors may differ that count as equal.
const EQUAL: f64 = 0.004;
/// Thresholds that are tried at most.
const MOST_TRIES: usize = 9;
/// How errors grow with a threshold, about: to be begun with.
const FIRST_POWER: f64 = 0.4;

/// What a method draws at a threshold, over all frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The method.
    pub visibility: Visibility,
    /// The threshold: pixels, or squared levels of error per triangle of the oracle.
    pub threshold: f64,
    /// Mean triangles in view.
    pub triangles: f64,
    /// Those over the ones that are drawn without knowing what hides what.
    pub share: f64,
    /// The share in the frame in which it is greatest.
    pub worst_share: f64,
    /// Root of the mean squared error of the pictures, of 255.
    pub rmse: f64,
    /// Mean of FLIP, from 0 to 1.
    pub flip: f64,
}

/// One method over all frames at a threshold.
struct Run {
    threshold: f64,
    frames: Vec<Measured>,
}

impl Run {
    fn new(
        world: &World,
        frames: &[Frame],
        visibility: Visibility,
        threshold: f64,
        with_flip: bool,
    ) -> Result<Self, RenderError> {
        let measure = |frame: &Frame| {
            let cuts = visibility.choose(world, frame, threshold as f32);
            frame.measure(&cuts, with_flip)
        };
        Ok(Self {
            threshold,
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

    fn row(&self, visibility: Visibility, base: &Self) -> Row {
        let pairs = self.frames.iter().zip(&base.frames);
        let shares = pairs.map(|(frame, base)| frame.triangles as f64 / base.triangles as f64);
        Row {
            visibility,
            threshold: self.threshold,
            triangles: self.triangles(),
            share: self.triangles() / base.triangles(),
            worst_share: shares.fold(0.0, f64::max),
            rmse: self.rmse(),
            flip: self.mean(|frame| frame.error.flip.unwrap_or_default()),
        }
    }
}

/// What is drawn without knowing what hides what at `error_px`, and by methods at the same error of the
/// pictures.
///
/// # Errors
/// [`RenderError`] from an adapter that stops.
pub(super) fn rows(
    world: &World,
    frames: &[Frame],
    error_px: f64,
    methods: &[Visibility],
) -> Result<Vec<Row>, RenderError> {
    let base = Run::new(world, frames, Visibility::Unknown, error_px, true)?;
    let mut rows = vec![base.row(Visibility::Unknown, &base)];
    for &method in methods {
        let first = match method {
            Visibility::Oracle => oracle_threshold(frames),
            _ => error_px,
        };
        let run = at_equal_error(base.rmse(), first, |threshold| {
            Run::new(world, frames, method, threshold, false)
        })?;
        // FLIP takes longer than all else, and is looked at only here.
        let run = Run::new(world, frames, method, run.threshold, true)?;
        rows.push(run.row(method, &base));
    }
    Ok(rows)
}

/// A threshold of the oracle in the middle of what matters.
fn oracle_threshold(frames: &[Frame]) -> f64 {
    let thresholds = frames.iter().filter_map(|frame| {
        let thresholds = frame.limits().oracle.thresholds(13);
        thresholds.get(thresholds.len() / 2).copied()
    });
    let sorted = thresholds.map(f64::from).collect::<Vec<_>>();
    sorted.iter().sum::<f64>() / sorted.len().max(1) as f64
}

/// The run whose error is nearest to `rmse`: by secants on logarithmic scales.
fn at_equal_error(
    rmse: f64,
    first: f64,
    mut run: impl FnMut(f64) -> Result<Run, RenderError>,
) -> Result<Run, RenderError> {
    let off = |run: &Run| (run.rmse() / rmse).ln();
    let mut best = run(first)?;
    let mut last: Option<(f64, f64)> = None;
    let mut tried = (first.ln(), off(&best));
    for _ in 1..MOST_TRIES {
        if tried.1.abs() < EQUAL {
            break;
        }
        let power = match last {
            Some((threshold, off)) => (tried.1 - off) / (tried.0 - threshold),
            None => FIRST_POWER,
        };
        // Errors jitter where they are nearly equal.
        let power = if power.is_finite() {
            power.clamp(0.05, 2.0)
        } else {
            FIRST_POWER
        };
        let next = tried.0 - (tried.1 / power).clamp(-1.5, 1.5);
        let another = run(next.exp())?;
        last = Some(tried);
        tried = (next, off(&another));
        if tried.1.abs() < off(&best).abs() {
            best = another;
        }
    }
    Ok(best)
}
