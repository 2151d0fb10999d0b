//! The effect of each setting on errors and cuts.

mod common;

use common::{
    any_placement, any_settings, any_view, hierarchies, look, perspective, with_advanced,
};
use fieldlod_hierarchy::{Group, Sphere};
use fieldlod_select::{
    AdvancedSettings, Cut, InstanceView, LodSettings, Offscreen, group_error_px, select,
};
use glam::{Affine3A, Vec3};
use proptest::prelude::*;

fn cut_of(which: usize, view: &fieldlod_select::View, settings: &LodSettings) -> Cut {
    let (mut cut, placement) = (Cut::default(), Affine3A::IDENTITY);
    select(&hierarchies()[which], &placement, view, settings, &mut cut);
    cut
}

/// Whether `finer` refines all groups that `coarser` refines.
fn holds(finer: &Cut, coarser: &Cut) -> bool {
    let mut pairs = coarser.refined().iter().zip(finer.refined());
    pairs.all(|(&coarser, &finer)| !coarser || finer)
}

fn capped(error_px: f32, displacement_px: f32) -> LodSettings {
    LodSettings {
        displacement_px: Some(displacement_px),
        ..LodSettings::with_error_px(error_px)
    }
}

/// The screen-space error at the default settings.
fn error_px(group: &Group, instance: &InstanceView) -> f32 {
    group_error_px(group, instance, &LodSettings::default(), false)
}

/// The largest displacement.
fn displacement_px(group: &Group, instance: &InstanceView) -> f32 {
    group_error_px(group, instance, &LodSettings::guaranteed(1.0), false)
}

const ON_AXIS: Offscreen = Offscreen::OnAxis { bias: 1.0 };

proptest! {
    #[test]
    fn both_thresholds_refine_what_either_does(which in 0usize..5, view in any_view(), placement in any_placement(), error_px in 0.1f32..10.0, cap_px in 0.1f32..10.0) {
        let instance = InstanceView::new(&view, &placement);
        let both = capped(error_px, cap_px);
        for group in &hierarchies()[which].groups {
            let either = self::error_px(group, &instance) > error_px * 1.0001
                || displacement_px(group, &instance) > cap_px * 1.0001;
            prop_assert!(!either || group_error_px(group, &instance, &both, false) > error_px);
        }
    }

    #[test]
    fn refined_groups_never_have_smaller_errors(which in 0usize..5, view in any_view(), placement in any_placement(), settings in any_settings()) {
        let instance = InstanceView::new(&view.with_margins(&settings), &placement);
        for group in &hierarchies()[which].groups {
            prop_assert!(error_px(group, &instance) >= 0.0);
            prop_assert!(displacement_px(group, &instance) >= 0.0);
            let [error_px, refined_px] = [false, true].map(|was_refined| group_error_px(group, &instance, &settings, was_refined));
            let is_less = refined_px < error_px;
            prop_assert!(!is_less);
        }
    }

    #[test]
    fn sample_differs_from_bound_by_change_of_density(which in 0usize..5, view in any_view(), max_curl in 0.01f32..0.3) {
        let instance = InstanceView::new(&view, &Affine3A::IDENTITY);
        let sampled = with_advanced(|advanced| advanced.max_curl = max_curl);
        for group in &hierarchies()[which].groups {
            let (bound, sample) = (error_px(group, &instance), group_error_px(group, &instance, &sampled, false));
            prop_assert!(sample <= bound * 1.0001);
            // The ratio is √(1 + κ) to first order; spheres that graze a wide corner add a little.
            prop_assert!(bound == f32::INFINITY || sample * (1.0 + 2.0 * max_curl) >= bound, "{} {}", sample, bound);
        }
    }

    #[test]
    fn aspect_ratio_relaxes_by_its_factor_at_most(which in 0usize..5, view in any_view(), min_aspect_ratio in 0.1f32..1.0) {
        let instance = InstanceView::new(&view, &Affine3A::IDENTITY);
        let settings = LodSettings { advanced: AdvancedSettings { min_aspect_ratio, ..AdvancedSettings::default() }, ..LodSettings::guaranteed(1.0) };
        for group in &hierarchies()[which].groups {
            let (full, relaxed) = (displacement_px(group, &instance), group_error_px(group, &instance, &settings, false));
            prop_assert!(relaxed <= full);
            let center = instance.sphere_in_camera(&group.bounds).center;
            let aspect = view.camera().aspect_ratio(center);
            // A point at the centre is relaxed by its own factor at most.
            prop_assert!(full == f32::INFINITY || !view.camera().contains(center) || relaxed * 1.001 >= full * (aspect / min_aspect_ratio).min(1.0));
        }
    }

    #[test]
    fn margin_never_lowers_an_error(which in 0usize..5, view in any_view(), margin in 0.0f32..1.0) {
        let settings = with_advanced(|advanced| (advanced.offscreen_margin, advanced.edge_hysteresis) = (margin, 0.0));
        let wide = InstanceView::new(&view.with_margins(&settings), &Affine3A::IDENTITY);
        let plain = InstanceView::new(&view, &Affine3A::IDENTITY);
        for group in &hierarchies()[which].groups {
            // A wider frustum may exclude more of the spheres behind the camera.
            let is_ahead = plain.sphere_in_camera(&group.bounds).center.z >= 0.0;
            prop_assert!(!is_ahead || error_px(group, &wide) >= error_px(group, &plain));
        }
    }

    #[test]
    fn on_axis_changes_errors_outside_the_view_only(which in 0usize..5, view in any_view(), placement in any_placement(), settings in any_settings()) {
        let instance = InstanceView::new(&view, &placement);
        let [coarsest, on_axis] = [Offscreen::Coarsest, ON_AXIS].map(|offscreen| LodSettings { advanced: AdvancedSettings { offscreen, max_curl: 0.0, min_aspect_ratio: 0.0, ..settings.advanced }, ..settings });
        for group in &hierarchies()[which].groups {
            let (hidden, beside) = (group_error_px(group, &instance, &coarsest, false), group_error_px(group, &instance, &on_axis, false));
            let Sphere { center, radius } = instance.sphere_in_camera(&group.bounds);
            if group.is_terminal() || view.camera().touches_sphere(center, radius) {
                prop_assert_eq!(hidden.to_bits(), beside.to_bits());
                continue;
            }
            prop_assert_eq!(hidden, 0.0);
            let has_threshold = settings.error_px.or(settings.displacement_px).is_some();
            // A flattened instance may have no error.
            let is_flat = placement.matrix3.determinant() == 0.0;
            prop_assert!(beside > 0.0 || !has_threshold || is_flat || group.mean_normal != Vec3::ZERO);
        }
    }

    #[test]
    fn fewer_rendered_pixels_never_refine(which in 0usize..5, view in any_view(), resolution_scale in 0.1f32..1.0) {
        let plain = cut_of(which, &view, &LodSettings::default());
        let upscaled = LodSettings { resolution_scale, ..LodSettings::default() };
        prop_assert!(holds(&plain, &cut_of(which, &view, &upscaled)));
    }
}

