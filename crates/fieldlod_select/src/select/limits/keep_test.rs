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

use camera_field::{Camera, FieldOfView, SeenSphere};
use glam::{Mat3, Vec3};

use super::limit_columns::EightLimits;
use crate::criterion::limits::{Allowed, ErrorUnits};
use crate::criterion::{PLACE_SLACK, ROUNDING};
use crate::lanes::bits::{LANES, lane_bits, set_bits_of};
use crate::lanes::{Eight, smaller, with_avx2};
use crate::scene::columns::{EightSpheres, sphere_at};
use crate::settings::{LodSettings, Offscreen, Thresholds};
use crate::view::View;
use crate::view::shadow_lights::ShadowTest;
use crate::view::sides::LensSides;
use crate::view::stretch::is_similarity;

/// The test of one view under one set of settings.
pub(crate) struct KeepTest {
    lens: LensTest,
    shadows: Option<ShadowTest>,
}

/// The test without the shadows. Each pass copies it: through a reference, the compiler could not read a field of a
/// branch that it turns into vector instructions.
#[derive(Clone, Copy)]
struct LensTest {
    eye: Vec3,
    eye_slack: f32,
    camera_from_world: Mat3,
    is_orthographic: bool,
    /// The view that groups enter, and the wider view that refined groups leave.
    views: [FieldOfView; 2],
    sides: [LensSides; 2],
    scale: Scale,
    /// Scale of errors outside the view; `None` if they are 0.
    on_axis: Option<Scale>,
    /// Whether the upper and the lower bound are bounds of deviations, which count the secant in full.
    counts_secant: [bool; 2],
    /// The least factor of [`AdvancedSettings::min_aspect_ratio`](crate::AdvancedSettings::min_aspect_ratio); 0 if
    /// errors have no lower bound.
    least_relaxation: f32,
}

/// Thresholds over pixels per unit of error, of groups that were not refined and of groups that were refined: rounded
/// down, and rounded up.
#[derive(Clone, Copy)]
struct Scale {
    coarse: [f32; 2],
    fine: [f32; 2],
}

/// A sphere in camera space.
struct Sighted {
    seen: Vec3,
    /// The radius plus the slack. Rounding moves a sphere by at most the slack.
    radius: f32,
    slack: f32,
}

/// Bounds of allowed errors, divided by the [`Scale`].
struct Bounds {
    /// In the view: errors up to the first certainly fit, errors above the second certainly exceed.
    in_view: [f32; 2],
    /// The same bounds on the axis, for spheres outside the view.
    on_axis: [f32; 2],
}

/// An instance whose cut may change in this frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::select) struct Near {
    pub(in crate::select) slot: usize,
    /// Whether it is outside the view and casts no shadow into it, if instances outside count at all.
    pub(in crate::select) is_dark: bool,
    /// Certain bounds of its allowed errors.
    pub(in crate::select) allowed: Allowed,
}

/// Result of the test of eight instances of which some may change.
#[derive(Debug)]
pub(in crate::select) struct Looked {
    /// Index of the first instance among the tested instances.
    first: usize,
    /// Bits of the instances that keep their cuts.
    kept: u32,
    /// Bits of the instances outside the view that cast no shadow into it, if instances outside count at all.
    dark: u32,
    allowed: Eight<4>,
}

