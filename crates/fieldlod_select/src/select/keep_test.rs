//! The first pass of a frame: which instances certainly stay as they are drawn, eight at a time.
//!
//! With the [limits](crate::criterion::limits) of what an instance shows, in the world, and bounds of secant and depth over its
//! sphere as in [the criterion](crate::criterion), it stays if
//! ```text
//! highest · √(C sec) / depth ≤ τ          nothing finer is refined;      highest · f sec / depth  of deviations
//! lowest  · √(C sec) / depth > τ'         what is refined stays refined, if anything is; with the hysteresis
//! ```
//! or, of what is at its coarsest, if the sphere is outside of the view. Every comparison has a margin for what
//! rounding, and the size of the sphere, may change: the test answers only where the criterion answers the same.
//! What is not a number never stays.

use camera_field::Camera;
use wide::f32x8;

use super::memory::EightLimits;
use crate::criterion::limits::ErrorUnits;
use crate::lanes::bits::LANES;
use crate::lanes::{Lane, M3, V3, bits_of};
use crate::scene::columns::EightSpheres;
use crate::settings::{LodSettings, Offscreen, Thresholds};
use crate::view::View;
use crate::view::shadow_lights::ShadowTest;
use crate::view::sides::LensSides;
use crate::view::stretch::is_similarity;

/// Allowances for the rounding of coordinates, relative to their size, and of a few operations.
const POSITION_SLACK: f32 = 1e-5;
const ROUNDING: f32 = 1.001;

/// The test of one view under one set of settings.
pub(crate) struct KeepTest {
    eye: V3<f32>,
    eye_slack: f32,
    camera_from_world: M3<f32>,
    is_orthographic: bool,
    /// Whether it can answer at all: neither for a view that scales, nor without thresholds.
    is_usable: bool,
    entering: LensSides,
    leaving: LensSides,
    /// Cosine of the widest corner of the image.
    least_cosine: f32,
    scale: Scale,
    /// What is outside counts by this scale; `None` if not at all.
    on_axis: Option<Scale>,
    /// Whether bounds with a secant are those of deviations, at most and at least.
    counts_secant: [bool; 2],
    /// The least factor of [`LodSettings::min_aspect_ratio`], 0 if nothing is known of the lower limit.
    least_relaxation: f32,
    shadows: Option<ShadowTest>,
    size: Option<SizeReach>,
}

/// Thresholds over pixels per unit of error: of what enters and of what leaves.
#[derive(Clone, Copy)]
struct Scale {
    entering: f32,
    leaving: f32,
}

/// How far from the eye a radius of 1 is large enough to be drawn, or how many times over in an orthographic view:
/// of what is drawn already, and of what is not.
#[derive(Clone, Copy)]
struct SizeReach {
    drawn: f32,
    culled: f32,
}

/// Spheres as a view sees them.
pub(crate) struct Sighted<L: Lane> {
    world: V3<L>,
    seen: V3<L>,
    /// The radius, and what rounding may move a sphere by.
    radius: L,
    slack: L,
    outside: L::Mask,
    /// Whether the limits are those of the coarsest level.
    is_coarsest: L::Mask,
}

impl KeepTest {
    /// The test of a view with its margins.
    pub(crate) fn new(view: &View, settings: &LodSettings) -> Self {
        let thresholds = settings.thresholds(1.0);
        let units = ErrorUnits::new(&view.camera, settings);
        let counts_error = units.error > 0.0;
        let (is_orthographic, corner, error_px, deviation_px) = match &view.camera {
            Camera::Perspective(camera) => (
                false,
                camera.max_secant(),
                camera.constant_px2().sqrt(),
                camera.focal_px.max_element(),
            ),
            Camera::Orthographic(camera) => {
                let pixels = camera.pixels_per_unit;
                (true, 1.0, (pixels.x * pixels.y).sqrt(), pixels.max_element())
            }
        };
        let per_unit = if counts_error { error_px } else { deviation_px };
        let unit = view.camera_from_world.x_axis.length();
        let is_rigid = is_similarity(&view.camera_from_world) && (unit - 1.0).abs() < 1e-4;
        let on_axis = match settings.offscreen {
            Offscreen::Coarsest => None,
            Offscreen::OnAxis { bias } => Some(Scale::new(&thresholds, per_unit * bias.abs())),
        };
        Self {
            eye: V3::splat(view.eye_in_world),
            eye_slack: (view.eye_in_world.abs().element_sum()) * POSITION_SLACK,
            camera_from_world: M3::splat(&view.camera_from_world),
            is_orthographic,
            is_usable: is_rigid && thresholds.coarsen_below_px >= 0.0,
            entering: LensSides::of(&view.camera),
            leaving: LensSides::of(&view.kept_camera),
            least_cosine: 1.0 / corner,
            scale: Scale::new(&thresholds, per_unit),
            on_axis,
            counts_secant: [units.deviation > 0.0, !counts_error],
            least_relaxation: least_relaxation(settings, is_orthographic, corner),
            shadows: on_axis.and_then(|_| ShadowTest::new(view)),
            size: SizeReach::new(view, settings),
        }
    }

