//! The command line.

use std::path::PathBuf;

use bevy_fieldlod::FieldLodHeatMap;
use clap::{Parser, ValueEnum};

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

    /// Pictures, or selections, along the camera path.
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) frames: u32,

    /// Render only frame N of the path.
    #[arg(long, value_name = "N")]
    pub(crate) still: Option<u32>,

    /// Spread the frames over this stretch of the path instead of a whole round, as shares of a
    /// round.
    #[arg(long, value_name = "FROM-TO", value_parser = parse_stretch)]
    pub(crate) stretch: Option<Stretch>,

    /// Join the pictures to an animation, 400 pixels wide at most.
    #[arg(long, value_name = "FILE.gif", requires = "offscreen")]
    pub(crate) animation: Option<PathBuf>,

    /// Size of the pictures, or of the window, in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub(crate) size: Size,

    /// Largest screen-space error, in pixels.
    #[arg(long, value_name = "PX", default_value_t = 1.0, value_parser = parse_error_px)]
    pub(crate) error_px: f32,

    /// Split the picture: levels of detail on the left, full detail on the right.
    #[arg(long)]
    pub(crate) split: bool,

    /// By night: moon and lamps.
    #[arg(long)]
    pub(crate) night: bool,

    /// Bake all levels of detail anew: neither read nor write those of earlier runs.
    #[arg(long)]
    pub(crate) no_cache: bool,

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

/// A size in physical pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// A part of the path, in rounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretch {
    pub(crate) from: f32,
    pub(crate) to: f32,
}

impl Args {
    /// Where pictures go; `None` to open a window.
    pub(crate) fn picture_directory(&self) -> Option<PathBuf> {
        let without_display = cfg!(target_os = "linux")
            && ["DISPLAY", "WAYLAND_DISPLAY"]
                .iter()
                .all(|name| std::env::var_os(name).is_none_or(|value| value.is_empty()));
        let default = || without_display.then(|| PathBuf::from("walkthrough-out"));
        self.offscreen.clone().or_else(default)
    }

    /// What part of the path to show.
    pub(crate) fn stretch(&self) -> Stretch {
        self.stretch.unwrap_or(Stretch { from: 0.0, to: 1.0 })
    }

    /// The frames to show, as (number, fraction of a round on the path).
    pub(crate) fn frames(&self) -> Result<Vec<(u32, f32)>, String> {
        let Stretch { from, to } = self.stretch();
        let frame = |number: u32| {
            let share = number as f32 / self.frames as f32;
            (number, from + (to - from) * share)
        };
        match self.still {
            Some(number) if number >= self.frames => Err(format!(
                "--still {number}: the path has the frames 0 to {}",
                self.frames - 1
            )),
            Some(number) => Ok(vec![frame(number)]),
            None => Ok((0..self.frames).map(frame).collect()),
        }
    }
}

fn parse_size(text: &str) -> Result<Size, String> {
    let (width, height) = text
        .split_once('x')
        .ok_or("write it as width x height, like 1280x720")?;
    let side = |text: &str| match text.parse() {
        Ok(side @ 16..=8192) => Ok(side),
        _ => Err(format!("{text} is not a number of pixels from 16 to 8192")),
    };
    Ok(Size {
        width: side(width)?,
        height: side(height)?,
    })
}

fn parse_stretch(text: &str) -> Result<Stretch, String> {
    let (from, to) = text
        .split_once('-')
        .ok_or("write it as two shares of a round, like 0.25-0.5")?;
    let share = |text: &str| match text.parse() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err(format!("{text} is not a number from 0 to 1")),
    };
    let stretch = Stretch {
        from: share(from)?,
        to: share(to)?,
    };
    match stretch.from < stretch.to {
        true => Ok(stretch),
        false => Err(format!("{text} ends before it begins")),
    }
}

fn parse_error_px(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(error_px) if (0.0..=1e6).contains(&error_px) => Ok(error_px),
        _ => Err(format!(
            "{text} is not a number of pixels from 0 to 1000000"
        )),
    }
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
        let size = Size {
            width: 640,
            height: 360,
        };
        assert_eq!(parse_size("640x360"), Ok(size));
    }

    #[test]
    fn frames_are_spread_over_a_stretch() {
        for stretch in ["", "0.5", "0.5-0.2", "0.2-1.5", "a-b", "-0.2-0.5"] {
            assert!(parse_stretch(stretch).is_err(), "{stretch}");
        }
        let args = ["walkthrough", "--stretch", "0.25-0.75", "--frames", "2"];
        let args = Args::parse_from(args);
        assert_eq!(args.frames(), Ok(vec![(0, 0.25), (1, 0.5)]));
    }

    #[test]
    fn a_still_is_one_frame_of_the_path() {
        let args = Args::parse_from(["walkthrough", "--still", "6", "--frames", "24"]);
        assert_eq!(args.frames(), Ok(vec![(6, 0.25)]));
        let args = Args::parse_from(["walkthrough", "--still", "24"]);
        assert!(args.frames().is_err());
    }
}