impl Looked {
    /// The instances whose cuts may change.
    #[inline]
    pub(in crate::select) fn near(&self) -> impl Iterator<Item = Near> + '_ {
        set_bits_of(!self.kept & 0xff).map(move |lane| {
            let [entering, staying, refining, leaving] = self.allowed.at(lane);
            Near {
                slot: self.first + lane,
                is_dark: self.dark >> lane & 1 == 1,
                allowed: Allowed {
                    coarse: [entering, staying],
                    fine: [refining, leaving],
                },
            }
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
        // The tolerance of a similarity.
        let is_rigid = is_similarity(&view.camera_from_world) && (unit - 1.0).abs() < 1e-4;
        let one = if is_rigid && thresholds.coarsen_below_px >= 0.0 {
            1.0
        } else {
            f32::NAN
        };
        let px = FieldOfView::of(&view.camera).px_per_unit * one;
        let per_unit = if counts_error {
            (px.x * px.y).sqrt()
        } else {
            px.max_element()
        };
        let on_axis = match settings.advanced.offscreen {
            Offscreen::Coarsest => None,
            Offscreen::OnAxis { bias } => Some(Scale::new(&thresholds, per_unit * bias.abs())),
        };
        let lens = LensTest {
            eye: view.eye_in_world,
            eye_slack: (view.eye_in_world.abs().element_sum()) * PLACE_SLACK,
            camera_from_world: view.camera_from_world * one,
            is_orthographic,
            views: [&view.camera, &view.kept_camera].map(FieldOfView::of),
            sides: [&view.camera, &view.kept_camera].map(LensSides::of),
            scale: Scale::new(&thresholds, per_unit),
            on_axis,
            counts_secant: [units.deviation > 0.0, !counts_error],
            least_relaxation: least_relaxation(settings, &view.camera),
        };
        Self {
            lens,
            shadows: on_axis.and_then(|_| ShadowTest::new(view)),
        }
    }

    /// Tests elements of eight instances, or of eight chunks. `looked` gets the elements of which some may change.
    ///
    /// AVX2 is used if the processor has it. The results are the same.
    pub(in crate::select) fn look(
        &self,
        spheres: &[EightSpheres],
        limits: &[EightLimits],
        looked: &mut Vec<Looked>,
    ) {
        looked.clear();
        let elements = spheres.iter().zip(limits).enumerate();
        with_avx2(
            #[inline(always)]
            || {
                // A local copy, as the doc of `LensTest` explains.
                let lens = self.lens;
                for (element, (spheres, limits)) in elements {
                    let dark = self.dark(spheres);
                    looked.extend(lens.look_at(element * LANES, spheres, limits, &dark));
                }
            },
        );
    }

    /// Which of eight spheres cast no shadow into the image.
    #[inline(always)]
    fn dark(&self, spheres: &EightSpheres) -> [u8; LANES] {
        match (&self.lens.on_axis, &self.shadows) {
            (None, _) => [1; LANES],
            (Some(_), None) => [0; LANES],
            (Some(_), Some(shadows)) => {
                let mut seen = Eight::splat([0.0; 4]);
                for lane in 0..LANES {
                    let (center, radius) = sphere_at(spheres, lane);
                    let sighted = self.lens.sight(center, radius);
                    let [x, y, z] = sighted.seen.to_array();
                    seen.set(lane, [x, y, z, sighted.radius]);
                }
                shadows.dark(spheres, &seen)
            }
        }
    }
}

impl LensTest {
    /// Tests eight instances, or eight chunks; `None` if all of them stay as they are.
    #[inline(always)]
    fn look_at(
        &self,
        first: usize,
        spheres: &EightSpheres,
        Eight([lowest, highest]): &EightLimits,
        dark: &[u8; LANES],
    ) -> Option<Looked> {
        let sighted = |lane: usize| {
            let (center, radius) = sphere_at(spheres, lane);
            self.sight(center, radius)
        };
        // Most instances are outside the view.
        let mut idle = [0u8; LANES];
        for lane in 0..LANES {
            let is_coarsest = lowest[lane] >= f32::INFINITY;
            let unseen = self.is_outside(0, &sighted(lane)) & is_coarsest & (dark[lane] != 0);
            idle[lane] = u8::from(unseen | (highest[lane] < 0.0));
        }
        if idle == [1; LANES] {
            return None;
        }
        // Most of the other instances are within their limits.
        let mut kept = [0u8; LANES];
        let [mut entering, mut leaving] = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let (sighted, is_dark) = (sighted(lane), dark[lane] != 0);
            let bounds = self.bounds(0, &sighted);
            entering[lane] = self.coarse(0, &sighted, &bounds, is_dark);
            leaving[lane] = self.fine(1, &sighted, &bounds, is_dark);
            let fits = highest[lane] <= entering[lane];
            let shows = (lowest[lane] >= f32::INFINITY) | (leaving[lane] < lowest[lane]);
            kept[lane] = idle[lane] | u8::from(fits & shows);
        }
        if kept == [1; LANES] {
            return None;
        }
        let [mut staying, mut refining] = [[0.0; LANES]; 2];
        let mut unlit = [0u8; LANES];
        for lane in 0..LANES {
            let (sighted, is_dark) = (sighted(lane), dark[lane] != 0);
            staying[lane] = self.coarse(1, &sighted, &self.bounds(1, &sighted), is_dark);
            refining[lane] = self.fine(0, &sighted, &self.bounds(0, &sighted), is_dark);
            unlit[lane] = u8::from(is_dark & self.is_outside(0, &sighted));
        }
        let counts_outside = self.on_axis.is_some();
        Some(Looked {
            first,
            kept: lane_bits(&kept),
            dark: if counts_outside { lane_bits(&unlit) } else { 0 },
            allowed: Eight([entering, staying, refining, leaving]),
        })
    }

