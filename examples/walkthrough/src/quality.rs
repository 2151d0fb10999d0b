//! How finely the scene is shown: in full where a GPU draws it, reduced where the processor does.

use bevy::light::ShadowFilteringMethod;
use bevy::prelude::*;

use crate::adapter::Adapter;
use crate::args::Args;

/// What a frame costs to draw, and how many of them there are.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quality {
    /// Whether the processor draws, and less is shown for that.
    pub(crate) is_reduced: bool,
    /// Size of the pictures, or of the window, in physical pixels.
    pub(crate) size_in_px: UVec2,
    /// Pictures, or selections, along the camera path.
    pub(crate) frames: u32,
    /// Largest screen-space error, in physical pixels.
    pub(crate) error_px: f32,
    /// Samples for each pixel.
    pub(crate) msaa: Msaa,
    /// Share of the trees and of the undergrowth that is there, from 0 to 1.
    pub(crate) vegetation: f32,
    /// Squares of the ground along a side, of two triangles each.
    pub(crate) ground_squares: u32,
    /// Most texels of the ground's texture along the longer side of a stretched pixel.
    pub(crate) ground_anisotropy: u16,
    /// Shadow maps of sun and moon, each for a range of distances.
    pub(crate) shadow_cascades: usize,
    /// Distance from the camera at which the shadows of sun and moon end.
    pub(crate) shadow_distance_in_m: f32,
    /// Side of a shadow map of sun and moon.
    pub(crate) shadow_map_in_texels: usize,
    /// How shadows are smoothed.
    pub(crate) shadow_filter: ShadowFilteringMethod,
}

impl Quality {
    /// The quality for a GPU.
    pub(crate) const FULL: Self = Self {
        is_reduced: false,
        size_in_px: UVec2::new(1280, 720),
        frames: 24,
        error_px: 1.0,
        msaa: Msaa::Sample4,
        vegetation: 1.0,
        ground_squares: 620,
        ground_anisotropy: 4,
        shadow_cascades: 4,
        shadow_distance_in_m: 280.0,
        shadow_map_in_texels: 2048,
        shadow_filter: ShadowFilteringMethod::Gaussian,
    };

    /// The quality for a software adapter on two cores.
    pub(crate) const REDUCED: Self = Self {
        is_reduced: true,
        size_in_px: UVec2::new(800, 450),
        frames: 12,
        error_px: 2.0,
        msaa: Msaa::Off,
        vegetation: 0.6,
        ground_squares: 310,
        shadow_cascades: 1,
        shadow_distance_in_m: 90.0,
        shadow_map_in_texels: 1024,
        shadow_filter: ShadowFilteringMethod::Hardware2x2,
        ..Self::FULL
    };

    /// Chooses the quality that suits the adapter; what the command line names is obeyed.
    pub(crate) fn choose(args: &Args, adapter: Adapter) -> Self {
        let is_software = adapter == Adapter::Software;
        let preset = match is_software && !args.full {
            true => Self::REDUCED,
            false => Self::FULL,
        };
        Self {
            size_in_px: args.size.unwrap_or(preset.size_in_px),
            frames: args.frames.unwrap_or(preset.frames),
            error_px: args.error_px.unwrap_or(preset.error_px),
            // Mesa's software adapter walks all texels under a pixel one by one, however far it
            // stretches, and where a large triangle meets the horizon it seems to hang.
            ground_anisotropy: match is_software {
                true => 1,
                false => preset.ground_anisotropy,
            },
            ..preset
        }
    }

    /// The quality in words, for screen and summary.
    pub(crate) fn description(&self) -> &'static str {
        match self.is_reduced {
            true => "reduced for a software adapter, --full shows all",
            false => "full",
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    fn chosen(arguments: &[&str], adapter: Adapter) -> Quality {
        let arguments = ["walkthrough"].iter().chain(arguments);
        Quality::choose(&Args::parse_from(arguments), adapter)
    }

    #[test]
    fn only_a_software_adapter_reduces_the_quality() {
        assert_eq!(chosen(&[], Adapter::Gpu), Quality::FULL);
        assert_eq!(chosen(&[], Adapter::None), Quality::FULL);
        let reduced = chosen(&[], Adapter::Software);
        assert!(reduced.is_reduced);
        assert_eq!(reduced.frames, 12);
        assert!(reduced.vegetation < Quality::FULL.vegetation);
    }

    #[test]
    fn full_quality_can_be_asked_for_but_for_what_software_adapters_hang_on() {
        let full = chosen(&["--full"], Adapter::Software);
        let even = Quality {
            ground_anisotropy: 1,
            ..Quality::FULL
        };
        assert_eq!(full, even);
        assert_eq!(chosen(&["--full"], Adapter::Gpu), Quality::FULL);
    }

    #[test]
    fn what_the_command_line_names_is_obeyed_at_any_quality() {
        let arguments = ["--size", "800x600", "--frames", "5", "--error-px", "0.5"];
        for adapter in [Adapter::None, Adapter::Software, Adapter::Gpu] {
            let quality = chosen(&arguments, adapter);
            assert_eq!(quality.size_in_px, UVec2::new(800, 600));
            assert_eq!((quality.frames, quality.error_px), (5, 0.5));
            assert_eq!(quality.is_reduced, adapter == Adapter::Software);
        }
    }
}
