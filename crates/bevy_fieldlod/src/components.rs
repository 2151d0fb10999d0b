//! What a game touches: components, resources and their meaning.

use std::time::Duration;

use bevy::prelude::*;
use fieldlod_select::LodSettings;

use crate::BakedLods;

/// Gives levels of detail to the meshes of this entity and of all its descendants.
///
/// Put it on an entity with a [`Mesh3d`], or on the root of a glTF scene. The source meshes are
/// drawn until their hierarchies are ready. Skinned and morphed meshes are left as they are.
#[derive(Component, Clone, Debug, Default, Reflect)]
#[reflect(Component, Clone, Default)]
pub struct AutoLod {
    /// Where to find the hierarchies: the asset made by `fieldlod bake`. Without it they are baked
    /// in background tasks.
    pub baked: Option<Handle<BakedLods>>,
}

impl AutoLod {
    /// Uses the hierarchies of a `.fieldlod` file instead of baking.
    #[must_use]
    pub fn from_file(baked: Handle<BakedLods>) -> Self {
        Self { baked: Some(baked) }
    }
}

/// How fine the cuts of a camera are; put it on the camera. A camera without it uses the default.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Default)]
pub struct LodView {
    /// Largest screen-space error in physical pixels that a simplification may show.
    pub error_px: f32,
    /// Bounds every displacement of the surface in the image by `error_px`, instead of the error of
    /// the picture as a whole: no outliers, at the cost of more triangles. It rests on deviations
    /// measured against the source.
    pub guaranteed: bool,
    /// A piece that was refined stays so until its error falls below this share of `error_px`.
    pub hysteresis: f32,
    /// Margin around the image that is selected as if it were seen, as a share of the image's size
    /// on each side: what stands there may cast its shadow into the image, or come into it with a
    /// fast turn. Further out everything is at its coarsest.
    pub offscreen_margin: f32,
    /// Draws the source meshes in this view instead of a cut: for comparison.
    pub full_detail: bool,
}

impl Default for LodView {
    /// 1 px of quality, coarsening below 0.8 px, with a margin of half the image on each side.
    fn default() -> Self {
        let settings = LodSettings::default();
        Self {
            error_px: settings.error_px,
            guaranteed: false,
            hysteresis: settings.hysteresis,
            offscreen_margin: 0.5,
            full_detail: false,
        }
    }
}

impl LodView {
    /// The default at another error in physical pixels.
    #[must_use]
    pub fn with_error_px(error_px: f32) -> Self {
        Self {
            error_px,
            ..Self::default()
        }
    }

    pub(crate) fn settings(&self) -> LodSettings {
        let mut settings = if self.guaranteed {
            LodSettings::guaranteed(self.error_px)
        } else {
            LodSettings::with_error_px(self.error_px)
        };
        settings.hysteresis = self.hysteresis;
        settings.offscreen_margin = self.offscreen_margin;
        settings
    }
}

/// What a camera drew in the last frame of the meshes that have levels of detail, after frustum
/// culling. The plugin keeps it up to date on every camera.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Clone, Default)]
pub struct LodViewStats {
    /// Triangles drawn.
    pub triangles_drawn: u64,
    /// Triangles that would have been drawn without levels of detail.
    pub triangles_full: u64,
    /// Drawable units in the visible part of the cut.
    pub units_drawn: u32,
    /// Time that selecting this view's cuts took on the CPU.
    pub selection_time: Duration,
}

/// Ways to see what the selection does.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Clone, Default)]
pub struct LodDebug {
    /// Paints each level of detail in its own colour.
    pub color_levels: bool,
    /// Keeps every camera's cut as it is, so that one can fly off and look at it.
    pub freeze: bool,
}

/// How far the world's meshes have come. Counts entities with a [`Mesh3d`] under an [`AutoLod`].
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Clone, Default)]
pub struct LodStatus {
    /// Their mesh is being loaded, baked or uploaded; drawn in full meanwhile.
    pub waiting: u32,
    /// Drawn by the cut of each camera.
    pub ready: u32,
    /// Drawn as they are for good: no hierarchy could be had, or none applies.
    pub plain: u32,
}
