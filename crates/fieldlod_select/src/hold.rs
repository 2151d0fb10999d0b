//! How long an answer holds: how far the camera may go and turn before it can change.
//!
//! Between two poses a point at distance ρ from the eye moves in camera space by at most
//! `|Δeye| + |ΔR| ρ`, with R the rotation. Path lengths of both are kept for the view; an answer keeps
//! where they stood and how much it can bear.

use camera_field::Camera;
use fieldlod_hierarchy::Sphere;

use crate::decide::conservative::ErrorScale;
use crate::settings::Thresholds;
use crate::stretch::{is_similarity, largest_stretch};
use crate::{LodSettings, Offscreen, View};

/// Allowance for the rounding of coordinates, relative to their size.
const POSITION_SLACK: f32 = 1e-5;
const SLACK: f32 = 1.001;

/// How far a view has gone and turned in all, since it was set back.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Odometer {
    moved: f64,
    turned: f64,
    /// How often it was.
    run: u32,
}

impl Odometer {
    /// Whether numbers have not got lost on the way.
    pub(crate) fn is_usable(&self) -> bool {
        self.moved.is_finite() && self.turned.is_finite()
    }

    /// The way between two poses.
    pub(crate) fn between(from: &View, to: &View) -> Self {
        let moved = (to.eye_in_world - from.eye_in_world).length();
        let turned = largest_stretch(&(to.camera_from_world - from.camera_from_world));
        Self {
            moved: f64::from(moved * SLACK),
            turned: f64::from(turned * SLACK),
            run: 0,
        }
    }

    pub(crate) fn advance(&mut self, step: &Self) {
        self.moved += step.moved;
        self.turned += step.turned;
    }

    /// Sets it back: nothing that held before holds any more.
    pub(crate) fn set_back(&mut self) {
        *self = Self {
            run: self.run.wrapping_add(1),
            ..Self::default()
        };
    }

    /// Whether readings of both can be compared.
    pub(crate) fn is_same_run(&self, other: &Self) -> bool {
        self.run == other.run
    }

    /// How far points that were within `reach` have gone in camera space, at most.
    pub(crate) fn reading(&self, reach: f32) -> f64 {
        self.moved + self.turned * f64::from(reach)
    }
}

/// What an answer bears: until the odometer's reading at a reach is so much, in the same run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hold {
    until: f64,
    reach: f32,
    run: u32,
}

impl Default for Hold {
    fn default() -> Self {
        Self::NONE
    }
}

impl Hold {
    /// Holds for no frame but this.
    pub(crate) const NONE: Self = Self {
        until: f64::NEG_INFINITY,
        reach: 0.0,
        run: 0,
    };

    /// Bears that points within `reach` go `slack` far from now on.
    fn bearing(slack: f64, reach: f32, now: &Odometer) -> Self {
        Self::until(now.reading(reach) + slack, reach, now)
    }

    /// Bears everything: what holds of nothing.
    pub(crate) fn forever(now: &Odometer) -> Self {
        Self::until(f64::INFINITY, 0.0, now)
    }

    /// Until the odometer's [reading](Odometer::reading) at a reach is `until`.
    pub(crate) fn until(until: f64, reach: f32, now: &Odometer) -> Self {
        let run = now.run;
        Self { until, reach, run }
    }

    fn remaining(&self, now: &Odometer) -> f64 {
        if self.run == now.run {
            self.until - now.reading(self.reach)
        } else {
            f64::NEG_INFINITY
        }
    }

    pub(crate) fn lasts(&self, now: &Odometer) -> bool {
        self.remaining(now) > 0.0
    }

    /// What both bear.
    pub(crate) fn and(&self, other: &Self, now: &Odometer) -> Self {
        let remaining = self.remaining(now).min(other.remaining(now));
        Self::bearing(remaining, self.reach.max(other.reach), now)
    }
}

/// Spheres and errors of whole objects against one view.
pub(crate) struct WholeTest<'a> {
    view: &'a View,
    entering: ErrorScale,
    leaving: ErrorScale,
    /// Of what is outside the view, if that counts.
    on_axis: Option<ErrorScale>,
    thresholds: Thresholds,
    now: Odometer,
    usable: bool,
}

/// A sphere around objects and the largest errors in them, times bias, in world units.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Whole {
    pub(crate) bounds: Sphere,
    pub(crate) error_weighed: f32,
    pub(crate) deviation: f32,
}