    /// Whether it can answer at all.
    pub(crate) fn is_usable(&self) -> bool {
        self.is_usable
    }

    /// Whether it tests sizes, which chunks of instances do not have.
    pub(crate) fn tests_sizes(&self) -> bool {
        self.size.is_some()
    }

    /// The bits of those of eight instances that stay as they are. With their sizes comes whether those of them
    /// were drawn that are not culled.
    #[inline]
    pub(crate) fn kept_eight(
        &self,
        spheres: &EightSpheres,
        limits: &EightLimits,
        sizes: Option<(&[f32; LANES], bool)>,
    ) -> u32 {
        if !self.is_usable {
            return 0;
        }
        let (lowest, highest) = (f32x8::new(limits.lowest), f32x8::new(limits.highest));
        let sighted = self.sight(spheres.center(), spheres.radius(), lowest);
        let is_gone = highest.is_below(f32x8::zero());
        // By far the most are certainly not seen.
        let mut kept = self.keeps_unseen(&sighted) | is_gone;
        if bits_of(kept) != 0xff {
            kept |= self.keeps(&sighted, lowest, highest);
        }
        if let (Some((sizes, were_drawn)), Some(_)) = (sizes, &self.size) {
            let (size, was_culled) = (f32x8::new(*sizes), lowest.is_below(f32x8::zero()));
            let stays_drawn = kept & self.is_large(&sighted, size, were_drawn);
            let stays_culled = !self.is_large(&sighted, size, false);
            kept = is_gone | f32x8::choose(was_culled, stays_culled, stays_drawn);
        }
        bits_of(kept)
    }

    /// Looks at spheres whose limits have these `lowest`.
    #[inline(always)]
    pub(crate) fn sight<L: Lane>(&self, world: V3<L>, radius: L, lowest: L) -> Sighted<L> {
        let seen = self
            .camera_from_world
            .in_lanes()
            .of(world.minus(self.eye.in_lanes()));
        let size = world.x.abs() + world.y.abs() + world.z.abs();
        let slack = size * L::splat(POSITION_SLACK) + L::splat(self.eye_slack);
        let radius = radius * L::splat(ROUNDING) + slack;
        Sighted {
            outside: radius.is_below(self.beyond(&self.entering, seen)),
            is_coarsest: L::infinity().is_at_most(lowest),
            world,
            seen,
            radius,
            slack,
        }
    }

    /// How far a point is outside of a view, at least.
    #[inline(always)]
    fn beyond<L: Lane>(&self, sides: &LensSides, seen: V3<L>) -> L {
        let beyond_side = -sides.least_inside(seen);
        if self.is_orthographic {
            return beyond_side;
        }
        beyond_side.larger(-seen.z)
    }

    /// Which of them stay because nobody sees them: at their coarsest.
    #[inline(always)]
    pub(crate) fn keeps_unseen<L: Lane>(&self, sighted: &Sighted<L>) -> L::Mask {
        let unseen = sighted.outside & sighted.is_coarsest;
        match &self.on_axis {
            None => unseen,
            Some(_) => unseen & self.is_dark(sighted),
        }
    }

    /// Which of them cast no shadow into the image, of what is outside of it.
    #[inline(always)]
    fn is_dark<L: Lane>(&self, sighted: &Sighted<L>) -> L::Mask {
        match &self.shadows {
            Some(shadows) => shadows.is_dark(sighted.world, sighted.seen, sighted.radius),
            None => L::zero().is_below(L::zero()),
        }
    }

    /// Which of them are outside of the view and cast no shadow into it, where what is outside counts.
    pub(crate) fn is_outside_and_dark(&self, sighted: &Sighted<f32>) -> bool {
        self.is_usable && self.on_axis.is_some() && sighted.outside && self.is_dark(sighted)
    }

