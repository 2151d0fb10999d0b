//! The pass over all instances: tests which of them certainly keep their cuts, eight at a time.
//!
//! An instance has [limits](crate::criterion::limits) of errors, in the world. With bounds of secant and depth over its
//! sphere, as in [the criterion](crate::criterion), it keeps its cut if
//! ```text
//! highest · √(C sec) / depth ≤ τ          no finer group is refined;     highest · f sec / depth  for deviations
//! lowest  · √(C sec) / depth > τ'         refined groups stay refined;   τ' is τ with the hysteresis
//! ```
//! or, at the coarsest level, if the sphere is outside the view. Every comparison has a margin for rounding and for the
//! size of the sphere. The criterion would keep the cut of every instance that passes. NaN never passes.

use camera_field::Camera;
use fieldlod_hierarchy::Sphere;
use glam::{Mat3, Vec3};
use wide::f32x8;

use super::columns::EightLimits;
use crate::criterion::extent::corner_secant;
use crate::criterion::limits::{Allowed, ErrorUnits};
use crate::criterion::{Drift, Motion, px_per_unit};
use crate::lanes::bits::{LANES, set_bits_of};
use crate::lanes::{Lane, M3, V3, bits_of};
use crate::scene::columns::EightSpheres;
use crate::settings::{LodSettings, Offscreen, Thresholds};
use crate::view::View;
use crate::view::shadow_lights::ShadowTest;
use crate::view::sides::LensSides;
use crate::view::stretch::is_similarity;

/// Bounds of the rounding of coordinates, relative to their size, and of a few operations. Smaller values keep cuts
/// that the criterion changes, which the tests against the criterion find; larger values only decide more instances.
const POSITION_SLACK: f32 = 1e-5;
const ROUNDING: f32 = 1.001;

/// The test of one view under one set of settings.
pub(crate) struct KeepTest {
    eye: Vec3,
    eye_slack: f32,
    camera_from_world: Mat3,
    is_orthographic: bool,
    /// Sides of the view that groups enter, and of the wider view that refined groups leave.
    sides: [LensSides; 2],
    /// Cosines of the widest corners of both views.
    least_cosines: [f32; 2],
    scale: Scale,
    /// Scale of errors outside the view; `None` if they are 0.
    on_axis: Option<Scale>,
    /// Whether the upper and the lower bound are bounds of deviations, which count the secant in full.
    counts_secant: [bool; 2],
    /// The least factor of [`AdvancedSettings::min_aspect_ratio`](crate::AdvancedSettings::min_aspect_ratio); 0 if
    /// errors have no lower bound.
    least_relaxation: f32,
    shadows: Option<ShadowTest>,
}

/// Thresholds over pixels per unit of error, of groups that were not refined and of groups that were refined: rounded
/// down, and rounded up.
#[derive(Clone, Copy)]
struct Scale {
    coarse: [f32; 2],
    fine: [f32; 2],
}

/// Spheres as a view sees them.
struct Sighted<L> {
    world: V3<L>,
    seen: V3<L>,
    /// The radius plus the slack. Rounding moves a sphere by at most the slack.
    radius: L,
    slack: L,
}

/// Bounds of errors, divided by threshold and scale.
struct Bounds<L> {
    /// In the view: errors up to the first certainly fit, errors above the second certainly exceed.
    in_view: [L; 2],
    /// The same bounds on the axis, for spheres outside the view.
    on_axis: [L; 2],
}

/// An instance whose cut may change in this frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::select) struct Near {
    pub(in crate::select) slot: usize,
    /// Whether it is outside the view and casts no shadow into it, if instances outside count at all.
    pub(in crate::select) is_dark: bool,
    /// Certain bounds of its allowed errors.
    pub(in crate::select) allowed: Allowed<f32>,
}

/// Result of the test of eight instances.
pub(crate) struct Looked {
    /// Bits of the instances that keep their cuts.
    kept: u32,
    /// Bits of the instances outside the view that cast no shadow into it, if instances outside count at all.
    dark: u32,
    allowed: Allowed<[f32; LANES]>,
}

