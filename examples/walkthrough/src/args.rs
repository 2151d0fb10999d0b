//! The command line.

use std::fmt::Display;
use std::ops::{Range, RangeInclusive};
use std::path::PathBuf;
use std::str::FromStr;

use bevy::math::UVec2;
use bevy_fieldlod::FieldLodHeatMap;
use clap::{Parser, ValueEnum};

use crate::adapter;

/// Walk through generated ruins, drawn with view-dependent levels of detail.
#[derive(Clone, Debug, Parser)]
#[command(version, about)]
pub(crate) struct Args {
    /// Models (.glb, .gltf) to join the scene, on plinths along the avenue.
    #[arg(value_name = "MODEL")]
    pub(crate) models: Vec<PathBuf>,

    /// Render the camera path to pictures in DIR and print a JSON summary. This also happens
    /// without a display, in ./walkthrough-out.
    #[arg(long, value_name = "DIR")]
    pub(crate) offscreen: Option<PathBuf>,

    /// Draw nothing: select along the camera path and print the JSON summary.
    #[arg(long, conflicts_with = "offscreen")]
    pub(crate) headless: bool,

    /// Draw along the path without keeping pictures, and print the JSON summary with the times of the main thread, of
    /// the render world and of the GPU.
    #[arg(long, conflicts_with_all = ["offscreen", "headless"])]
    pub(crate) time: bool,

    /// Draw everything at full detail, as Bevy does without the plugin.
    #[arg(long, conflicts_with = "split")]
    pub(crate) plain: bool,

    /// Show the whole scene at full quality on a software adapter too, where less of it is shown
    /// otherwise.
    #[arg(long)]
    pub(crate) full: bool,

    /// Pictures, or selections, along the camera path: 24, or 12 at reduced quality.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) frames: Option<u32>,

    /// Render only frame N of the path.
    #[arg(long, value_name = "N")]
    pub(crate) still: Option<u32>,

    /// Spread the frames over this stretch of the path, as shares of a round.
    #[arg(long, value_name = "FROM-TO", default_value = "0-1", value_parser = parse_stretch)]
    pub(crate) stretch: Range<f32>,

    /// Join the pictures to an animation, 400 pixels wide at most.
    #[arg(long, value_name = "FILE.gif", requires = "offscreen")]
    pub(crate) animation: Option<PathBuf>,

    /// Size of the pictures, or of the window, in pixels: 1280x720, or 800x450 at reduced quality.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(crate) size: Option<UVec2>,

    /// Largest screen-space error, in pixels: 1, or 2 at reduced quality.
    #[arg(long, value_name = "PX", value_parser = parse_error_px)]
    pub(crate) error_px: Option<f32>,

    /// Draw what is hidden, or half hidden, with fewer triangles.
    #[arg(long)]
    pub(crate) visible_flux: bool,

    /// Draw plants far away as cards, rectangles with pictures of them.
    #[arg(long)]
    pub(crate) cards: bool,

    /// Let the GPU leave out what is wholly hidden, after a prepass of depths, as Bevy's `OcclusionCulling` does
    #[arg(long)]
    pub(crate) occlusion_culling: bool,

    /// How much errors count of what only casts shadows: from 0, its coarsest level, to 1, as what is seen.
    #[arg(long, value_name = "SHARE", value_parser = parse_shadow_bias)]
    pub(crate) shadow_bias: Option<f32>,

    /// Margin around the picture that is drawn as finely as the picture, as a share of its size.
    #[arg(long, value_name = "SHARE", value_parser = parse_margin)]
    pub(crate) offscreen_margin: Option<f32>,

    /// Measure what is drawn along the path at equal error of the pictures, with detail chosen by what is not
    /// hidden and without, and write the figures to DIR.
    #[cfg(feature = "lab")]
    #[arg(long, value_name = "DIR", conflicts_with_all = ["offscreen", "headless"])]
    pub(crate) measure: Option<PathBuf>,

    /// Frames of selection alone before each one that is measured, at 60 a second of the walk there; 0 measures each
    /// for itself
    #[cfg(feature = "lab")]
    #[arg(long, value_name = "N", default_value_t = 90, requires = "measure")]
    pub(crate) approach: u32,

    /// Split the picture: levels of detail on the left, full detail on the right.
    #[arg(long)]
    pub(crate) split: bool,

    /// By night: moon and lamps.
    #[arg(long)]
    pub(crate) night: bool,

    /// Bake all levels of detail anew: neither read nor write those of earlier runs.
    #[arg(long)]
    pub(crate) no_cache: bool,

    /// Only write the plants to DIR, as glTF files to measure (`fieldlod-lab props`).
    #[arg(long, value_name = "DIR", exclusive = true)]
    pub(crate) write_plants: Option<PathBuf>,

    /// Only write the scene to FILE, as a binary glTF file to bake (`fieldlod bake --scene`).
    #[arg(long, value_name = "FILE.glb", conflicts_with = "offscreen")]
    pub(crate) write_scene: Option<PathBuf>,

    /// Write a scene of N rocks, each of 327,680 triangles and unlike all others, in place of the ruins.
    #[arg(long, value_name = "N", requires = "write_scene", value_parser = clap::value_parser!(u32).range(1..=300))]
    pub(crate) rocks: Option<u32>,

