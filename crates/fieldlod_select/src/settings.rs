//! Settings of the selection.

/// Errors of groups outside the view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    any(feature = "bevy_reflect", feature = "bevy_reflect_0_20"),
    derive(bevy_reflect::Reflect)
)]
pub enum Offscreen {
    /// Errors are 0: the coarsest level is drawn.
    #[default]
    Coarsest,
    /// Errors count as on the view's axis at the same distance and orientation, with the field strength `f²/ρ²`. For
    /// objects outside the view that cast shadows into it.
    OnAxis {
        /// Factor of the errors, above 0 and at most 1: smaller values draw coarser levels.
        bias: f32,
    },
}

/// Settings of the selection in one view.
///
/// A group is refined if either threshold is exceeded: [`error_px`](Self::error_px) by its screen-space error,
/// [`displacement_px`](Self::displacement_px) by its largest displacement. Without thresholds the cut is the
/// coarsest one. A single threshold of 0 accepts groups without error only; a single negative threshold accepts no
/// group. NaN accepts every group if it is the only threshold, and no group beside another threshold. Two different
/// thresholds must be above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    any(feature = "bevy_reflect", feature = "bevy_reflect_0_20"),
    derive(bevy_reflect::Reflect)
)]
pub struct LodSettings {
    /// Quality: the largest screen-space error of a simplification, in rendered pixels
    /// ([`group_error_px`](crate::group_error_px)). The error is RMS-like: single points may move farther.
    pub error_px: Option<f32>,
    /// Guarantee: the largest displacement of the surface in the image, in rendered pixels
    /// ([`group_error_px`](crate::group_error_px)). It needs more triangles than
    /// [`error_px`](Self::error_px), and deviations measured by the bake: a mesh without them is drawn at full
    /// detail. If both thresholds are set, both hold.
    pub displacement_px: Option<f32>,
    /// Largest number of triangles of this view, before frustum culling. If the thresholds need more, the
    /// [`Selector`](crate::Selector) scales them up; the coarsest levels may still exceed it.
    /// [`select`](crate::select) ignores it.
    pub triangle_budget: Option<u64>,
    /// Draws every instance at this level of its mesh, or at the coarsest level if it has fewer; 0 is the finest.
    /// [`triangle_budget`](Self::triangle_budget) and [`Weights`](crate::Weights) are ignored then.
    /// [`select`](crate::select) ignores it.
    pub forced_level: Option<u32>,
    /// Rendered pixels per pixel of the view's target along one axis: 0.5 if an upscaler doubles both axes.
    /// Thresholds count rendered pixels.
    pub resolution_scale: f32,
    /// Settings that are rarely changed.
    pub advanced: AdvancedSettings,
}

/// Settings of the selection that are rarely changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    any(feature = "bevy_reflect", feature = "bevy_reflect_0_20"),
    derive(bevy_reflect::Reflect)
)]
pub struct AdvancedSettings {
    /// A refined group stays refined until its error falls below this share of the thresholds. At 0, only
    /// groups without error coarsen, for example outside the view; 1 is no hysteresis, and larger values count as 1. It
    /// keeps levels from flickering near a threshold.
    pub hysteresis: f32,
    /// Aspect ratio cos φ of the sampling pattern (§3.4), from 0 to 1, below which the thresholds are relaxed; 0
    /// disables it. If even the least stretched part of a group has a smaller ratio, its error counts
    /// `cos φ / min_aspect_ratio` times. Displacements along the radius of the image may then reach
    /// `displacement_px · min_aspect_ratio / cos φ`. It is off by default, since it saves no triangles at equal image
    /// error: see [`max_curl`](Self::max_curl).
    pub min_aspect_ratio: f32,
    /// Relative change κ of the sampling density across a group, up to which one sample of the field at the group's
    /// centre represents the group. Above it, the bound over the group's sphere is used; 0 always uses the bound. It
    /// applies to the screen-space error only, draws fewer triangles at the same threshold, and allows larger
    /// displacements of single points.
    ///
    /// ```text
    /// κ = r |∇c| / c = (r/ρ) √(4 + 9 tan²φ)
    /// ```
    /// The part across the sight ray is `3(r/ρ) tan φ = r |curl c| / c` (eq. 12); the part along it is `2r/ρ` (eq. 14).
    ///
    /// It is off by default. Triangles relative to clusterlod at the image error of clusterlod at 0.4, 1 and 2.5 px, over
    /// the training models of `fieldlod-lab chart --training --thresholds --poses 2`:
    ///
    /// | | RMSE | FLIP |
    /// |---|---|---|
    /// | off | 0.78, 0.63, 0.64 | 0.73, 0.59, 0.59 |
    /// | `max_curl` 0.3 | 0.79, 0.63, 0.64 | 0.73, 0.59, 0.59 |
    /// | `min_aspect_ratio` 0.9 | 0.78, 0.63, 0.64 | 0.73, 0.59, 0.59 |
    pub max_curl: f32,
    /// Margin around the image that counts as visible, as a share of the image's size on each side. Objects in
    /// the margin may cast shadows into the image, or enter the image with a fast turn.
    pub offscreen_margin: f32,
    /// Errors of groups outside the margin.
    pub offscreen: Offscreen,
    /// Additional margin on each side, within which a refined group still counts as visible, as a share of the size of
    /// the image with its `offscreen_margin`. A group leaves the view later than it enters, so head-bob does not swap
    /// levels along the image's edge. Negative values count as 0.
    pub edge_hysteresis: f32,
}

