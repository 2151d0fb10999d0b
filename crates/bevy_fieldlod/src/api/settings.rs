//! Settings of a camera.

use bevy::prelude::*;
use fieldlod_select::{AdvancedSettings, LodSettings, Offscreen};

/// Selection settings of a camera, as a component of the camera. A camera without it uses the default.
///
/// A group is refined if either threshold is exceeded, [`error_px`](Self::error_px) or
/// [`displacement_px`](Self::displacement_px). Without thresholds, the coarsest levels are drawn. Pixels are rendered
/// pixels.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn setup(mut commands: Commands) {
///     commands.spawn((Camera3d::default(), FieldLodCamera::high()));
///     // A mirror in which coarse levels are good enough.
///     let mirror = FieldLodCamera {
///         error_px: Some(4.0),
///         triangle_budget: Some(200_000),
///         ..default()
///     };
///     commands.spawn((Camera3d::default(), mirror));
///     // A view from high above casts finer shadows from outside the image.
///     let mut above = FieldLodCamera::high();
///     above.shadow_bias = 0.5;
///     commands.spawn((Camera3d::default(), above));
///     // Every object at its second finest level, for inspection.
///     commands.spawn((Camera3d::default(), FieldLodCamera::at_level(1)));
/// }
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct FieldLodCamera {
    /// Quality: the largest screen-space error of a simplification. It is like a root mean square: single points may
    /// move farther.
    pub error_px: Option<f32>,
    /// Guarantee: the largest displacement of the surface in the image. It needs more triangles than
    /// [`error_px`](Self::error_px), and deviations measured by the bake: a mesh without them is drawn in full detail.
    /// Bakes at run time measure them once the first camera has a limit.
    pub displacement_px: Option<f32>,
    /// Largest number of triangles, before frustum culling. If the thresholds need more, they are scaled up; the
    /// coarsest levels may still exceed it.
    pub triangle_budget: Option<u64>,
    /// Draws every object at this level, or at the coarsest level if it has fewer. 0 draws the source meshes instead of
    /// a cut. The thresholds, the budget and [`FieldLodVisibleFlux`](crate::FieldLodVisibleFlux) are ignored then. A
    /// prop has one level in all views, the finest that any view needs, and casts the shadow of this level.
    pub forced_level: Option<u32>,
    /// Rendered pixels per pixel of the target along one axis: 0.5 if an upscaler doubles both axes.
    pub resolution_scale: f32,
    /// Factor of the errors of objects outside the image and its margin, from 0 to 1. It applies while a light with
    /// shadows reaches the view. 0 draws these objects at their coarsest level, 1 at the level that their distance
    /// needs. At 0.3, shadows that reach far into the image keep their shape.
    pub shadow_bias: f32,
    /// Settings that are rarely changed.
    pub advanced: AdvancedCamera,
}

/// Selection settings of a camera that are rarely changed.
#[derive(Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Clone, Default, PartialEq)]
pub struct AdvancedCamera {
    /// A refined group stays refined until its error falls below this share of the thresholds; 1 is no hysteresis. It
    /// keeps levels from flickering near a threshold.
    pub hysteresis: f32,
    /// Aspect ratio of the sampling pattern, from 0 to 1, below which the thresholds are relaxed; 0 disables it.
    pub min_aspect_ratio: f32,
    /// Relative change of the sampling density across a group, up to which one sample at its centre represents the
    /// group. 0 always uses the bound over the group's sphere. Larger values draw fewer triangles and allow larger
    /// displacements of single points.
    pub max_curl: f32,
    /// Margin around the image that counts as visible, as a share of the image's size on each side. Objects in it may
    /// cast shadows into the image, or enter the image with a fast turn.
    pub offscreen_margin: f32,
    /// Additional margin, within which a refined group still counts as visible, so that head-bob does not swap levels
    /// along the image's edge.
    pub edge_hysteresis: f32,
}

impl Default for AdvancedCamera {
    /// Groups coarsen below 0.8 of the thresholds, or 10 % of the image beyond a margin of 10 %; the bound everywhere.
    fn default() -> Self {
        let AdvancedSettings {
            hysteresis,
            min_aspect_ratio,
            max_curl,
            edge_hysteresis,
            ..
        } = AdvancedSettings::default();
        Self {
            hysteresis,
            min_aspect_ratio,
            max_curl,
            // By default, selection has no margin. A camera needs one for fast turns and for casters beside the image.
            offscreen_margin: 0.1,
            edge_hysteresis,
        }
    }
}

