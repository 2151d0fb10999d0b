//! All that is measured of a world, as numbers, tables and pictures.

use std::fmt::Write;
use std::path::Path;

use fieldlod_select::{OcclusionBuffer, VisibleFlux};
use glam::dvec2;
use serde::{Deserialize, Serialize};

use super::choice::{Visibility, by_selector};
use super::equal_error::{Row, rows};
use super::frame::{Frame, Stage};
use super::world::World;
use crate::canvas::{Canvas, Color, Rect};
use crate::chart::ChartError;
use crate::files::{make_folder, write_file};
use crate::render::{RenderError, Renderer};

/// The threshold of today's pictures, in pixels.
const ERROR_PX: f64 = 1.0;
/// How often a selection is timed, of which the fastest counts.
const SELECTIONS: usize = 5;
/// What hidden things count at least where they may throw shadows.
const CASTER_SHARES: [f32; 5] = [0.0, 0.01, 0.05, 0.25, 1.0];

/// What to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Pictures with shadows, and how much hidden casters should count, in place of all methods.
    pub shadows: bool,
    /// Also what could be reached by one who knows the pictures, for which every level is drawn.
    pub limits: bool,
}

/// A world's results.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct WorldResult {
    /// Its name.
    pub name: String,
    /// Its instances.
    pub instances: usize,
    /// Triangles of all of them at full detail.
    pub source_triangles: u64,
    /// Frames that were drawn.
    pub frames: usize,
    /// The adapter that drew them.
    pub adapter: String,
    /// What each method draws at equal error.
    pub rows: Vec<Row>,
    /// Pixels of a frame that change if what is hidden is drawn at its coarsest, at the same threshold: by
    /// the buffer, and by the picture of full detail, where limits were asked for. The worst frame.
    pub pixels_changed: [Option<usize>; 2],
    /// Times of selecting a frame, from scratch if it has no approach, without and with visible flux: means over the
    /// frames, in milliseconds.
    pub selection_ms: [f64; 2],
    /// Mean triangles and points in the depth image.
    pub occluders: [f64; 2],
}

/// Measures a world, and writes its results and a picture of its last frame's depth image into a folder.
///
/// # Errors
/// [`ChartError`] from an adapter that stops or a folder that takes no files.
pub fn measure(
    renderer: &Renderer,
    world: &World,
    options: Options,
    folder: &Path,
) -> Result<WorldResult, ChartError> {
    make_folder(folder)?;
    let stage = Stage::new(renderer, world, options.shadows);
    let eyes = world.eyes.iter().zip(&world.approaches);
    let frames = eyes.map(|(eye, approach)| Frame::new(&stage, eye, approach, options.limits));
    let frames = frames.collect::<Result<Vec<Frame>, RenderError>>()?;
    let methods: Vec<Visibility> = if options.shadows {
        let shares = CASTER_SHARES.into_iter();
        shares
            .map(|least_share| Visibility::Buffer { least_share })
            .collect()
    } else {
        let least_share = VisibleFlux::default().least_share;
        let mut methods = vec![Visibility::Buffer { least_share }];
        // That knows nothing of what was drawn before.
        if world.approaches.iter().all(Vec::is_empty) {
            methods.push(Visibility::HiddenInBuffer);
        }
        if options.limits {
            methods.extend([
                Visibility::Picture,
                Visibility::HiddenInPicture,
                Visibility::Oracle,
            ]);
        }
        methods
    };
    let buffers = world.eyes.iter().map(|eye| buffer(world, eye));
    let buffers: Vec<OcclusionBuffer> = buffers.collect();
    let result = WorldResult {
        name: world.name.clone(),
        instances: world.instances.len(),
        source_triangles: world.source_triangles(),
        frames: frames.len(),
        adapter: renderer.adapter().to_owned(),
        rows: rows(world, &frames, ERROR_PX, &methods)?,
        pixels_changed: [
            Some(pixels_changed(world, &frames, Visibility::HiddenInBuffer)?),
            if options.limits {
                Some(pixels_changed(world, &frames, Visibility::HiddenInPicture)?)
            } else {
                None
            },
        ],
        selection_ms: selection_ms(world, &frames),
        occluders: [0, 1].map(|kind| {
            let drawn = buffers.iter().map(|buffer| f64::from(buffer.drawn()[kind]));
            drawn.sum::<f64>() / buffers.len().max(1) as f64
        }),
    };
    // Numbers, a table, and what the depth image looks like.
    let path = |ending: &str| folder.join(format!("{}{ending}", world.name));
    let json = serde_json::to_vec_pretty(&result).unwrap_or_default();
    write_file(&path(".json"), &json)?;
    write_file(&path(".md"), table(&result).as_bytes())?;
    if let Some(buffer) = buffers.last() {
        save(buffer, &path(" depth.png"))?;
    }
    Ok(result)
}

