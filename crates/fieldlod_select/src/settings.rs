//! What decides how fine a cut is.

/// How groups outside the view are judged.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Offscreen {
    /// At their coarsest: nobody sees them.
    #[default]
    Coarsest,
    /// As if they stood on the view's axis, as far away and turned towards the eye as they are: with the
    /// field's strength `f²/ρ²` there. For what casts shadows into the view.
    OnAxis {
        /// How often their errors count, above 0 and at most 1: less draws them coarser.
        bias: f32,
    },
}

/// How much what is hidden counts.
///
/// Instances are drawn into a small depth image on the CPU, the largest by triangles of a coarse level and
/// the others by points. The screen-space error of what they leave the share `o` of visible counts `√o`
/// times: the paper's flux is over the visible surface. What is not in the image, within
/// [`LodSettings::offscreen_margin`] too, counts as hidden. `o` is an estimate from few triangles and points, so
/// displacements ([`LodSettings::displacement_px`]) count in full. Nothing is culled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisibleFlux {
    /// The most triangles that are drawn into the depth image; thirty-two points count as one.
    pub occluder_triangles: u32,
    /// How many selections in a row must see less of something before it is coarsened; at most 254. It is
    /// refined in the selection that sees more of it.
    pub hold_frames: u8,
    /// The share that anything counts at least, from 0 to 1: what seems hidden may be seen a little, or
    /// throw a shadow into the view.
    pub least_share: f32,
}

impl Default for VisibleFlux {
    /// 16,000 triangles; 45 frames, longer than a step of one who walks; what seems hidden counts a hundredth.
    fn default() -> Self {
        Self {
            occluder_triangles: 16_000,
            hold_frames: 45,
            least_share: 0.01,
        }
    }
}

/// What decides how fine a cut is.
///
/// A group is refined where either threshold is exceeded: [`error_px`](Self::error_px) by its
/// screen-space error, [`displacement_px`](Self::displacement_px) by its largest displacement.
/// With neither threshold the cut is always the coarsest one. A threshold of 0 accepts only what shows
/// no error at all, a negative one nothing; NaN accepts everything by itself, and nothing beside the
/// other threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LodSettings {
    /// Quality: the largest screen-space error in physical pixels that a simplification may show
    /// ([`screen_error_px`](crate::screen_error_px)). The error is RMS-like: this gives the best
    /// picture for its triangles, while single points may be displaced by more.
    pub error_px: Option<f32>,
    /// Guarantee: the largest displacement of the surface inside the image, in physical pixels
    /// ([`screen_displacement_px`](crate::screen_displacement_px)).
    pub displacement_px: Option<f32>,
    /// A group refined in the last cut stays so until it falls below this share of the thresholds:
    /// from 0 (never coarsens again) to 1 (no memory); more counts as 1. Keeps a still eye at a
    /// threshold from flickering.
    pub hysteresis: f32,
    /// Aspect ratio cos φ of the sampling pattern (§3.4) below which the thresholds are relaxed, from 0
    /// (never) to 1. Where even the least stretched part of a group has a smaller ratio, its error
    /// counts `cos φ / min_aspect_ratio` times: displacements may reach
    /// `displacement_px · min_aspect_ratio / cos φ`, along the radius of the image.
    pub min_aspect_ratio: f32,
    /// Relative change κ of the sampling density across a group, below which one sample of the
    /// field at the group's centre stands for it; from there on the bound over the group's sphere
    /// does. 0: always the bound. Applies to the screen-space error only.
    ///
    /// It trades displacements for triangles at the same threshold: with one sample everywhere, 0.77
    /// instead of 1.04 of the triangles of clusterlod's test, and 2.0 instead of 1.5 px displaced at
    /// most, at about equal error of the picture (the record of `fieldlod_lab`). It is not faster: the
    /// tests that come before the criterion are made for the bound.
    ///
    /// ```text
    /// κ = r |∇c| / c = (r/ρ) √(4 + 9 tan²φ)
    /// ```
    /// of which `3(r/ρ) tan φ = r |curl c| / c` (eq. 12) across the sight ray, `2r/ρ` along it
    /// (eq. 14).
    pub max_curl: f32,
    /// Rendered pixels for each pixel of the view's target along one axis: 0.5 where an upscaler
    /// doubles both. Thresholds are counted in rendered pixels.
    pub resolution_scale: f32,
    /// Margin around the image that counts as seen, as a share of the image's size on each side:
    /// for shadows of what is just outside, and fast turns.
    pub offscreen_margin: f32,
    /// How what is further out is judged.
    pub offscreen: Offscreen,
    /// Margin around that, as a share of the image's size on each side, in which a refined group
    /// counts as seen still: it leaves the view later than it entered. Keeps an eye that nods from
    /// swapping levels along the image's edge. Negative counts as 0.
    pub edge_hysteresis: f32,
    /// Instances that are smaller on screen, in rendered pixels, are not drawn; `None` draws all. The size is
    /// the diameter of a sphere around the instance, times its bias, as large as it would be in the middle of
    /// the image: a camera that only turns draws what it drew. One that is drawn stays until its size falls
    /// below the [`hysteresis`](Self::hysteresis)' share of this. [`select`](crate::select), which sees one
    /// instance only, does not read it.
    pub cull_below_px: Option<f32>,
    /// Draws every instance at this level of its mesh, 0 being the finest, whatever it shows; the coarsest
    /// where a mesh has fewer. It comes before the levels of single instances
    /// ([`Scene::set_forced_level`](crate::Scene::set_forced_level)). [`select`](crate::select) does not read
    /// it.
    pub forced_level: Option<u32>,
    /// Counts screen-space errors by how much of the instance or group nothing hides; `None` counts as if
    /// all were seen. [`select`](crate::select), which sees one instance only, does not read it.
    pub visible_flux: Option<VisibleFlux>,
    /// Triangles that a view may draw. Where the thresholds ask for more, the [`Selector`](crate::Selector)
    /// scales them up; where everything is at its coarsest, it may be more. [`select`](crate::select), which sees one instance only, does not read it.
    pub triangle_budget: Option<u64>,
}

