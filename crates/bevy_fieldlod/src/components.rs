//! What a game touches: components, resources and their meaning.

use std::time::Duration;

use bevy::prelude::*;
use fieldlod_select::{LodSettings, Offscreen, Promise};

use crate::{BakedLods, LodKind};

/// Gives levels of detail to the meshes of this entity and of all its descendants.
///
/// Put it on an entity with a [`Mesh3d`], or on the root of a glTF scene. The source meshes are
/// drawn until their hierarchies are ready. Skinned and morphed meshes are left as they are.
/// Removing it puts everything back.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let castle = assets.load(GltfAssetLabel::Scene(0).from_asset("castle.glb"));
///     commands.spawn((WorldAssetRoot(castle), AutoLod::default()));
///     // Twice as fine as all else, cut into units whatever its size.
///     let hero = assets.load(GltfAssetLabel::Primitive { mesh: 0, primitive: 0 }.from_asset("hero.glb"));
///     let fine = AutoLod { kind: LodKind::Clusters, bias: 2.0, ..default() };
///     commands.spawn((Mesh3d(hero), fine));
/// }
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct AutoLod {
    /// Where to find the hierarchies: the asset made by `fieldlod bake`. Without it they are looked
    /// for beside the asset and in the cache, or baked in background tasks.
    pub baked: Option<Handle<BakedLods>>,
    /// How the meshes are given levels of detail.
    pub kind: LodKind,
    /// How much an error on these meshes counts: 2 draws them as fine as at half the distance.
    pub bias: f32,
}

impl Default for AutoLod {
    /// Everything chosen by the plugin; errors count once.
    fn default() -> Self {
        Self {
            baked: None,
            kind: LodKind::Auto,
            bias: 1.0,
        }
    }
}

impl AutoLod {
    /// Uses the hierarchies of a `.fieldlod` file instead of baking.
    #[must_use]
    pub fn from_file(baked: Handle<BakedLods>) -> Self {
        Self {
            baked: Some(baked),
            ..Self::default()
        }
    }

    /// The default with a chosen kind of levels.
    #[must_use]
    pub fn of_kind(kind: LodKind) -> Self {
        Self {
            kind,
            ..Self::default()
        }
    }
}

/// Leaves the meshes of this entity and of its descendants as they are, within an [`AutoLod`] or
/// where [`FieldLodConfig::whole_world`](crate::FieldLodConfig::whole_world) is set.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct NoLod;

/// How fine the cuts of a camera are; put it on the camera. A camera without it uses the default.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn setup(mut commands: Commands) {
///     commands.spawn((Camera3d::default(), FieldLodSettings::with_error_px(1.5)));
///     // A mirror, which nobody looks at closely.
///     let mirror = FieldLodSettings {
///         triangle_budget: Some(200_000),
///         ..FieldLodSettings::with_error_px(4.0)
///     };
///     commands.spawn((Camera3d::default(), mirror));
/// }
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct FieldLodSettings {
    /// Largest screen-space error in physical pixels that a simplification may show.
    pub error_px: f32,
    /// Bounds every displacement of the surface in the image by `error_px`, instead of the error of
    /// the picture as a whole: no outliers, at the cost of more triangles. It rests on deviations
    /// measured against the source.
    pub guaranteed: bool,
    /// Without `guaranteed`: still no displacement above this many pixels, if given.
    pub displacement_cap_px: Option<f32>,
    /// A piece that was refined stays so until its error falls below this share of `error_px`.
    pub hysteresis: f32,
    /// Aspect ratio of the sampling pattern below which `error_px` is relaxed: from 0 (never) to 1.
    /// Towards the corners of a very wide image more triangles no longer look better.
    pub min_aspect_ratio: f32,
    /// Relative change of the sampling density across a piece below which one sample stands for it;
    /// 0 always bounds it over the piece. Larger is faster and less strict.
    pub max_curl: f32,
    /// Triangles that this view may draw, before frustum culling; `error_px` gives way to it.
    pub triangle_budget: Option<u64>,
    /// Rendered pixels for each pixel of the view's target along one axis: 0.5 where an upscaler
    /// doubles both.
    pub resolution_scale: f32,
    /// Margin around the image that is selected as if it were seen, as a share of the image's size
    /// on each side: what stands there may cast its shadow into the image, or come into it with a
    /// fast turn.
    pub offscreen_margin: f32,
    /// Whether what stands further out keeps its shape, as its distance asks, while some light casts
    /// shadows: for shadows that reach far into the image. Otherwise it is at its coarsest.
    pub offscreen_casters: bool,
    /// Margin around that in which a refined piece still counts as seen: it leaves the view later than
    /// it entered.
    pub edge_hysteresis: f32,
    /// Draws the source meshes in this view instead of a cut: for comparison.
    pub full_detail: bool,
}

impl Default for FieldLodSettings {
    /// 1 px of quality, coarsening below 0.8 px, with a margin of half the image on each side.
    fn default() -> Self {
        let settings = LodSettings::default();
        Self {
            error_px: settings.error_px,
            guaranteed: false,
            displacement_cap_px: None,
            hysteresis: settings.hysteresis,
            min_aspect_ratio: settings.min_aspect_ratio,
            max_curl: settings.max_curl,
            triangle_budget: None,
            resolution_scale: settings.resolution_scale,
            offscreen_margin: 0.5,
            offscreen_casters: true,
            edge_hysteresis: settings.edge_hysteresis,
            full_detail: false,
        }
    }
}

impl FieldLodSettings {
    /// The default at another error in physical pixels.
    #[must_use]
    pub fn with_error_px(error_px: f32) -> Self {
        Self {
            error_px,
            ..Self::default()
        }
    }

