//! The command line.

use std::path::PathBuf;

use bevy::math::UVec2;
use clap::Parser;

use crate::adapter;

/// Walk through generated ruins, drawn with view-dependent levels of detail.
#[derive(Clone, Debug, Parser)]
#[command(version, about)]
pub(crate) struct Args {
    /// Models (.glb, .gltf) to show on plinths along the avenue.
    #[arg(value_name = "MODEL")]
    pub(crate) models: Vec<PathBuf>,

    /// Render the camera path to pictures in DIR and print a JSON summary. Without a display, this is the default,
    /// with ./walkthrough-out as DIR.
    #[arg(long, value_name = "DIR")]
    pub(crate) offscreen: Option<PathBuf>,

    /// Render nothing: select levels along the camera path and print the JSON summary.
    #[arg(long, conflicts_with = "offscreen")]
    pub(crate) headless: bool,

    /// Draw everything at full detail, as Bevy does without the plugin.
    #[arg(long, conflicts_with = "split")]
    pub(crate) plain: bool,

    /// Show the whole scene at full quality, even on a software adapter.
    #[arg(long)]
    pub(crate) full: bool,

    /// Number of frames along the camera path: 24, or 12 at reduced quality.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) frames: Option<u32>,

    /// Render only frame N of the path.
    #[arg(long, value_name = "N")]
    pub(crate) still: Option<u32>,

    /// Size of the pictures or of the window in pixels: 1280x720, or 800x450 at reduced quality.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(crate) size: Option<UVec2>,

    /// Largest screen-space error in pixels: 1, or 2 at reduced quality.
    #[arg(long, value_name = "PX", value_parser = parse_error_px)]
    pub(crate) error_px: Option<f32>,

    /// Draw objects that are hidden or half hidden with fewer triangles.
    #[arg(long)]
    pub(crate) visible_flux: bool,

    /// Split the picture: levels of detail on the left, full detail on the right.
    #[arg(long)]
    pub(crate) split: bool,

    /// Paint each level of detail in its own colour.
    #[arg(long)]
    pub(crate) levels: bool,
}

impl Args {
    /// The directory for pictures; `None` opens a window.
    pub(crate) fn picture_directory(&self) -> Option<PathBuf> {
        let default = || (!adapter::has_display()).then(|| PathBuf::from("walkthrough-out"));
        self.offscreen.clone().or_else(default)
    }

    /// The frames to show of a path with `count` frames, as (number, fraction of a round).
    pub(crate) fn frames(&self, count: u32) -> Result<Vec<(u32, f32)>, String> {
        let frame = |number: u32| (number, number as f32 / count as f32);
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

fn parse_size(text: &str) -> Result<UVec2, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (16..=8192).contains(side));
    let size = text.split_once('x');
    let size = size.and_then(|(width, height)| Some(UVec2::new(side(width)?, side(height)?)));
    size.ok_or_else(|| "expected width x height from 16 to 8192, like 1280x720".into())
}

fn parse_error_px(text: &str) -> Result<f32, String> {
    let value = text.parse().ok().filter(|px| (0.0..=1e6).contains(px));
    value.ok_or_else(|| "expected a number of pixels from 0 to 1000000".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_line_definition_is_consistent() {
        use clap::CommandFactory;
        Args::command().debug_assert();
    }

    #[test]
    fn invalid_sizes_and_errors_are_rejected() {
        for size in ["", "12", "1280", "x720", "0x0", "99999x2", "-3x4"] {
            assert!(parse_size(size).is_err(), "{size}");
        }
        for error_px in ["", "NaN", "-1", "inf", "one"] {
            assert!(parse_error_px(error_px).is_err(), "{error_px}");
        }
        assert_eq!(parse_size("640x360"), Ok(UVec2::new(640, 360)));
    }

    #[test]
    fn still_selects_one_frame_of_the_path() {
        let args = Args::parse_from(["walkthrough", "--still", "6"]);
        assert_eq!(args.frames(24), Ok(vec![(6, 0.25)]));
        assert!(args.frames(6).is_err());
    }
}
