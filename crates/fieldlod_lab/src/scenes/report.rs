//! The results of a world, as numbers and tables.

use std::fmt::Write;

use serde::Serialize;

use super::equal_error::{EQUAL, Row, rows};
use super::frame::{Frame, Stage};
use super::world::World;
use crate::render::{RenderError, Renderer};

/// The threshold without visible flux, in pixels.
pub const ERROR_PX: f64 = 1.0;

/// A world's results.
#[derive(Clone, Debug, Serialize)]
pub struct WorldResult {
    /// The world's name.
    pub name: String,
    /// The number of instances.
    pub instances: usize,
    /// Triangles of all instances at full detail.
    pub source_triangles: u64,
    /// The number of frames.
    pub frames: usize,
    /// The results without and with visible flux, at equal error.
    pub rows: [Row; 2],
}

/// Measures a world.
///
/// # Errors
/// [`RenderError`] if the device is lost.
pub fn measure(renderer: &Renderer, world: &World) -> Result<WorldResult, RenderError> {
    let stage = Stage::new(renderer, world);
    let frames = world.eyes.iter().map(|eye| Frame::new(&stage, eye));
    let frames = frames.collect::<Result<Vec<Frame>, RenderError>>()?;
    Ok(WorldResult {
        name: world.name.clone(),
        instances: world.instances.len(),
        source_triangles: world.source_triangles(),
        frames: frames.len(),
        rows: rows(&frames, ERROR_PX)?,
    })
}

/// The results as a table in Markdown.
#[must_use]
pub fn table(result: &WorldResult) -> String {
    let (name, instances, frames) = (&result.name, result.instances, result.frames);
    let mut text = format!(
        "{name}: {instances} instances of {} triangles, {frames} frames\n\n\
         | visible flux | threshold | triangles | share | worst frame | RMSE, of 255 | FLIP |\n\
         |---|---:|---:|---:|---:|---:|---:|\n",
        result.source_triangles
    );
    for row in &result.rows {
        let is_equal = (row.rmse / result.rows[0].rmse).ln().abs() < EQUAL;
        let _ = writeln!(
            text,
            "| {} | {:.3} | {:.0} | {:.2} | {:.2} | {:.2}{} | {:.4} |",
            if row.visible_flux { "with" } else { "without" },
            row.threshold_px,
            row.triangles,
            row.share,
            row.worst_share,
            row.rmse,
            if is_equal { "" } else { " (not equal)" },
            row.flip
        );
    }
    text.push('\n');
    text
}
