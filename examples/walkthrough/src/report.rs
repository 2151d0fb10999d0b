//! The numbers of a run, printed as JSON.

use std::time::Duration;

use bevy_fieldlod::FieldLodMemory;
use serde::Serialize;

use crate::quality::Quality;

/// What one frame took and drew.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameNumbers {
    pub(crate) triangles_drawn: u64,
    /// Triangles that would have been drawn without levels of detail.
    pub(crate) triangles_full: u64,
    pub(crate) units_drawn: u64,
    pub(crate) selection_time: Duration,
    /// Time of the whole frame, on CPU and GPU; on the main thread alone if nothing was drawn.
    pub(crate) frame_time: Duration,
    /// Time of the main world.
    pub(crate) main_time: Duration,
    /// Time of the render world with the extraction.
    pub(crate) render_time: Duration,
    /// Time from then on until the GPU was done.
    pub(crate) wait_time: Duration,
    /// Time of the passes by the GPU's clock, where it has one, but those of shadows.
    pub(crate) passes_ms: Option<f64>,
    /// What all meshes take on the GPU.
    pub(crate) mesh_bytes: u64,
    /// What Bevy has allocated for them there.
    pub(crate) buffer_bytes: u64,
    /// What of the meshes is read in parts.
    pub(crate) memory: FieldLodMemory,
}

/// How long a start takes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Times {
    /// Until every mesh had its levels of detail.
    pub(crate) bake: Duration,
    /// From the beginning to the first picture, of the coarsest levels where they are read in parts.
    pub(crate) first_picture: Duration,
    /// From the beginning until nothing that the picture wants is missing.
    pub(crate) sharp: Duration,
}

/// What does not change from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneNumbers {
    pub(crate) adapter: Option<String>,
    pub(crate) instances: u64,
    pub(crate) source_triangles: u64,
    /// Time to make the meshes and the texture on the ground.
    pub(crate) generation_time: Duration,
    pub(crate) times: Times,
}

#[derive(Debug, Serialize)]
struct Summary {
    adapter: Option<String>,
    quality: &'static str,
    width_px: u32,
    height_px: u32,
    error_px: f32,
    instances: u64,
    source_triangles: u64,
    generate_s: f64,
    bake_s: f64,
    first_picture_s: f64,
    sharp_s: f64,
    frames: usize,
    triangles_drawn: Spread,
    triangles_full: Spread,
    /// Triangles drawn, as a share of those at full detail, over all frames.
    drawn_share: f64,
    units_drawn: Spread,
    /// Megabytes of meshes on the GPU.
    mesh_mb: Spread,
    /// What is allocated for them.
    buffer_mb: Spread,
    /// Of the meshes, what is read in parts, and what the frame wants of it.
    parts_mb: Spread,
    parts_wanted_mb: Spread,
    selection_ms: Spread,
    frame_ms: Percentiles,
    main_ms: Percentiles,
    render_ms: Percentiles,
    /// Until the GPU is done with what the render world gave it.
    wait_ms: Percentiles,
    /// By the GPU's clock, without shadows, which Bevy does not time.
    passes_ms: Option<Percentiles>,
}

/// Mean and extremes of a number over the frames, rounded to a thousandth.
#[derive(Debug, PartialEq, Serialize)]
struct Spread {
    mean: f64,
    min: f64,
    max: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count().max(1) as f64;
        let rounded = |value: f64| (value * 1e3).round() / 1e3;
        Self {
            mean: rounded(values.clone().sum::<f64>() / count),
            min: rounded(values.clone().reduce(f64::min).unwrap_or(0.0)),
            max: rounded(values.reduce(f64::max).unwrap_or(0.0)),
        }
    }
}

/// How a number is distributed over the frames, rounded to a thousandth.
#[derive(Debug, PartialEq, Serialize)]
struct Percentiles {
    p50: f64,
    p95: f64,
    p99: f64,
    max: f64,
}

impl Percentiles {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let last = sorted.len().saturating_sub(1);
        let at = |share: f64| {
            let value = sorted.get((share * last as f64).round() as usize);
            value.map_or(0.0, |value| (value * 1e3).round() / 1e3)
        };
        Self {
            p50: at(0.5),
            p95: at(0.95),
            p99: at(0.99),
            max: at(1.0),
        }
    }
}