fn buffer(world: &World, eye: &crate::eye::Eye) -> OcclusionBuffer {
    let triangles = VisibleFlux::default().occluder_triangles;
    OcclusionBuffer::new(&world.scene, &eye.view(), triangles)
}

/// The most pixels of a frame that differ once what is hidden is drawn at its coarsest.
fn pixels_changed(
    world: &World,
    frames: &[Frame],
    hidden: Visibility,
) -> Result<usize, RenderError> {
    let changed = |frame: &Frame| -> Result<usize, RenderError> {
        let draw = |it: Visibility| frame.draw(&it.choose(world, frame, ERROR_PX as f32));
        let (all, without) = (draw(Visibility::Unknown)?, draw(hidden)?);
        let pairs = all.colors.iter().zip(&without.colors);
        Ok(pairs.filter(|(a, b)| a != b).count())
    };
    let most = |most: usize, frame| Ok(most.max(changed(frame)?));
    frames.iter().try_fold(0, most)
}

fn selection_ms(world: &World, frames: &[Frame]) -> [f64; 2] {
    let shares = [None, Some(VisibleFlux::default().least_share)];
    shares.map(|least_share| {
        let times = frames.iter().map(|frame| {
            let settings = frame.settings(ERROR_PX as f32, least_share);
            let times = (0..SELECTIONS).map(|_| by_selector(world, frame, &settings).1);
            times.min().unwrap_or_default().as_secs_f64() * 1e3
        });
        times.sum::<f64>() / frames.len().max(1) as f64
    })
}

/// Writes a depth image: the nearer, the darker.
fn save(buffer: &OcclusionBuffer, path: &Path) -> Result<(), ChartError> {
    let [width, height] = buffer.size();
    let finite = || buffer.nearness().iter().filter(|it| it.is_finite());
    let nearest = finite().fold(f32::NEG_INFINITY, |a, &b| a.max(b));
    let mut canvas = Canvas::new(width as u32, height as u32);
    let area = Rect {
        min: dvec2(0.0, 0.0),
        size: dvec2(width as f64, height as f64),
    };
    canvas.shade(area, |at| {
        let nearness = buffer.nearness()[at.y as usize * width + at.x as usize];
        // The root tells far things apart, too.
        let share = f64::from((nearness.max(0.0) / nearest).sqrt());
        Color::scale(if nearness.is_finite() {
            0.15 + 0.85 * share
        } else {
            0.0
        })
    });
    Ok(canvas.save(path)?)
}

/// The results as a table in Markdown.
#[must_use]
pub fn table(result: &WorldResult) -> String {
    let WorldResult {
        name,
        instances,
        source_triangles,
        frames,
        pixels_changed: [by_buffer, by_picture],
        selection_ms: [without, with],
        occluders: [triangles, points],
        ..
    } = result;
    let mut text = format!(
        "{name}: {instances} instances of {source_triangles} triangles, {frames} frames\n\n\
         | method | threshold | triangles | of those without | worst frame | RMSE, of 255 | FLIP |\n\
         |---|---:|---:|---:|---:|---:|---:|\n"
    );
    for row in &result.rows {
        let _ = writeln!(
            text,
            "| {} | {:.3} | {:.0} | {:.2} | {:.2} | {:.2} | {:.4} |",
            row.visibility.name(),
            row.threshold,
            row.triangles,
            row.share,
            row.worst_share,
            row.rmse,
            row.flip
        );
    }
    let pixels = |pixels: &Option<usize>| pixels.map_or("-".to_owned(), |it| it.to_string());
    let (by_buffer, by_picture) = (pixels(by_buffer), pixels(by_picture));
    let _ = writeln!(
        text,
        "\nPixels of the worst frame that change if only what is hidden is drawn at its coarsest: {by_buffer} by \
         the buffer, {by_picture} by the picture. Selecting a frame takes {without:.2} ms, {with:.2} ms \
         with visible flux; its depth image has {triangles:.0} triangles and {points:.0} points.\n"
    );
    text
}