impl Default for AdvancedSettings {
    /// Coarsening below 0.8 of the thresholds or 10 % of the image beyond its edge; the bound everywhere, no margin. At
    /// 0.8, no group of a walk with head-bob changed back within five frames, for at most 2.4 % more triangles.
    fn default() -> Self {
        Self {
            hysteresis: 0.8,
            min_aspect_ratio: 0.0,
            max_curl: 0.0,
            offscreen_margin: 0.0,
            offscreen: Offscreen::Coarsest,
            edge_hysteresis: 0.1,
        }
    }
}

impl Default for LodSettings {
    /// A screen-space error of 1 px, no budget.
    fn default() -> Self {
        Self {
            error_px: Some(1.0),
            displacement_px: None,
            triangle_budget: None,
            forced_level: None,
            resolution_scale: 1.0,
            advanced: AdvancedSettings::default(),
        }
    }
}

impl LodSettings {
    /// The default at another screen-space error.
    #[must_use]
    pub fn with_error_px(error_px: f32) -> Self {
        Self {
            error_px: Some(error_px),
            ..Self::default()
        }
    }

    /// No displacement above `displacement_px`. The screen-space error is not limited.
    #[must_use]
    pub fn guaranteed(displacement_px: f32) -> Self {
        Self {
            error_px: None,
            displacement_px: Some(displacement_px),
            ..Self::default()
        }
    }

    /// The default with no more triangles than `triangle_budget` in a view.
    #[must_use]
    pub fn with_triangle_budget(triangle_budget: u64) -> Self {
        Self {
            triangle_budget: Some(triangle_budget),
            ..Self::default()
        }
    }

    /// The threshold of [`group_error_px`](crate::group_error_px), in rendered pixels and before the hysteresis:
    /// `error_px` or, without it, `displacement_px`; infinite with neither.
    #[must_use]
    pub fn threshold_px(&self) -> f32 {
        self.error_weights().threshold_px
    }

    /// Combines the two optional thresholds: displacements are multiplied by the ratio of the thresholds, so that one
    /// comparison is enough.
    pub(crate) fn error_weights(&self) -> ErrorWeights {
        let displacement_weight = match (self.error_px, self.displacement_px) {
            // A budget search may make both infinite, and their ratio NaN.
            (Some(error_px), Some(displacement_px)) if error_px == displacement_px => Some(1.0),
            (Some(error_px), Some(displacement_px)) => Some(error_px / displacement_px),
            (None, Some(_)) => Some(1.0),
            (_, None) => None,
        };
        ErrorWeights {
            threshold_px: self
                .error_px
                .or(self.displacement_px)
                .unwrap_or(f32::INFINITY),
            counts_error: self.error_px.is_some(),
            displacement_weight,
        }
    }

    /// The settings without those that a forced level ignores.
    pub(crate) fn in_effect(&self) -> Self {
        let is_free = self.forced_level.is_none();
        Self {
            triangle_budget: self.triangle_budget.filter(|_| is_free),
            ..*self
        }
    }

    /// The same settings at another [threshold](Self::threshold_px), with both thresholds in the same proportion.
    pub(crate) fn at_threshold(&self, threshold_px: f32) -> Self {
        let scaled = |displacement_px: f32| match self.error_px {
            Some(error_px) => displacement_px * (threshold_px / error_px),
            None => threshold_px,
        };
        Self {
            error_px: self.error_px.map(|_| threshold_px),
            displacement_px: self.displacement_px.map(scaled),
            ..*self
        }
    }

    /// The thresholds of an instance whose error counts `bias` times.
    pub(crate) fn thresholds(&self, bias: f32) -> Thresholds {
        let refine_above_px = self.threshold_px() / (self.resolution_scale * bias);
        Thresholds {
            refine_above_px,
            // Above 1, a group would be refined and coarsened in turn.
            coarsen_below_px: refine_above_px * self.advanced.hysteresis.min(1.0),
        }
    }
}

/// The combined thresholds of [`LodSettings`]: which errors of a group count, and how much. The larger weighed error is
/// compared with one threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ErrorWeights {
    pub(crate) threshold_px: f32,
    /// Whether the screen-space error counts.
    pub(crate) counts_error: bool,
    /// Factor of displacements; `None` if they do not count.
    pub(crate) displacement_weight: Option<f32>,
}

/// The two thresholds of the hysteresis, in pixels of the view's target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Thresholds {
    /// A group that was not refined is refined above this error.
    pub(crate) refine_above_px: f32,
    /// A refined group stays refined above this error.
    pub(crate) coarsen_below_px: f32,
}

impl Thresholds {
    /// Whether an error exceeds the threshold; NaN exceeds every threshold.
    #[inline(always)]
    pub(crate) fn exceeded_by(&self, error_px: f32, was_refined: bool) -> bool {
        let threshold_px = if was_refined {
            self.coarsen_below_px
        } else {
            self.refine_above_px
        };
        error_px.is_nan() | (error_px > threshold_px)
    }
}