    /// Walk through the scene that `fieldlod bake --scene` wrote to DIR, of which only what is seen is in memory,
    /// in place of a generated one.
    #[arg(long, value_name = "DIR")]
    pub(crate) world: Option<PathBuf>,

    /// The most MiB of that scene's large meshes on the GPU.
    #[arg(long, value_name = "N", requires = "world", default_value_t = 512)]
    pub(crate) gpu_mib: u64,

    /// Paint each level of detail in its own colour.
    #[arg(long)]
    pub(crate) levels: bool,

    /// Paint a quantity of the camera-sampling field, or the error of what is drawn, from blue
    /// (little) to red (much).
    #[arg(long, value_name = "QUANTITY", value_enum, conflicts_with = "levels")]
    pub(crate) heat_map: Option<Quantity>,
}

/// What a heat-map shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Quantity {
    /// Samples per unit of surface area.
    Density,
    /// Aspect ratio of the sampling pattern.
    Aspect,
    /// Relative change of the field across a metre.
    Curl,
    /// Error in pixels.
    Error,
}

impl Quantity {
    pub(crate) fn heat_map(self) -> FieldLodHeatMap {
        match self {
            Self::Density => FieldLodHeatMap::SamplingDensity,
            Self::Aspect => FieldLodHeatMap::AspectRatio,
            Self::Curl => FieldLodHeatMap::Curl,
            Self::Error => FieldLodHeatMap::PixelError,
        }
    }
}

impl Args {
    /// Where pictures go; `None` to open a window.
    pub(crate) fn picture_directory(&self) -> Option<PathBuf> {
        let default = || (!adapter::has_display()).then(|| PathBuf::from("walkthrough-out"));
        self.offscreen.clone().or_else(default)
    }

    /// Which of `count` frames to show, as (number, fraction of a round on the path).
    pub(crate) fn frames(&self, count: u32) -> Result<Vec<(u32, f32)>, String> {
        let Range { start, end } = self.stretch;
        let frame = |number: u32| {
            let share = number as f32 / count as f32;
            (number, start + (end - start) * share)
        };
        match self.still {
            Some(number) if number >= count => Err(format!(
                "--still {number}: the path has the frames 0 to {}",
                count - 1
            )),
            Some(number) => Ok(vec![frame(number)]),
            None => Ok((0..count).map(frame).collect()),
        }
    }
}

/// A number within a range; `what` names it in the message of refusal.
fn parse_in<T: FromStr + PartialOrd + Display>(
    text: &str,
    range: RangeInclusive<T>,
    what: &str,
) -> Result<T, String> {
    let value = text.parse().ok().filter(|value| range.contains(value));
    let [least, most] = [range.start(), range.end()];
    value.ok_or_else(|| format!("{text} is not a {what} from {least} to {most}"))
}

fn parse_size(text: &str) -> Result<UVec2, String> {
    let sides = text.split_once('x');
    let (width, height) = sides.ok_or("write it as width x height, like 1280x720")?;
    let side = |text| parse_in(text, 16..=8192, "number of pixels");
    Ok(UVec2::new(side(width)?, side(height)?))
}

fn parse_stretch(text: &str) -> Result<Range<f32>, String> {
    let ends = text.split_once('-');
    let (from, to) = ends.ok_or("write it as two shares of a round, like 0.25-0.5")?;
    let share = |text| parse_in(text, 0.0..=1.0, "number");
    let stretch = share(from)?..share(to)?;
    match stretch.is_empty() {
        false => Ok(stretch),
        true => Err(format!("{text} ends before it begins")),
    }
}

fn parse_error_px(text: &str) -> Result<f32, String> {
    parse_in(text, 0.0..=1e6, "number of pixels")
}

fn parse_shadow_bias(text: &str) -> Result<f32, String> {
    parse_in(text, 0.0..=1.0, "share")
}

fn parse_margin(text: &str) -> Result<f32, String> {
    parse_in(text, 0.0..=10.0, "share")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Args::command().debug_assert();
    }

    #[test]
    fn rejects_sizes_and_errors_that_make_no_sense() {
        for size in ["", "12", "1280", "x720", "0x0", "99999x2", "-3x4"] {
            assert!(parse_size(size).is_err(), "{size}");
        }
        for error_px in ["", "NaN", "-1", "inf", "one"] {
            assert!(parse_error_px(error_px).is_err(), "{error_px}");
        }
        for share in ["", "NaN", "-1", "1.5"] {
            assert!(parse_shadow_bias(share).is_err(), "{share}");
        }
        assert!(parse_margin("11").is_err() && parse_margin("1.5").is_ok());
        assert_eq!(parse_size("640x360"), Ok(UVec2::new(640, 360)));
    }

    #[test]
    fn frames_are_spread_over_a_stretch() {
        for stretch in ["", "0.5", "0.5-0.2", "0.2-1.5", "a-b", "-0.2-0.5"] {
            assert!(parse_stretch(stretch).is_err(), "{stretch}");
        }
        let args = Args::parse_from(["walkthrough", "--stretch", "0.25-0.75"]);
        assert_eq!(args.frames(2), Ok(vec![(0, 0.25), (1, 0.5)]));
    }

    #[test]
    fn a_still_is_one_frame_of_the_path() {
        let args = Args::parse_from(["walkthrough", "--still", "6"]);
        assert_eq!(args.frames(24), Ok(vec![(6, 0.25)]));
        assert!(args.frames(6).is_err());
    }
}