/// A group at the origin, with an error and a deviation of 1.
fn group_of(mean_normal: Vec3, radius: f32) -> Group {
    Group {
        mean_normal,
        bounds: Sphere {
            center: Vec3::ZERO,
            radius,
        },
        error_in_local: 1.0,
        deviation_in_local: 1.0,
        ..hierarchies()[3].groups[5]
    }
}

#[test]
fn error_depends_on_orientation() {
    let view = look(perspective(1.0), Vec3::Z * 10.0, Vec3::ZERO);
    let error_px = |scale: Vec3, mean_normal: Vec3| {
        let instance = InstanceView::new(&view, &Affine3A::from_scale(scale));
        error_px(&group_of(mean_normal, 0.01), &instance)
    };
    // The mean of max(n·s, 0) over a sphere is 1/4: 4 V + 0.4 p is 1.4.
    let closed = error_px(Vec3::ONE, Vec3::ZERO);
    for (scale, mean_normal, expected) in [
        // A flat group that faces the camera, one turned away, and one seen edge-on.
        (Vec3::ONE, Vec3::Z, 4.0),
        (Vec3::ONE, Vec3::NEG_Z, 0.0),
        (Vec3::ONE, Vec3::X, 0.4),
        // Normals of mirrored instances point outward too.
        (Vec3::new(1.0, 1.0, -1.0), Vec3::NEG_Z, 4.0),
    ] {
        let ratio = error_px(scale, mean_normal) / closed;
        let weight = ratio * ratio * 1.4;
        assert!((weight - expected).abs() < 0.01, "{weight} of {expected}");
    }
}

#[test]
fn both_thresholds_draw_like_the_stricter_one() {
    let view = look(perspective(1.0), Vec3::Z * 4.0, Vec3::ZERO);
    let triangles = |settings| cut_of(0, &view, &settings).triangle_count();
    let quality = triangles(LodSettings::default());
    let guaranteed = triangles(LodSettings::guaranteed(1.0));
    assert!(guaranteed > quality);
    assert_eq!(triangles(capped(1.0, 1.0)), guaranteed);
    assert_eq!(triangles(capped(1.0, 1e9)), quality);
}