    #[inline(always)]
    fn sight(&self, world: Vec3, radius: f32) -> Sighted {
        let size = world.x.abs() + world.y.abs() + world.z.abs();
        let slack = size * PLACE_SLACK + self.eye_slack;
        Sighted {
            seen: self.camera_from_world * (world - self.eye),
            radius: radius * ROUNDING + slack,
            slack,
        }
    }

    /// Whether a sphere is certainly outside the view that groups enter (`width` 0) or leave (`width` 1).
    #[inline(always)]
    fn is_outside(&self, width: usize, sighted: &Sighted) -> bool {
        sighted.radius < -self.inside_by(width, sighted)
    }

    /// Whether a sphere is certainly not outside: its centre is in the view.
    #[inline(always)]
    fn is_inside(&self, width: usize, sighted: &Sighted) -> bool {
        sighted.slack < self.inside_by(width, sighted)
    }

    /// How far inside a view the centre of a sphere is.
    #[inline(always)]
    fn inside_by(&self, width: usize, sighted: &Sighted) -> f32 {
        let inside_by = self.sides[width].least_inside(sighted.seen);
        // A sphere behind the eye may be near all sides of a narrow view. Its depth shows that it is outside.
        let in_front_by = smaller(inside_by, sighted.seen.z);
        if self.is_orthographic {
            inside_by
        } else {
            in_front_by
        }
    }

    /// The largest error of groups that are certainly not refined. `width` is 1 for groups that were refined, else 0.
    #[inline(always)]
    fn coarse(&self, width: usize, sighted: &Sighted, bounds: &Bounds, is_dark: bool) -> f32 {
        // Without `on_axis`, errors outside are 0: any error is allowed there.
        let mut in_view = bounds.in_view[0] * self.scale.coarse[width];
        let mut outside = f32::INFINITY;
        if let Some(scale) = &self.on_axis {
            let on_axis = bounds.on_axis[0] * scale.coarse[width];
            // A sphere on the edge may be inside or outside.
            in_view = smaller(in_view, on_axis);
            outside = if is_dark { outside } else { on_axis };
        }
        let is_outside = self.is_outside(width, sighted);
        if is_outside { outside } else { in_view }
    }

    /// The error above which groups are certainly refined. `width` is 1 for groups that were refined, else 0.
    #[inline(always)]
    fn fine(&self, width: usize, sighted: &Sighted, bounds: &Bounds, is_dark: bool) -> f32 {
        // On the edge of the view, no error certainly refines.
        let in_view = bounds.in_view[1] * self.scale.fine[width];
        let mut elsewhere = f32::INFINITY;
        if let Some(scale) = &self.on_axis {
            let counts = self.is_outside(width, sighted) & !is_dark;
            let on_axis = bounds.on_axis[1] * scale.fine[width];
            elsewhere = if counts { on_axis } else { elsewhere };
        }
        let is_inside = self.is_inside(width, sighted);
        if is_inside { in_view } else { elsewhere }
    }

