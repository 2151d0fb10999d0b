//! Settings of a camera.

use bevy::prelude::*;
use fieldlod_select::{LodSettings, Offscreen, VisibleFlux};

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
///     // A view from high above: nothing that is smaller than 4 px, and coarse shadows from outside.
///     let above = FieldLodSettings {
///         cull_below_px: Some(4.0),
///         shadow_bias: 0.5,
///         ..default()
///     };
///     commands.spawn((Camera3d::default(), above));
///     // Everything at its second finest level, to see what that is like.
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
    /// Quality: the largest screen-space error in physical pixels that a simplification may show. Single
    /// points may be displaced by more.
    pub error_px: Option<f32>,
    /// Guarantee: the largest displacement of the surface in the image, in physical pixels, at the cost of
    /// more triangles. It rests on deviations measured against the source: a mesh that was baked without
    /// measuring is drawn in full, and the log says so once. With both thresholds, neither is exceeded;
    /// with none, everything is at its coarsest.
    pub displacement_px: Option<f32>,
    /// A piece that was refined stays so until it falls below this share of the thresholds.
    pub hysteresis: f32,
    /// Aspect ratio of the sampling pattern below which the thresholds are relaxed: from 0 (never) to 1.
    /// Towards the corners of a very wide image more triangles no longer look better.
    pub min_aspect_ratio: f32,
    /// Relative change of the sampling density across a piece below which one sample stands for it;
    /// 0 always bounds it over the piece. A larger one draws fewer triangles at the same `error_px`, and
    /// lets single displacements grow; it is not faster.
    pub max_curl: f32,
    /// Triangles that this view may draw, before frustum culling. Where the thresholds ask for more, they
    /// are scaled up; nothing is drawn finer than they ask for.
    pub triangle_budget: Option<u64>,
    /// Rendered pixels for each pixel of the view's target along one axis: 0.5 where an upscaler
    /// doubles both.
    pub resolution_scale: f32,
    /// Margin around the image that is selected as if it were seen, as a share of the image's size
    /// on each side: what stands there may cast its shadow into the image, or come into it with a
    /// fast turn.
    pub offscreen_margin: f32,
    /// How much an error counts of what stands outside the margin, while some light that reaches the view
    /// casts shadows: from 0, which leaves it at its coarsest, to 1, which draws the level that its distance
    /// asks for. Shadows that reach far into the image keep their shape at 0.3, and most of what is drawn in a
    /// frame may be such casters (`docs/tuning.md`).
    pub shadow_bias: f32,
    /// Largest error, in texels of the cascade, of a coarser level that casts a prop's shadow for a sun. A larger
    /// value draws fewer triangles into far cascades, but a level that errs by more than the shadow bias hides puts
    /// sunlit surfaces into shadow. 0 draws the level of the view into every cascade. Has an effect only while the
    /// GPU culls ([`FieldLodConfig::gpu_culling`](crate::FieldLodConfig::gpu_culling)).
    pub shadow_error_texels: f32,
    /// Further margin, as a share of the image's size, in which a refined piece still counts as seen: it
    /// leaves the view later than it entered.
    pub edge_hysteresis: f32,
    /// Counts errors by how much of a thing nothing hides: fewer triangles for the same picture where much
    /// stands behind other things, for about a millisecond of the CPU in a view of thousands. Nothing is
    /// culled. Things with a `StandardMaterial` that is opaque hide others.
    pub visible_flux: bool,
    /// The most triangles that are drawn for that into a small depth image on the CPU.
    pub occluder_triangles: u32,
    /// Does not draw what is smaller on screen, in physical pixels, nor its shadow; `None` draws everything.
    /// The size is the diameter of a sphere around the object, times its [`AutoLod::bias`](crate::AutoLod::bias),
    /// as large as it would be in the middle of the image: a camera that only turns draws what it drew. What
    /// is drawn stays until it is smaller than [`hysteresis`](Self::hysteresis) times that. Only what has
    /// levels of detail goes. A prop that any view draws casts its shadow for all.
    pub cull_below_px: Option<f32>,
    /// Draws every object at this level in this view, whatever it shows: 0 draws the source meshes instead
    /// of a cut, for comparison; the coarsest where a mesh has fewer. A prop has one level in all views, the
    /// finest that one of them asks for.
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
            shadow_error_texels: 0.0,
            edge_hysteresis: settings.edge_hysteresis,
            visible_flux: false,
            occluder_triangles: VisibleFlux::default().occluder_triangles,
            cull_below_px: None,
            forced_level: None,
        }
    }
}

impl FieldLodSettings {
    /// The default at another screen-space error in physical pixels.
    #[must_use]
    pub fn with_error_px(error_px: f32) -> Self {
        Self {
            error_px: Some(error_px),
            ..Self::default()
        }
    }

    /// The default with no more triangles than `triangle_budget`.
    #[must_use]
    pub fn with_triangle_budget(triangle_budget: u64) -> Self {
        Self {
            triangle_budget: Some(triangle_budget),
            ..Self::default()
        }
    }

    /// The largest error of what casts shadows, in texels.
    pub(crate) fn texels_of_casters(&self) -> f32 {
        if self.forced_level.is_some() {
            0.0
        } else {
            self.shadow_error_texels
        }
    }

    /// How hidden things count, whether they throw shadows or not: pictures with shadows need no more of them
    /// (`docs/tuning.md`).
    fn flux(&self) -> VisibleFlux {
        VisibleFlux {
            occluder_triangles: self.occluder_triangles,
            ..VisibleFlux::default()
        }
    }

    /// How much errors count of what only casts shadows; `None` if nothing does.
    fn caster_bias(&self, has_shadows: bool) -> Option<f32> {
        let bias = self.shadow_bias.min(1.0);
        (has_shadows && bias > 0.0).then_some(bias)
    }

    /// The settings that selection reads; `has_shadows` says whether some light casts
    /// shadows into the view.
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
            visible_flux: self.visible_flux.then(|| self.flux()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_selects_as_the_library_does_but_for_the_margin() {
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