#[test]
fn cut_without_thresholds_is_the_coarsest() {
    let neither = LodSettings {
        error_px: None,
        ..LodSettings::default()
    };
    for (which, hierarchy) in hierarchies().iter().enumerate() {
        // The eye is inside the object, where every error is infinite.
        let eye = hierarchy.groups[0].bounds.center;
        let view = look(perspective(1.0), eye, Vec3::ZERO);
        let coarsest = cut_of(which, &view, &LodSettings::with_error_px(f32::INFINITY));
        assert_eq!(cut_of(which, &view, &neither).units(), coarsest.units());
    }
}

/// A caster beside or behind the camera counts as it would on the axis at the same distance, times the bias.
#[test]
fn caster_outside_the_view_counts_as_on_the_axis() {
    let small = group_of(Vec3::ZERO, 0.01);
    for (distance, bias) in [(1.0, 1.0), (10.0, 1.0), (1000.0, 1.0), (10.0, 0.25)] {
        for settings in [LodSettings::default(), LodSettings::guaranteed(1.0)] {
            let error = |target: Vec3, offscreen| {
                let view = look(perspective(1.0), Vec3::Z * distance, target);
                let mut settings = settings;
                settings.advanced.offscreen = offscreen;
                let instance = InstanceView::new(&view, &Affine3A::IDENTITY);
                group_error_px(&small, &instance, &settings, false)
            };
            let on_axis = error(Vec3::ZERO, ON_AXIS);
            for away in [Vec3::Z * 2.0, Vec3::new(3.0, 0.5, 1.0)] {
                let beside = error(away * distance, Offscreen::OnAxis { bias });
                let ratio = beside / (on_axis * bias);
                assert!((ratio - 1.0).abs() < 0.03, "{beside} {on_axis}");
                assert_eq!(error(away * distance, Offscreen::Coarsest), 0.0);
            }
        }
    }
}

#[test]
fn refined_group_leaves_the_view_later_than_it_entered() {
    // The places past the edge of the image at which the last group leaves and, on the way back, the first one enters.
    let edges = |edge_hysteresis: f32| {
        let settings = with_advanced(|advanced| advanced.edge_hysteresis = edge_hysteresis);
        let mut cut = Cut::default();
        let mut more_triangles = |step: u8| {
            let before = cut.triangle_count();
            let target = Vec3::X * (2.0 + f32::from(step) * 0.2);
            let view = look(perspective(1.0), Vec3::Z * 4.0, target);
            let placement = Affine3A::IDENTITY;
            select(&hierarchies()[0], &placement, &view, &settings, &mut cut);
            cut.triangle_count().cmp(&before)
        };
        let left = (0..=60).filter(|&step| more_triangles(step).is_lt()).max();
        let entered = (0..60).rev().find(|&step| more_triangles(step).is_gt());
        (left.unwrap(), entered.unwrap())
    };
    let (left, entered) = edges(0.0);
    assert!(left.abs_diff(entered) <= 1, "{left} {entered}");
    let (left, entered) = edges(0.2);
    assert!(left > entered + 2, "{left} {entered}");
}

#[test]
fn guarantee_without_deviations_draws_full_detail_in_view() {
    let settings = LodSettings::guaranteed(1e6);
    // The guarantee does not include groups behind the camera.
    for (target, is_seen) in [(Vec3::ZERO, true), (Vec3::Z * 100.0, false)] {
        let view = look(perspective(1.0), Vec3::Z * 50.0, target);
        let cut = cut_of(4, &view, &settings);
        let (terminal, others) = cut.refined().split_last().unwrap();
        assert!(*terminal && others.iter().all(|&refined| refined == is_seen));
    }
}

#[test]
fn nan_threshold_accepts_all_alone_and_none_beside_another() {
    let view = look(perspective(1.0), Vec3::Z * 4.0, Vec3::ZERO);
    let triangles = |error_px, displacement_px| {
        let settings = LodSettings {
            error_px,
            displacement_px,
            ..LodSettings::default()
        };
        cut_of(0, &view, &settings).triangle_count()
    };
    let (coarsest, finest) = (triangles(None, None), triangles(Some(0.0), Some(0.0)));
    assert!(coarsest < finest);
    let (nan, some) = (Some(f32::NAN), Some(1e9));
    for (error_px, displacement_px, expected) in [
        (nan, None, coarsest),
        (None, nan, coarsest),
        (nan, some, finest),
        (some, nan, finest),
    ] {
        let drawn = triangles(error_px, displacement_px);
        assert_eq!(drawn, expected, "{error_px:?} {displacement_px:?}");
    }
}