    /// Which of them stay by what they show.
    #[inline(always)]
    pub(crate) fn keeps<L: Lane>(&self, sighted: &Sighted<L>, lowest: L, highest: L) -> L::Mask {
        let Sighted {
            seen,
            radius,
            slack,
            outside,
            is_coarsest,
            ..
        } = *sighted;
        let distance_squared = seen.dot(seen);
        let distance = distance_squared.sqrt();
        let gap = distance - radius;
        // Depth over the root of the secant, or over the secant.
        let (most, least) = if self.is_orthographic {
            (L::one(), L::one())
        } else {
            self.allowed_in_view(sighted, distance_squared, distance, gap)
        };
        let mut fits = highest.is_at_most(most * L::splat(self.scale.entering));
        // What reaches the camera has no limit.
        if !self.is_orthographic {
            fits = fits & L::zero().is_below(gap);
        }
        // What is refined stays so if its centre is seen.
        let inside_by = self.leaving.least_inside(seen);
        let mut is_seen = slack.is_below(inside_by);
        let mut shows = lowest * L::splat(self.least_relaxation);
        if !self.is_orthographic {
            is_seen = is_seen & slack.is_below(seen.z);
            // By how much the sphere is larger here than it is.
            let excess = radius * L::splat(0.002) + slack * L::splat(2.0);
            let lost = excess * L::splat(6.0 / self.least_cosine);
            shows = shows * ((gap - lost) / gap);
        }
        let mut shows = is_seen & (least * L::splat(self.scale.leaving)).is_below(shows);
        // What is outside counts for nothing, or by its distance.
        match &self.on_axis {
            None => fits = fits | outside,
            Some(scale) => {
                let is_dark = self.is_dark(sighted);
                let (near, far) = if self.is_orthographic {
                    (L::one(), L::one())
                } else {
                    (gap, distance * L::splat(ROUNDING) + slack)
                };
                let fits_on_axis = highest.is_at_most(near * L::splat(scale.entering));
                fits = (outside & is_dark) | (fits_on_axis & (fits | outside));
                let has_left = radius.is_below(self.beyond(&self.leaving, seen));
                let lowest = lowest * L::splat(self.least_relaxation);
                let shows_on_axis = (far * L::splat(scale.leaving)).is_below(lowest);
                shows = shows | (has_left & shows_on_axis & !is_dark);
            }
        }
        fits & (is_coarsest | shows)
    }

    /// What an error may be over its threshold and scale: at most so that it surely fits, and at least so that it
    /// surely exceeds it.
    #[inline(always)]
    fn allowed_in_view<L: Lane>(
        &self,
        sighted: &Sighted<L>,
        distance_squared: L,
        distance: L,
        gap: L,
    ) -> (L, L) {
        let Sighted { seen, radius, .. } = *sighted;
        let off_axis = (seen.x * seen.x + seen.y * seen.y).sqrt();
        let tangent_length = (gap * (distance + radius)).sqrt();
        let cosine = (seen.z * tangent_length - off_axis * radius) / distance_squared;
        let cosine = (cosine - L::splat(1e-5)).larger(L::splat(self.least_cosine));
        let depth = (seen.z - radius).larger(gap * cosine);
        let [most, least] = self.counts_secant.map(|counts_secant| {
            if counts_secant {
                depth * cosine
            } else {
                depth * cosine.sqrt()
            }
        });
        (most, least)
    }

    /// Which of them are large enough to be drawn; what is not a number is.
    #[inline(always)]
    pub(crate) fn is_large<L: Lane>(&self, sighted: &Sighted<L>, size: L, is_drawn: bool) -> L::Mask {
        let Some(reach) = &self.size else {
            return L::zero().is_at_most(L::zero());
        };
        let reach = size * L::splat(if is_drawn { reach.drawn } else { reach.culled });
        let least = if self.is_orthographic {
            L::one()
        } else {
            let from_eye = sighted.world.minus(self.eye.in_lanes());
            from_eye.dot(from_eye).sqrt()
        };
        !reach.is_below(least)
    }
}

impl Scale {
    fn new(thresholds: &Thresholds, px_per_unit: f32) -> Self {
        Self {
            entering: thresholds.refine_above_px / (px_per_unit * ROUNDING),
            leaving: thresholds.coarsen_below_px / px_per_unit * ROUNDING * ROUNDING,
        }
    }
}

impl SizeReach {
    /// `None` if a view draws all sizes.
    fn new(view: &View, settings: &LodSettings) -> Option<Self> {
        let cull_below_px = settings.cull_below_px.filter(|px| *px > 0.0)?;
        let scale = match view.camera {
            Camera::Perspective(camera) => camera.focal_px.max_element(),
            Camera::Orthographic(camera) => {
                let camera_per_world = view.camera_from_world.x_axis.length();
                camera.pixels_per_unit.max_element() * camera_per_world
            }
        };
        let culled = 2.0 * scale * settings.resolution_scale / cull_below_px;
        Some(Self {
            drawn: culled / settings.hysteresis.clamp(0.0, 1.0),
            culled,
        })
    }
}

/// By how much thresholds are relaxed at most; 0 where one sample may stand for the bound.
fn least_relaxation(settings: &LodSettings, is_orthographic: bool, corner: f32) -> f32 {
    if is_orthographic {
        1.0
    } else if settings.max_curl != 0.0 {
        0.0
    } else if settings.min_aspect_ratio > 0.0 {
        (0.999 / (corner * settings.min_aspect_ratio)).min(1.0)
    } else {
        1.0
    }
}