impl Default for LodSettings {
    /// 1 px of quality, coarsening below 0.8 px or 10 % of the image beyond its edge; the bound
    /// everywhere, no margin, no budget.
    fn default() -> Self {
        Self {
            error_px: Some(1.0),
            displacement_px: None,
            hysteresis: 0.8,
            min_aspect_ratio: 0.0,
            max_curl: 0.0,
            resolution_scale: 1.0,
            offscreen_margin: 0.0,
            offscreen: Offscreen::Coarsest,
            edge_hysteresis: 0.1,
            cull_below_px: None,
            forced_level: None,
            visible_flux: None,
            triangle_budget: None,
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

    /// No displacement above `displacement_px`, whatever the screen-space error.
    #[must_use]
    pub fn guaranteed(displacement_px: f32) -> Self {
        Self {
            error_px: None,
            displacement_px: Some(displacement_px),
            ..Self::default()
        }
    }

    /// The quality of `error_px` with no displacement above `displacement_px`.
    #[must_use]
    pub fn capped(error_px: f32, displacement_px: f32) -> Self {
        Self {
            displacement_px: Some(displacement_px),
            ..Self::with_error_px(error_px)
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

    /// What [`group_error_px`](crate::group_error_px) is compared with, in rendered pixels and before
    /// the hysteresis: `error_px` or, without it, `displacement_px`; infinite with neither.
    #[must_use]
    pub fn threshold_px(&self) -> f32 {
        self.error_weights().threshold_px
    }

    /// Resolves the two optional thresholds. Displacements count in proportion to the thresholds, so
    /// that one comparison does for both.
    pub(crate) fn error_weights(&self) -> ErrorWeights {
        let displacement_weight = match (self.error_px, self.displacement_px) {
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

    /// The same settings at another [threshold](Self::threshold_px), both in the same proportion.
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
            coarsen_below_px: refine_above_px * self.hysteresis.min(1.0),
        }
    }
}

/// What the optional thresholds of [`LodSettings`] come to: which errors of a group count, and how
/// much. The greater of them is compared with one threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ErrorWeights {
    pub(crate) threshold_px: f32,
    /// Whether the screen-space error counts.
    pub(crate) counts_error: bool,
    /// How often a displacement counts, if at all.
    pub(crate) displacement_weight: Option<f32>,
}

/// The two thresholds of a hysteresis, in pixels of screen-space error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Thresholds {
    /// A group that is not refined becomes so above this.
    pub(crate) refine_above_px: f32,
    /// A refined group stays so while above this.
    pub(crate) coarsen_below_px: f32,
}

impl Thresholds {
    /// Whether an error asks for refinement; NaN does.
    pub(crate) fn exceeded_by(&self, error_px: f32, was_refined: bool) -> bool {
        let threshold_px = if was_refined {
            self.coarsen_below_px
        } else {
            self.refine_above_px
        };
        error_px.is_nan() || error_px > threshold_px
    }
}
