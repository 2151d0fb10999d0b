//! Settings of a camera.

use bevy::prelude::*;
use fieldlod_select::{AdvancedSettings, LodSettings, Offscreen};

/// Selection settings of a camera, as a component of the camera. A camera without it uses the default.
///
/// The fields of [`lod`](Self::lod) are also fields of this component, through `Deref`.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn setup(mut commands: Commands) {
///     commands.spawn((Camera3d::default(), FieldLodCamera::high()));
///     // A mirror in which coarse levels are good enough.
///     let mut mirror = FieldLodCamera::with_error_px(4.0);
///     mirror.triangle_budget = Some(200_000);
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
#[derive(Component, Clone, Copy, Debug, Deref, DerefMut, PartialEq, Reflect)]
#[reflect(Component, Clone, Default, PartialEq)]
pub struct FieldLodCamera {
    /// Thresholds, budget and other settings of the selection. [`LodSettings::forced_level`] of 0 draws the source
    /// meshes instead of a cut. A prop has one level in all views, the finest that any view needs, and casts the shadow
    /// of this level. The plugin replaces [`AdvancedSettings::offscreen`] by [`shadow_bias`](Self::shadow_bias), and
    /// [`LodSettings::visible_flux`] by [`FieldLodVisibleFlux`](crate::FieldLodVisibleFlux).
    #[deref]
    pub lod: LodSettings,
    /// Factor of the errors of objects outside the image and its margin, from 0 to 1. It applies while a light with
    /// shadows reaches the view. 0 draws these objects at their coarsest level, 1 at the level that their distance
    /// needs. At 0.3, shadows that reach far into the image keep their shape.
    pub shadow_bias: f32,
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
        Self::from_lod(LodSettings::with_error_px(error_px))
    }

    /// No displacement above `displacement_px` physical pixels. The screen-space error is not limited.
    #[must_use]
    pub fn guaranteed(displacement_px: f32) -> Self {
        Self::from_lod(LodSettings::guaranteed(displacement_px))
    }

    /// The default with a triangle budget.
    #[must_use]
    pub fn with_triangle_budget(triangle_budget: u64) -> Self {
        Self::from_lod(LodSettings::with_triangle_budget(triangle_budget))
    }

    /// Every object at this level; 0 draws the source meshes.
    #[must_use]
    pub fn at_level(level: u32) -> Self {
        Self::from_lod(LodSettings {
            forced_level: Some(level),
            ..LodSettings::default()
        })
    }

    fn from_lod(lod: LodSettings) -> Self {
        // By default, selection has no margin. A camera needs one for fast turns and for casters beside the image.
        let advanced = AdvancedSettings {
            offscreen_margin: 0.1,
            ..lod.advanced
        };
        Self {
            lod: LodSettings { advanced, ..lod },
            shadow_bias: 0.3,
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
            visible_flux: None,
            advanced: AdvancedSettings {
                offscreen,
                ..self.lod.advanced
            },
            ..self.lod
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
