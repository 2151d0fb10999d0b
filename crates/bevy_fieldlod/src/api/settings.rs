//! Settings of a camera.

use bevy::prelude::*;
use fieldlod_select::{LodSettings, Offscreen};

/// Selection settings of a camera, as a component of the camera. A camera without it uses the default.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn setup(mut commands: Commands) {
///     commands.spawn((Camera3d::default(), FieldLodSettings::with_error_px(1.5)));
///     // A mirror that nobody inspects closely.
///     let mirror = FieldLodSettings {
///         triangle_budget: Some(200_000),
///         ..FieldLodSettings::with_error_px(4.0)
///     };
///     commands.spawn((Camera3d::default(), mirror));
///     // A view from high above: culls objects below 4 px, and casts finer shadows from outside the image.
///     let above = FieldLodSettings {
///         cull_below_px: Some(4.0),
///         shadow_bias: 0.5,
///         ..default()
///     };
///     commands.spawn((Camera3d::default(), above));
///     // Every object at its second finest level, for inspection.
///     let level_1 = FieldLodSettings {
///         forced_level: Some(1),
///         ..default()
///     };
///     commands.spawn((Camera3d::default(), level_1));
/// }
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct FieldLodSettings {
    /// Quality: the largest screen-space error of a simplification, in physical pixels. Single points may move
    /// further.
    pub error_px: Option<f32>,
    /// Guarantee: the largest displacement of the surface in the image, in physical pixels. It needs more triangles
    /// than [`error_px`](Self::error_px), and deviations measured by the bake: a mesh without them is drawn at full
    /// detail, and the log names it once. If both thresholds are set, both hold; if neither is set, every mesh is
    /// drawn at its coarsest level.
    pub displacement_px: Option<f32>,
    /// A refined piece stays refined until its error falls below this share of the thresholds.
    pub hysteresis: f32,
    /// Aspect ratio of the sampling pattern, from 0 to 1, below which the thresholds are relaxed; 0 disables it.
    /// Towards the corners of a very wide image, more triangles do not improve the picture.
    pub min_aspect_ratio: f32,
    /// Relative change of the sampling density across a piece up to which one sample represents the piece; 0 always
    /// bounds the density over the piece. A larger value draws fewer triangles at the same `error_px`, and allows
    /// larger displacements of single points.
    pub max_curl: f32,
    /// Largest number of triangles of this view, before frustum culling. If the thresholds need more, they are
    /// scaled up.
    pub triangle_budget: Option<u64>,
    /// Rendered pixels per pixel of the view's target along one axis: 0.5 if an upscaler doubles both axes.
    pub resolution_scale: f32,
    /// Margin around the image in which objects are selected as if they were visible, as a share of the image's size
    /// on each side. Objects in it may cast shadows into the image, or enter it with a fast turn.
    pub offscreen_margin: f32,
    /// Weight of the errors of objects outside the margin, from 0 to 1, while a light with shadows reaches the view.
    /// 0 draws them at their coarsest level, 1 at the level that their distance needs. Shadows that reach far into
    /// the image keep their shape at 0.3.
    pub shadow_bias: f32,
    /// Additional margin, as a share of the image's size, within which a refined piece still counts as visible: a
    /// piece leaves the view later than it enters.
    pub edge_hysteresis: f32,
    /// Culls objects whose bounding sphere is smaller on screen than this diameter, in physical pixels, and their
    /// shadows; `None` culls nothing. The size counts as in the middle of the image, times
    /// [`AutoLod::bias`](crate::AutoLod::bias), so turning the camera culls nothing. A drawn object stays until it
    /// is smaller than [`hysteresis`](Self::hysteresis) times the threshold. Only objects with levels of detail are
    /// culled. A prop that any view draws casts its shadow for all views.
    pub cull_below_px: Option<f32>,
    /// Draws every object at this level in this view, or at its coarsest level if it has fewer. 0 draws the source
    /// meshes instead of a cut, for comparison. A prop has one level in all views, the finest that a view needs.
    pub forced_level: Option<u32>,
}

impl Default for FieldLodSettings {
    /// 1 px of screen-space error, coarsening below 0.8 px, with a margin of a tenth of the image on each side.
    fn default() -> Self {
        let settings = LodSettings::default();
        Self {
            error_px: settings.error_px,
            displacement_px: settings.displacement_px,
            hysteresis: settings.hysteresis,
            min_aspect_ratio: settings.min_aspect_ratio,
            max_curl: settings.max_curl,
            triangle_budget: None,
            resolution_scale: settings.resolution_scale,
            offscreen_margin: 0.1,
            shadow_bias: 0.3,
            edge_hysteresis: settings.edge_hysteresis,
            cull_below_px: None,
            forced_level: None,
        }
    }
}

impl FieldLodSettings {
    /// The default with another screen-space error, in physical pixels.
    #[must_use]
    pub fn with_error_px(error_px: f32) -> Self {
        Self {
            error_px: Some(error_px),
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

    /// Weight of the errors of objects that only cast shadows; `None` if no light casts shadows.
    fn caster_bias(&self, has_shadows: bool) -> Option<f32> {
        let bias = self.shadow_bias.min(1.0);
        (has_shadows && bias > 0.0).then_some(bias)
    }

    /// The settings of the selection crate. `has_shadows` tells whether a light casts shadows into the view.
    #[must_use]
    pub fn to_lod_settings(&self, has_shadows: bool) -> LodSettings {
        LodSettings {
            error_px: self.error_px,
            displacement_px: self.displacement_px,
            hysteresis: self.hysteresis,
            min_aspect_ratio: self.min_aspect_ratio,
            max_curl: self.max_curl,
            resolution_scale: self.resolution_scale,
            offscreen_margin: self.offscreen_margin,
            offscreen: match self.caster_bias(has_shadows) {
                Some(bias) => Offscreen::OnAxis { bias },
                None => Offscreen::Coarsest,
            },
            edge_hysteresis: self.edge_hysteresis,
            triangle_budget: self.triangle_budget,
            cull_below_px: self.cull_below_px,
            forced_level: self.forced_level,
            visible_flux: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_differs_from_library_by_margin_only() {
        let expected = LodSettings {
            offscreen_margin: 0.1,
            ..LodSettings::default()
        };
        assert_eq!(FieldLodSettings::default().to_lod_settings(false), expected);
        let casting = LodSettings {
            offscreen: Offscreen::OnAxis { bias: 0.3 },
            ..expected
        };
        assert_eq!(FieldLodSettings::default().to_lod_settings(true), casting);
        let without = FieldLodSettings {
            shadow_bias: 0.0,
            ..default()
        };
        assert_eq!(without.to_lod_settings(true), expected);
    }
}