    /// As many triangles as `triangle_budget`, at the best quality that it buys.
    #[must_use]
    pub fn with_triangle_budget(triangle_budget: u64) -> Self {
        Self {
            triangle_budget: Some(triangle_budget),
            ..Self::default()
        }
    }

    /// What selection reads of it; `casts` says whether some light casts shadows.
    #[must_use]
    pub fn selection(&self, casts: bool) -> LodSettings {
        let promise = match (self.guaranteed, self.displacement_cap_px) {
            (true, _) => Promise::Guaranteed,
            (false, Some(cap_px)) => Promise::Both { cap_px },
            (false, None) => Promise::Quality,
        };
        LodSettings {
            error_px: self.error_px,
            hysteresis: self.hysteresis,
            promise,
            min_aspect_ratio: self.min_aspect_ratio,
            max_curl: self.max_curl,
            resolution_scale: self.resolution_scale,
            offscreen_margin: self.offscreen_margin,
            offscreen: if casts && self.offscreen_casters {
                Offscreen::OnAxis
            } else {
                Offscreen::Coarsest
            },
            edge_hysteresis: self.edge_hysteresis,
            triangle_budget: self.triangle_budget,
        }
    }
}

/// What a camera drew in the last frame of the meshes that have levels of detail, after frustum
/// culling. The plugin keeps it up to date on every camera.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct FieldLodViewStats {
    /// Triangles drawn.
    pub triangles_drawn: u64,
    /// Triangles that would have been drawn without levels of detail.
    pub triangles_full: u64,
    /// Drawable units and whole meshes drawn.
    pub units_drawn: u32,
    /// The error in pixels that was selected for: that which meets the budget, if there is one.
    pub error_px: f32,
    /// Time that selecting this view's cuts took on the CPU.
    pub selection_time: Duration,
}

/// Ways to see what the selection does. All but `freeze` need `FieldLodDebugPlugin`, of the feature
/// `debug`.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Clone, Default, PartialEq)]
pub struct FieldLodDebug {
    /// Paints each level of detail in its own colour.
    pub color_levels: bool,
    /// Paints the camera-sampling field on the surfaces instead.
    pub heat_map: Option<FieldLodHeatMap>,
    /// Selects as if every camera stayed where it is, so that one can fly off and look at its cut.
    pub freeze: bool,
    /// Draws the boxes of what is drawn, as gizmos of the group `FieldLodGizmos`.
    pub bounds: bool,
    /// Writes the numbers of all cameras over the picture.
    pub overlay: bool,
}

/// A quantity of the camera-sampling field, from blue (little) over green to red (much).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Reflect)]
#[reflect(Clone, PartialEq)]
pub enum FieldLodHeatMap {
    /// Samples per unit of surface area: `c·n` (eq. 16), by its logarithm.
    SamplingDensity,
    /// Aspect ratio of the sampling pattern, cos φ (§3.4): red where it is stretched.
    AspectRatio,
    /// Relative change of the field across a unit of length, `|curl c| / c` (eq. 12), by its
    /// logarithm.
    Curl,
    /// The error of what is drawn, in pixels: green at half a pixel, red from one on.
    PixelError,
}

/// How far the world's meshes have come. Counts entities with a [`Mesh3d`] under an [`AutoLod`].
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn show(progress: Res<FieldLodProgress>, mut bar: Single<&mut Node, With<Name>>) {
///     bar.width = percent(100.0 * progress.share_done());
/// }
/// # bevy::ecs::system::assert_is_system(show);
/// ```
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Clone, Default, PartialEq)]
pub struct FieldLodProgress {
    /// Their mesh is being loaded, baked or uploaded; drawn in full meanwhile.
    pub waiting: u32,
    /// Meshes, not entities, that background tasks are working on.
    pub baking: u32,
    /// Drawn by the cut of each camera.
    pub ready: u32,
    /// Drawn as they are for good: too small, or no hierarchy could be had, or none applies.
    pub plain: u32,
}

impl FieldLodProgress {
    /// The share of the entities that wait for nothing any more, from 0 to 1; 1 if there are none.
    #[must_use]
    pub fn share_done(&self) -> f32 {
        let done = self.ready + self.plain;
        let all = done + self.waiting;
        if all == 0 {
            1.0
        } else {
            done as f32 / all as f32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_selects_as_the_library_does_but_for_the_margin() {
        let expected = LodSettings {
            offscreen_margin: 0.5,
            ..LodSettings::default()
        };
        assert_eq!(FieldLodSettings::default().selection(false), expected);
        let casting = LodSettings {
            offscreen: Offscreen::OnAxis,
            ..expected
        };
        assert_eq!(FieldLodSettings::default().selection(true), casting);
    }

    #[test]
    fn a_cap_gives_way_to_a_guarantee() {
        let capped = FieldLodSettings {
            displacement_cap_px: Some(3.0),
            ..default()
        };
        assert_eq!(
            capped.selection(false).promise,
            Promise::Both { cap_px: 3.0 }
        );
        let both = FieldLodSettings {
            guaranteed: true,
            ..capped
        };
        assert_eq!(both.selection(false).promise, Promise::Guaranteed);
    }

    #[test]
    fn the_share_done_counts_what_waits() {
        let mut progress = FieldLodProgress::default();
        assert_eq!(progress.share_done(), 1.0);
        progress.waiting = 3;
        assert_eq!(progress.share_done(), 0.0);
        progress.plain = 1;
        assert_eq!(progress.share_done(), 0.25);
    }
}