impl<'a> WholeTest<'a> {
    pub(crate) fn new(view: &'a View, settings: &LodSettings, now: Odometer) -> Self {
        let thresholds = settings.thresholds(1.0);
        let unit = view.camera_from_world.x_axis.length();
        // A view that scales, or no threshold at all, gets no shortcut.
        let rigid = is_similarity(&view.camera_from_world) && (unit - 1.0).abs() < 1e-4;
        Self {
            view,
            entering: ErrorScale::of_view(&view.camera, settings),
            leaving: ErrorScale::of_view(&view.kept_camera, settings),
            on_axis: (settings.offscreen == Offscreen::OnAxis)
                .then(|| ErrorScale::on_axis(&view.camera, settings)),
            thresholds,
            now,
            usable: rigid && thresholds.coarsen_below_px >= 0.0,
        }
    }

    /// Whether points go no farther in camera space than the odometer says.
    pub(crate) fn is_usable(&self) -> bool {
        self.usable
    }

    /// How far the farthest point of a sphere is from the eye, at most.
    pub(crate) fn farthest(&self, bounds: &Sphere) -> f32 {
        let distance = (bounds.center - self.view.eye_in_world).length();
        (distance + bounds.radius) * SLACK
    }

    /// For how long nothing in `whole` is refined but what always is; `None` if that cannot be told.
    /// `is_coarsest` tells that nothing in it was refined before.
    pub(crate) fn coarsest(&self, whole: &Whole, is_coarsest: bool) -> Option<Hold> {
        if !self.usable {
            return None;
        }
        let Sphere { center, radius } = whole.bounds;
        let from_eye = center - self.view.eye_in_world;
        let distance = from_eye.length();
        let size = center.length() + self.view.eye_in_world.length() + radius;
        let sphere = Sphere {
            center: self.view.camera_from_world * from_eye,
            radius: radius * SLACK + size * POSITION_SLACK,
        };
        let (scale, threshold_px) = if is_coarsest {
            (&self.entering, self.thresholds.refine_above_px)
        } else {
            (&self.leaving, self.thresholds.coarsen_below_px)
        };
        let hold =
            |slack: f32, reach: f32| Hold::bearing(f64::from(slack * 0.999), reach, &self.now);
        let far = self.distance_below(scale, threshold_px, whole, distance - sphere.radius);
        if far > 0.0 {
            return Some(hold(far, 0.0));
        }
        let camera = if is_coarsest {
            &self.view.camera
        } else {
            &self.view.kept_camera
        };
        let mut outside = distance_outside(camera, &sphere);
        if let Some(scale) = &self.on_axis {
            let gap = distance - sphere.radius;
            outside = lesser(
                outside,
                self.distance_below(scale, threshold_px, whole, gap),
            );
        }
        (outside > 0.0).then(|| hold(outside, (distance + outside) * SLACK))
    }

    /// By how much nearer than `gap` the errors stay below a threshold.
    fn distance_below(
        &self,
        scale: &ErrorScale,
        threshold_px: f32,
        whole: &Whole,
        gap: f32,
    ) -> f32 {
        let error = (whole.error_weighed * scale.of_weighed_error)
            .max(whole.deviation * scale.of_deviation)
            / threshold_px;
        match self.view.camera {
            Camera::Perspective(_) => gap - error,
            Camera::Orthographic(_) if error < 1.0 => f32::INFINITY,
            Camera::Orthographic(_) => -1.0,
        }
    }
}

/// The lesser of two numbers; NaN if either is.
fn lesser(a: f32, b: f32) -> f32 {
    if a < b || a.is_nan() { a } else { b }
}

/// How far a sphere in camera space is from the field of view, at least; negative inside.
fn distance_outside(camera: &Camera, sphere: &Sphere) -> f32 {
    let Sphere { center, radius } = *sphere;
    let gap = match camera {
        Camera::Perspective(camera) => {
            let beyond = |across: f32, slope: f32| {
                (slope * center.z - across) / (1.0 + slope * slope).sqrt()
            };
            let (min, max) = (camera.slope_min, camera.slope_max);
            (-center.z)
                .max(beyond(center.x, min.x))
                .max(beyond(-center.x, -max.x))
                .max(beyond(center.y, min.y))
                .max(beyond(-center.y, -max.y))
        }
        Camera::Orthographic(camera) => (camera.min.x - center.x)
            .max(center.x - camera.max.x)
            .max(camera.min.y - center.y)
            .max(center.y - camera.max.y),
    };
    gap - radius
}
