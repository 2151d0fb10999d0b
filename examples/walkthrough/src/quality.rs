//! The quality of the scene: full on a GPU, reduced on a software adapter.

use bevy::light::ShadowFilteringMethod;
use bevy::prelude::*;

use crate::adapter::Adapter;
use crate::args::Args;

/// Settings that decide how long a run takes.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quality {
    /// Whether this is the quality for a software adapter.
    pub(crate) is_reduced: bool,
    /// Size of the pictures, or of the window, in physical pixels.
    pub(crate) size_in_px: UVec2,
    /// Frames along the camera path.
    pub(crate) frames: u32,
    /// Largest screen-space error, in physical pixels.
    pub(crate) error_px: f32,
    /// Samples per pixel.
    pub(crate) msaa: Msaa,
    /// Share of the trees and of the undergrowth to show, from 0 to 1.
    pub(crate) vegetation: f32,
    /// Number of squares along a side of the ground. A square has two triangles.
    pub(crate) ground_squares: u32,
    /// The `anisotropy_clamp` of the sampler of the ground's texture.
    pub(crate) ground_anisotropy: u16,
    /// Number of shadow cascades of sun and moon.
    pub(crate) shadow_cascades: usize,
    /// Distance from the camera at which the shadows of sun and moon end.
    pub(crate) shadow_distance_in_m: f32,
    /// Side of a shadow map of sun and moon, in texels.
    pub(crate) shadow_map_in_texels: usize,
    /// The filter of shadow maps.
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

    /// Chooses the quality by the adapter. Options of the command line take precedence.
    pub(crate) fn choose(args: &Args, adapter: Adapter) -> Self {
        let is_software = adapter == Adapter::Software;
        let preset = if is_software && !args.full {
            Self::REDUCED
        } else {
            Self::FULL
        };
        Self {
            size_in_px: args.size.unwrap_or(preset.size_in_px),
            frames: args.frames.unwrap_or(preset.frames),
            error_px: args.error_px.unwrap_or(preset.error_px),
            // Mesa's software adapter reads all texels under a pixel one by one. With anisotropy, a large triangle
            // that reaches the horizon takes minutes.
            ground_anisotropy: if is_software {
                1
            } else {
                preset.ground_anisotropy
            },
            ..preset
        }
    }

    /// The quality in words, for the screen and the summary.
    pub(crate) fn description(&self) -> &'static str {
        if self.is_reduced {
            "reduced for a software adapter; --full shows everything"
        } else {
            "full"
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
    fn software_adapter_reduces_quality() {
        assert_eq!(chosen(&[], Adapter::Gpu), Quality::FULL);
        assert_eq!(chosen(&[], Adapter::None), Quality::FULL);
        assert!(chosen(&[], Adapter::Software).is_reduced);
        let full = chosen(&["--full"], Adapter::Software);
        assert!(!full.is_reduced && full.ground_anisotropy == 1);
    }

    #[test]
    fn options_take_precedence_over_quality() {
        let arguments = ["--size", "800x600", "--frames", "5", "--error-px", "0.5"];
        for adapter in [Adapter::None, Adapter::Software, Adapter::Gpu] {
            let quality = chosen(&arguments, adapter);
            assert_eq!(quality.size_in_px, UVec2::new(800, 600));
            assert_eq!((quality.frames, quality.error_px), (5, 0.5));
            assert_eq!(quality.is_reduced, adapter == Adapter::Software);
        }
    }
}