/// Prints the summary of a run on stdout.
pub(crate) fn print(quality: &Quality, scene: &SceneNumbers, frames: &[FrameNumbers]) {
    let summary = summarise(quality, scene, frames);
    let json = serde_json::to_string_pretty(&summary).expect("plain numbers and text serialise");
    println!("{json}");
}

fn summarise(quality: &Quality, scene: &SceneNumbers, frames: &[FrameNumbers]) -> Summary {
    let spread = |value: fn(&FrameNumbers) -> f64| Spread::of(frames.iter().map(value));
    let percentiles = |value: fn(&FrameNumbers) -> Duration| {
        Percentiles::of(frames.iter().map(|f| milliseconds(value(f))))
    };
    let passes_ms = frames.iter().filter_map(|f| f.passes_ms);
    let has_clock = passes_ms.clone().next().is_some();
    let triangles_drawn = spread(|f| f.triangles_drawn as f64);
    let triangles_full = spread(|f| f.triangles_full as f64);
    let drawn_share = triangles_drawn.mean / triangles_full.mean.max(1.0);
    Summary {
        adapter: scene.adapter.clone(),
        quality: quality.description(),
        width_px: quality.size_in_px.x,
        height_px: quality.size_in_px.y,
        error_px: quality.error_px,
        instances: scene.instances,
        source_triangles: scene.source_triangles,
        generate_s: seconds(scene.generation_time),
        bake_s: seconds(scene.times.bake),
        first_picture_s: seconds(scene.times.first_picture),
        sharp_s: seconds(scene.times.sharp),
        frames: frames.len(),
        triangles_drawn,
        triangles_full,
        drawn_share: (drawn_share * 1e5).round() / 1e5,
        units_drawn: spread(|f| f.units_drawn as f64),
        mesh_mb: spread(|f| f.mesh_bytes as f64 * 1e-6),
        buffer_mb: spread(|f| f.buffer_bytes as f64 * 1e-6),
        parts_mb: spread(|f| f.memory.resident_bytes as f64 * 1e-6),
        parts_wanted_mb: spread(|f| f.memory.wanted_bytes as f64 * 1e-6),
        selection_ms: spread(|f| milliseconds(f.selection_time)),
        frame_ms: percentiles(|f| f.frame_time),
        main_ms: percentiles(|f| f.main_time),
        render_ms: percentiles(|f| f.render_time),
        wait_ms: percentiles(|f| f.wait_time),
        passes_ms: has_clock.then(|| Percentiles::of(passes_ms)),
    }
}

/// Seconds, rounded to the millisecond.
fn seconds(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e3).round() / 1e3
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// A count of triangles to read at a glance: `1.23 M`, `45.6 k`, `789`.
pub(crate) fn in_short(count: u64) -> String {
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
    fn the_summary_averages_the_frames() {
        let frame = |drawn| FrameNumbers {
            triangles_drawn: drawn,
            triangles_full: 1000,
            ..FrameNumbers::default()
        };
        let frames = [frame(100), frame(300)];
        let summary = summarise(&Quality::FULL, &SceneNumbers::default(), &frames);
        let spread = Spread {
            mean: 200.0,
            min: 100.0,
            max: 300.0,
        };
        assert_eq!(summary.triangles_drawn, spread);
        assert!((summary.drawn_share - 0.2).abs() < 1e-9);
    }

    #[test]
    fn percentiles_are_numbers_of_the_run() {
        let percentiles = Percentiles::of((0..=100).rev().map(f64::from));
        let expected = Percentiles {
            p50: 50.0,
            p95: 95.0,
            p99: 99.0,
            max: 100.0,
        };
        assert_eq!(percentiles, expected);
        assert_eq!(Percentiles::of(std::iter::empty()).max, 0.0);
    }

    #[test]
    fn counts_read_at_a_glance() {
        assert_eq!(in_short(789), "789");
        assert_eq!(in_short(45_600), "45.6 k");
        assert_eq!(in_short(1_234_567), "1.23 M");
    }
}