    /// Bounds of allowed errors, for any threshold. The wider view has wider corners, in which errors may be larger.
    /// It therefore has its own bound of errors that fit; the bound of errors that exceed is valid for both views.
    #[inline(always)]
    fn bounds(&self, width: usize, sighted: &Sighted) -> Bounds {
        if self.is_orthographic {
            return Bounds {
                in_view: [1.0; 2],
                on_axis: [1.0; 2],
            };
        }
        let (radius, slack) = (sighted.radius, sighted.slack);
        let (view, relaxation) = (&self.views[width], self.least_relaxation);
        // Larger than the sphere of any group, so that the field's bounds are those of all groups.
        let sphere = SeenSphere::new(sighted.seen, radius);
        let over = view.over_sphere(&sphere, false);
        let gap = sphere.distance - radius;
        let of_error = over.depth / over.secant.sqrt();
        let of_deviation = over.depth / over.secant;
        let [counts_most, counts_least] = self.counts_secant;
        let most = if counts_most { of_deviation } else { of_error };
        let least = if counts_least { of_deviation } else { of_error };
        // The radius here exceeds the instance's by at most the excess. The bound may be too low by 4 to 6 times the
        // excess over the gap.
        let excess = radius * 0.002 + slack * 2.0;
        let rest = (gap - excess * (6.0 * view.corner_secant)) * relaxation;
        let least = least * gap / rest;
        Bounds {
            in_view: [
                // A sphere that reaches the camera has no bound.
                if gap > 0.0 { most } else { f32::NEG_INFINITY },
                if rest > 0.0 { least } else { f32::INFINITY },
            ],
            on_axis: [gap, (sphere.distance * ROUNDING + slack) / relaxation],
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
        (0.999 / (FieldOfView::of(camera).corner_secant * settings.advanced.min_aspect_ratio))
            .min(1.0)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use camera_field::Intrinsics;
    use glam::{Affine3A, Vec2};
    use proptest::prelude::*;

    use super::*;
    use crate::view::shadow_lights::ShadowLight;

    fn any_number() -> impl Strategy<Value = f32> {
        prop_oneof![
            8 => -30.0f32..30.0,
            1 => prop::sample::select(vec![0.0, -2.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN]),
        ]
    }

    fn any_columns<const N: usize>() -> impl Strategy<Value = [[f32; LANES]; N]> {
        let column = prop::collection::vec(any_number(), LANES);
        prop::collection::vec(column, N).prop_map(|columns| {
            let column = |column: usize| std::array::from_fn(|lane| columns[column][lane]);
            std::array::from_fn(column)
        })
    }

    proptest! {
        #[test]
        fn avx2_gives_the_same_bits(
            [x, y, z, radius, lowest, highest] in any_columns::<6>(),
            turn in -3.0f32..3.0,
            bias in prop::option::of(0.1f32..1.0),
            has_sun in any::<bool>(),
        ) {
            let camera = Camera::Perspective(Intrinsics::centered(200.0, Vec2::new(320.0, 180.0)));
            let pose = Affine3A::from_rotation_y(turn);
            let suns = [ShadowLight::Sun(Vec3::NEG_Y)];
            let view = View::new(camera, &pose).with_shadow_lights(&suns[..usize::from(has_sun)]);
            let mut settings = LodSettings::default();
            settings.advanced.offscreen = bias.map_or(Offscreen::Coarsest, |bias| Offscreen::OnAxis { bias });
            let test = KeepTest::new(&view, &settings);
            let spheres = Eight([x, y, z, radius.map(f32::abs)]);
            let limits = Eight([lowest, highest]);
            let mut looked = Vec::new();
            test.look(&[spheres], &[limits], &mut looked);
            let without_avx2 = test.lens.look_at(0, &spheres, &limits, &test.dark(&spheres));
            prop_assert_eq!(format!("{:?}", looked.first()), format!("{:?}", without_avx2.as_ref()));
        }
    }
}