impl Looked {
    /// The instances whose cuts may change. `element` is the place of the eight instances in their column.
    pub(crate) fn near(&self, element: usize) -> impl Iterator<Item = Near> + '_ {
        let Allowed { coarse, fine } = &self.allowed;
        set_bits_of(!self.kept & 0xff).map(move |lane| Near {
            slot: element * LANES + lane,
            is_dark: self.dark >> lane & 1 == 1,
            allowed: Allowed {
                coarse: [coarse[0][lane], coarse[1][lane]],
                fine: [fine[0][lane], fine[1][lane]],
            },
        })
    }
}

impl KeepTest {
    /// The test of a view with its margins.
    pub(crate) fn new(view: &View, settings: &LodSettings) -> Self {
        let thresholds = settings.thresholds(1.0);
        let units = ErrorUnits::new(&view.camera, settings);
        let counts_error = units.error > 0.0;
        let is_orthographic = matches!(view.camera, Camera::Orthographic(_));
        // NaN for a view that scales and for negative thresholds: then no instance passes.
        let unit = view.camera_from_world.x_axis.length();
        let is_rigid = is_similarity(&view.camera_from_world) && (unit - 1.0).abs() < 1e-4;
        let one = match is_rigid && thresholds.coarsen_below_px >= 0.0 {
            true => 1.0,
            false => f32::NAN,
        };
        let px = px_per_unit(&view.camera) * one;
        let per_unit = match counts_error {
            true => (px.x * px.y).sqrt(),
            false => px.max_element(),
        };
        let on_axis = match settings.advanced.offscreen {
            Offscreen::Coarsest => None,
            Offscreen::OnAxis { bias } => Some(Scale::new(&thresholds, per_unit * bias.abs())),
        };
        Self {
            eye: view.eye_in_world,
            eye_slack: (view.eye_in_world.abs().element_sum()) * POSITION_SLACK,
            camera_from_world: view.camera_from_world * one,
            is_orthographic,
            sides: [&view.camera, &view.kept_camera].map(LensSides::of),
            least_cosines: [&view.camera, &view.kept_camera]
                .map(|camera| 1.0 / corner_secant(camera)),
            scale: Scale::new(&thresholds, per_unit),
            on_axis,
            counts_secant: [units.deviation > 0.0, !counts_error],
            least_relaxation: least_relaxation(settings, &view.camera),
            shadows: on_axis.and_then(|_| ShadowTest::new(view)),
        }
    }

    /// Looks at eight instances, or chunks of them; `None` if all of them stay as they are.
    #[inline]
    pub(crate) fn look(&self, spheres: &EightSpheres, limits: &EightLimits) -> Option<Looked> {
        let (lowest, highest) = (f32x8::new(limits.lowest), f32x8::new(limits.highest));
        let is_still = highest.is_below(f32x8::zero());
        // Most instances are outside the view.
        let sighted = self.sight(spheres.center(), spheres.radius());
        let is_coarsest = f32x8::infinity().is_at_most(lowest);
        let dark = self.is_dark(&sighted);
        let outside = self.is_outside(0, &sighted);
        let unseen = outside & is_coarsest & dark;
        if bits_of(unseen | is_still) == 0xff {
            return None;
        }
        // Most of the other instances are within their limits.
        let bounds = self.bounds(0, &sighted);
        let entering = self.coarse(0, &sighted, &bounds, dark);
        let leaving = self.fine(1, &sighted, &bounds, dark);
        let fits = highest.is_at_most(entering);
        let shows = is_coarsest | leaving.is_below(lowest);
        let kept = bits_of(unseen | is_still | (fits & shows));
        let counts_outside = self.on_axis.is_some();
        (kept != 0xff).then(|| Looked {
            kept,
            dark: match counts_outside {
                true => bits_of(dark & outside),
                false => 0,
            },
            allowed: Allowed {
                coarse: [
                    entering.to_array(),
                    self.coarse(1, &sighted, &self.bounds(1, &sighted), dark)
                        .to_array(),
                ],
                fine: [
                    self.fine(0, &sighted, &bounds, dark).to_array(),
                    leaving.to_array(),
                ],
            },
        })
    }

