//! The numbers of a run, printed as JSON.

use std::time::Duration;

use bevy::prelude::Resource;
use bevy_fieldlod::FieldLodViewStats;
use serde::Serialize;

use crate::quality::Quality;

/// Numbers of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameNumbers {
    pub(crate) stats: FieldLodViewStats,
    /// Time of the main world.
    pub(crate) main_time: Duration,
    /// Time of the extraction and the render world.
    pub(crate) render_time: Duration,
    /// Time from the end of the render world until the GPU was done.
    pub(crate) wait_time: Duration,
}

/// Numbers of the whole run.
#[derive(Resource, Clone, Debug, Default, Serialize)]
pub(crate) struct SceneNumbers {
    pub(crate) adapter: Option<String>,
    pub(crate) instances: u64,
    pub(crate) source_triangles: u64,
    /// Time to generate the meshes and the ground's texture.
    pub(crate) generate_s: f32,
    /// Time until every mesh has its levels of detail.
    pub(crate) bake_s: f32,
    /// Time from the start to the first picture.
    pub(crate) first_picture_s: f32,
}

#[derive(Debug, Serialize)]
struct Summary<'a> {
    quality: &'static str,
    width_px: u32,
    height_px: u32,
    error_px: f32,
    #[serde(flatten)]
    scene: &'a SceneNumbers,
    frames: usize,
    triangles_drawn: Spread,
    triangles_full: Spread,
    units_drawn: Spread,
    selection_ms: Spread,
    /// Time of the whole frame: the sum of the three times below.
    frame_ms: Spread,
    main_ms: Spread,
    render_ms: Spread,
    wait_ms: Spread,
}

/// Distribution of a number over the frames, rounded to a thousandth.
#[derive(Debug, PartialEq, Serialize)]
struct Spread {
    mean: f64,
    min: f64,
    median: f64,
    max: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let rounded = |value: f64| (value * 1e3).round() / 1e3;
        let at = |index: usize| rounded(sorted.get(index).copied().unwrap_or(0.0));
        Self {
            mean: rounded(sorted.iter().sum::<f64>() / sorted.len().max(1) as f64),
            min: at(0),
            median: at(sorted.len() / 2),
            max: at(sorted.len().saturating_sub(1)),
        }
    }
}

/// Prints the summary of a run to stdout.
pub(crate) fn print(quality: &Quality, scene: &SceneNumbers, frames: &[FrameNumbers]) {
    let count = |value: fn(&FieldLodViewStats) -> u64| {
        Spread::of(frames.iter().map(|frame| value(&frame.stats) as f64))
    };
    let time = |value: fn(&FrameNumbers) -> Duration| {
        Spread::of(frames.iter().map(|frame| value(frame).as_secs_f64() * 1e3))
    };
    let summary = Summary {
        quality: quality.description(),
        width_px: quality.size_in_px.x,
        height_px: quality.size_in_px.y,
        error_px: quality.error_px,
        scene,
        frames: frames.len(),
        triangles_drawn: count(|stats| stats.triangles_drawn),
        triangles_full: count(|stats| stats.triangles_full),
        units_drawn: count(|stats| stats.units_drawn.into()),
        selection_ms: time(|frame| frame.stats.selection_time),
        frame_ms: time(|frame| frame.main_time + frame.render_time + frame.wait_time),
        main_ms: time(|frame| frame.main_time),
        render_ms: time(|frame| frame.render_time),
        wait_ms: time(|frame| frame.wait_time),
    };
    let json = serde_json::to_string_pretty(&summary).expect("plain numbers and text serialise");
    println!("{json}");
}

/// Formats a count of triangles in a short form: `1.23 M`, `45.6 k`, `789`.
pub(crate) fn short_count(count: u64) -> String {
    match count {
        1_000_000.. => format!("{:.2} M", count as f64 / 1e6),
        10_000.. => format!("{:.1} k", count as f64 / 1e3),
        _ => count.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_has_mean_and_extremes_of_the_values() {
        let spread = Spread {
            mean: 200.0,
            min: 100.0,
            median: 150.0,
            max: 350.0,
        };
        assert_eq!(Spread::of([150.0, 350.0, 100.0].into_iter()), spread);
        assert_eq!(Spread::of(std::iter::empty()).max, 0.0);
    }
}