impl Default for FieldLodCamera {
    /// The preset [`high`](Self::high).
    fn default() -> Self {
        Self::high()
    }
}

impl FieldLodCamera {
    /// 4 px of screen-space error.
    #[must_use]
    pub fn low() -> Self {
        Self::with_error_px(4.0)
    }

    /// 2 px of screen-space error.
    #[must_use]
    pub fn medium() -> Self {
        Self::with_error_px(2.0)
    }

    /// 1 px of screen-space error.
    #[must_use]
    pub fn high() -> Self {
        Self::with_error_px(1.0)
    }

    /// Half a pixel of screen-space error.
    #[must_use]
    pub fn ultra() -> Self {
        Self::with_error_px(0.5)
    }

    /// A limit of the screen-space error, in physical pixels. Groups coarsen below 0.8 of the limit. Objects count as
    /// inside the image up to a tenth of its size beyond each edge.
    #[must_use]
    pub fn with_error_px(error_px: f32) -> Self {
        Self {
            error_px: Some(error_px),
            displacement_px: None,
            triangle_budget: None,
            forced_level: None,
            resolution_scale: 1.0,
            shadow_bias: 0.3,
            advanced: AdvancedCamera::default(),
        }
    }

    /// No displacement above `displacement_px` physical pixels. The screen-space error is not limited.
    #[must_use]
    pub fn guaranteed(displacement_px: f32) -> Self {
        Self {
            error_px: None,
            displacement_px: Some(displacement_px),
            ..Self::default()
        }
    }

    /// The default with a triangle budget.
    #[must_use]
    pub fn with_triangle_budget(triangle_budget: u64) -> Self {
        Self {
            triangle_budget: Some(triangle_budget),
            ..Self::default()
        }
    }

    /// Every object at this level; 0 draws the source meshes.
    #[must_use]
    pub fn at_level(level: u32) -> Self {
        Self {
            forced_level: Some(level),
            ..Self::default()
        }
    }

    /// Returns the selection settings. `has_shadows` is whether a light casts shadows into the view.
    pub(crate) fn to_lod_settings(self, has_shadows: bool) -> LodSettings {
        // With a larger factor, objects outside the image would be finer than those in it.
        let bias = self.shadow_bias.min(1.0);
        let offscreen = if has_shadows && bias > 0.0 {
            Offscreen::OnAxis { bias }
        } else {
            Offscreen::Coarsest
        };
        LodSettings {
            error_px: self.error_px,
            displacement_px: self.displacement_px,
            triangle_budget: self.triangle_budget,
            forced_level: self.forced_level,
            resolution_scale: self.resolution_scale,
            advanced: AdvancedSettings {
                hysteresis: self.advanced.hysteresis,
                min_aspect_ratio: self.advanced.min_aspect_ratio,
                max_curl: self.advanced.max_curl,
                offscreen_margin: self.advanced.offscreen_margin,
                offscreen,
                edge_hysteresis: self.advanced.edge_hysteresis,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shadows_refine_casters_outside_the_image() {
        let settings = FieldLodCamera::default();
        let offscreen =
            |settings: FieldLodCamera, lit| settings.to_lod_settings(lit).advanced.offscreen;
        assert_eq!(offscreen(settings, false), Offscreen::Coarsest);
        assert_eq!(offscreen(settings, true), Offscreen::OnAxis { bias: 0.3 });
        let without = FieldLodCamera {
            shadow_bias: 0.0,
            ..settings
        };
        assert_eq!(offscreen(without, true), Offscreen::Coarsest);
    }

    #[test]
    fn presets_get_finer() {
        let presets = [
            FieldLodCamera::low(),
            FieldLodCamera::medium(),
            FieldLodCamera::high(),
            FieldLodCamera::ultra(),
        ];
        let is_finer = |pair: &[FieldLodCamera]| pair[1].error_px < pair[0].error_px;
        assert!(presets.windows(2).all(is_finer));
        assert_eq!(FieldLodCamera::default(), FieldLodCamera::high());
    }
}
