//! What decides how fine a cut is.

/// What [`LodSettings::error_px`] promises.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Promise {
    /// The RMS-like screen error of [`screen_error_px`](crate::screen_error_px): the best picture
    /// for its triangles. Single displacements may exceed `error_px`.
    #[default]
    Quality,
    /// No displacement of the surface inside the image exceeds `error_px`:
    /// [`screen_displacement_px`](crate::screen_displacement_px).
    Guaranteed,
    /// The quality of `error_px`, and no displacement above `cap_px`.
    Both {
        /// Largest displacement on screen, in physical pixels.
        cap_px: f32,
    },
}

/// How groups outside the view are judged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Offscreen {
    /// At their coarsest: nobody sees them.
    #[default]
    Coarsest,
    /// As if they stood on the view's axis, as far away and turned towards the eye as they are: with the
    /// field's strength `f²/ρ²` there. For what casts shadows into the view.
    OnAxis,
}

/// What decides how fine a cut is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LodSettings {
    /// Largest screen-space error, in physical pixels, that a simplification may show
    /// ([`promised_error_px`](crate::promised_error_px)). Smaller is finer; 0 accepts only what
    /// cannot be told from the source.
    pub error_px: f32,
    /// A group refined in the last cut stays so until its screen-space error falls below this share
    /// of `error_px`: from 0 (never coarsens again) to 1 (no memory); more counts as 1. Keeps a
    /// still eye at a threshold from flickering.
    pub hysteresis: f32,
    /// What `error_px` promises.
    pub promise: Promise,
    /// Aspect ratio cos φ of the sampling pattern (§3.4) below which the promise is relaxed, from 0
    /// (never) to 1. Where even the least stretched part of a group has a smaller ratio, its error
    /// counts `cos φ / min_aspect_ratio` times: displacements may reach
    /// `error_px · min_aspect_ratio / cos φ`, along the radius of the image.
    pub min_aspect_ratio: f32,
    /// Relative change κ of the sampling density across a group, below which one sample of the
    /// field at the group's centre stands for it; from there on the bound over the group's sphere
    /// does. 0: always the bound. Applies to the quality promise only.
    ///
    /// ```text
    /// κ = r |∇c| / c = (r/ρ) √(4 + 9 tan²φ)
    /// ```
    /// of which `3(r/ρ) tan φ = r |curl c| / c` (eq. 12) across the sight ray, `2r/ρ` along it
    /// (eq. 14).
    pub max_curl: f32,
    /// Rendered pixels for each pixel of the view's target along one axis: 0.5 where an upscaler
    /// doubles both. `error_px` is counted in rendered pixels.
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
    /// Triangles that a view may draw. The threshold that meets it takes the place of `error_px`
    /// ([`Selector`](crate::Selector)); [`select`](crate::select), which sees one instance only,
    /// does not read it.
    pub triangle_budget: Option<u64>,
}

impl Default for LodSettings {
    /// 1 px of quality, coarsening below 0.8 px or 10 % of the image beyond its edge; the bound
    /// everywhere, no margin, no budget.
    fn default() -> Self {
        Self {
            error_px: 1.0,
            hysteresis: 0.8,
            promise: Promise::Quality,
            min_aspect_ratio: 0.0,
            max_curl: 0.0,
            resolution_scale: 1.0,
            offscreen_margin: 0.0,
            offscreen: Offscreen::Coarsest,
            edge_hysteresis: 0.1,
            triangle_budget: None,
        }
    }
}

impl LodSettings {
    /// The default at another error in pixels.
    #[must_use]
    pub fn with_error_px(error_px: f32) -> Self {
        Self {
            error_px,
            ..Self::default()
        }
    }

    /// No displacement above `error_px`.
    #[must_use]
    pub fn guaranteed(error_px: f32) -> Self {
        Self {
            promise: Promise::Guaranteed,
            ..Self::with_error_px(error_px)
        }
    }

    /// The quality of `error_px` with no displacement above `cap_px`.
    #[must_use]
    pub fn capped(error_px: f32, cap_px: f32) -> Self {
        Self {
            promise: Promise::Both { cap_px },
            ..Self::with_error_px(error_px)
        }
    }

    /// As many triangles as `triangle_budget` in a view, at the best quality it buys.
    #[must_use]
    pub fn with_triangle_budget(triangle_budget: u64) -> Self {
        Self {
            triangle_budget: Some(triangle_budget),
            ..Self::default()
        }
    }

    /// The thresholds of an instance whose error counts `bias` times.
    pub(crate) fn thresholds(&self, bias: f32) -> Thresholds {
        let refine_above_px = self.error_px / (self.resolution_scale * bias);
        Thresholds {
            refine_above_px,
            coarsen_below_px: refine_above_px * self.hysteresis.min(1.0),
        }
    }
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