    /// The drift of an instance's groups during a motion of the camera; `None` if the instance may touch the view's
    /// edge meanwhile, or if that is not known.
    pub(crate) fn drift(&self, sphere: &Sphere, motion: Motion) -> Option<Drift> {
        // Relaxed thresholds and single samples are not bounded.
        if self.least_relaxation != 1.0 {
            return None;
        }
        let sighted = self.sight(V3::splat(sphere.center), sphere.radius);
        let distance = sighted.seen.dot(sighted.seen).sqrt();
        let displacement =
            motion.travel + motion.turn * (distance + sighted.radius) + sighted.slack * 2.0;
        // A longer way changes errors by more than the hysteresis, so that few cuts would pass.
        if displacement > 0.1 * distance {
            return None;
        }
        let reach = sighted.radius + displacement;
        // If errors outside count, an instance beyond the narrower view that casts no shadow is at its coarsest level.
        let width = usize::from(self.on_axis.is_none());
        let inside_by = self.sides[width].least_inside(sighted.seen);
        let is_before = self.is_orthographic || reach < sighted.seen.z;
        let stays_inside = is_before && reach < inside_by;
        // Outside of both views, errors count as on the axis.
        let is_apart = self.is_orthographic || displacement < 0.5 * (distance - sighted.radius);
        let reached = Sighted {
            radius: reach,
            ..sighted
        };
        let stays_outside = self.on_axis.is_some()
            && is_apart
            && self.is_outside(0, &reached)
            && self.is_outside(1, &reached);
        let chord = match self.is_orthographic {
            true => motion.turn,
            false => motion.travel / (distance - reach),
        };
        (stays_inside || stays_outside).then_some(Drift {
            distance: displacement,
            chord: chord + 1e-4,
        })
    }

    #[inline(always)]
    fn sight<L: Lane>(&self, world: V3<L>, radius: L) -> Sighted<L> {
        let from_eye = world.minus(V3::splat(self.eye));
        let size = world.x.abs() + world.y.abs() + world.z.abs();
        let slack = size * L::splat(POSITION_SLACK) + L::splat(self.eye_slack);
        Sighted {
            world,
            seen: M3::splat(&self.camera_from_world).of(from_eye),
            radius: radius * L::splat(ROUNDING) + slack,
            slack,
        }
    }

    /// Which spheres are certainly outside of the view that groups enter, 0, or leave, 1.
    #[inline(always)]
    fn is_outside<L: Lane>(&self, width: usize, sighted: &Sighted<L>) -> L::Mask {
        let beyond = -self.sides[width].least_inside(sighted.seen);
        sighted.radius.is_below(match self.is_orthographic {
            true => beyond,
            false => beyond.larger(-sighted.seen.z),
        })
    }

    /// Which spheres are certainly not outside: their centres are in the view.
    #[inline(always)]
    fn is_inside<L: Lane>(&self, width: usize, sighted: &Sighted<L>) -> L::Mask {
        let inside_by = self.sides[width].least_inside(sighted.seen);
        sighted.slack.is_below(match self.is_orthographic {
            true => inside_by,
            false => inside_by.smaller(sighted.seen.z),
        })
    }

    /// Which spheres cast no shadow into the image, if they are outside the view; all if instances there do not count.
    #[inline(always)]
    fn is_dark<L: Lane>(&self, sighted: &Sighted<L>) -> L::Mask {
        let all = L::zero().is_at_most(L::zero());
        match (&self.on_axis, &self.shadows) {
            (None, _) => all,
            (Some(_), None) => !all,
            (Some(_), Some(shadows)) => {
                shadows.is_dark(sighted.world, sighted.seen, sighted.radius)
            }
        }
    }

    /// The largest errors of groups that are certainly not refined, by whether they were.
    #[inline(always)]
    fn coarse<L: Lane>(
        &self,
        width: usize,
        sighted: &Sighted<L>,
        bounds: &Bounds<L>,
        dark: L::Mask,
    ) -> L {
        let mut in_view = bounds.in_view[0] * L::splat(self.scale.coarse[width]);
        let mut outside = L::infinity();
        if let Some(scale) = &self.on_axis {
            let on_axis = bounds.on_axis[0] * L::splat(scale.coarse[width]);
            // A sphere on the edge may be inside or outside.
            in_view = in_view.smaller(on_axis);
            outside = L::choose(dark, outside, on_axis);
        }
        L::choose(self.is_outside(width, sighted), outside, in_view)
    }

    /// The errors above which groups are certainly refined, by whether they were.
    #[inline(always)]
    fn fine<L: Lane>(
        &self,
        width: usize,
        sighted: &Sighted<L>,
        bounds: &Bounds<L>,
        dark: L::Mask,
    ) -> L {
        let in_view = bounds.in_view[1] * L::splat(self.scale.fine[width]);
        let mut elsewhere = L::infinity();
        if let Some(scale) = &self.on_axis {
            let on_axis = bounds.on_axis[1] * L::splat(scale.fine[width]);
            let counts = self.is_outside(width, sighted) & !dark;
            elsewhere = L::choose(counts, on_axis, elsewhere);
        }
        L::choose(self.is_inside(width, sighted), in_view, elsewhere)
    }

    /// Bounds of errors in pixels, for any threshold. The wider view has wider corners, in which errors may be larger.
    /// It therefore has an upper bound of its own; the lower bound is valid for both.
    #[inline(always)]
    fn bounds<L: Lane>(&self, width: usize, sighted: &Sighted<L>) -> Bounds<L> {
        let least_cosine = self.least_cosines[width];
        let relaxation = L::splat(self.least_relaxation);
        if self.is_orthographic {
            return Bounds {
                in_view: [L::one(); 2],
                on_axis: [L::one(); 2],
            };
        }
        let Sighted {
            seen,
            radius,
            slack,
            ..
        } = *sighted;
        let distance_squared = seen.dot(seen);
        let distance = distance_squared.sqrt();
        let gap = distance - radius;
        // Cosine and depth of the criterion's extent.
        let off_axis = (seen.x * seen.x + seen.y * seen.y).sqrt();
        let tangent_length = (gap * (distance + radius)).sqrt();
        let cosine = (seen.z * tangent_length - off_axis * radius) / distance_squared;
        let cosine = (cosine - L::splat(1e-5)).larger(L::splat(least_cosine));
        let depth = (seen.z - radius).larger(gap * cosine);
        let [most, least] = self.counts_secant.map(|counts_secant| match counts_secant {
            true => depth * cosine,
            false => depth * cosine.sqrt(),
        });
        // The radius here exceeds the instance's by at most the excess. The bound may be too low by 4 to 6 times the
        // excess over the gap.
        let excess = radius * L::splat(0.002) + slack * L::splat(2.0);
        let rest = (gap - excess * L::splat(6.0 / least_cosine)) * relaxation;
        let is_certain = L::zero().is_below(rest);
        Bounds {
            in_view: [
                // A sphere that reaches the camera has no bound.
                L::choose(L::zero().is_below(gap), most, -L::infinity()),
                L::choose(is_certain, least * gap / rest, L::infinity()),
            ],
            on_axis: [gap, (distance * L::splat(ROUNDING) + slack) / relaxation],
        }
    }
}

impl Scale {
    fn new(thresholds: &Thresholds, px_per_unit: f32) -> Self {
        let scales = [thresholds.refine_above_px, thresholds.coarsen_below_px];
        let scales = scales.map(|threshold_px| threshold_px / px_per_unit);
        Self {
            coarse: scales.map(|scale| scale / ROUNDING),
            fine: scales.map(|scale| scale * (ROUNDING * ROUNDING)),
        }
    }
}

/// The least factor of errors by a relaxed aspect ratio; 0 if one sample may replace the bound.
fn least_relaxation(settings: &LodSettings, camera: &Camera) -> f32 {
    if matches!(camera, Camera::Orthographic(_)) {
        1.0
    } else if settings.advanced.max_curl != 0.0 {
        0.0
    } else if settings.advanced.min_aspect_ratio > 0.0 {
        (0.999 / (corner_secant(camera) * settings.advanced.min_aspect_ratio)).min(1.0)
    } else {
        1.0
    }
}
