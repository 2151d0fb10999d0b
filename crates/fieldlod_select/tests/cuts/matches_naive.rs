//! The fast selection equals its specification, bit for bit.

use fieldlod_select::{Cut, InstanceView, LodSettings, group_error_px, naive, select, select_with};
use proptest::prelude::*;

use crate::common::{HIERARCHIES, any_placement, any_view, hierarchies};

/// Errors of any sign, also infinite and NaN.
fn any_error() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => 0.0f32..2.0,
        1 => Just(f32::NAN),
        1 => Just(f32::INFINITY),
        1 => Just(f32::NEG_INFINITY),
        1 => any::<f32>(),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_criterion_equals_naive(
        which in 0usize..HIERARCHIES,
        errors in prop::collection::vec(any_error(), 64),
        next_errors in prop::collection::vec(any_error(), 64),
        error_px in prop_oneof![Just(0.0f32), 0.01f32..10.0],
        hysteresis in 0.0f32..=1.0,
    ) {
        let hierarchy = &hierarchies()[which];
        let mut settings = LodSettings::with_error_px(error_px);
        settings.advanced.hysteresis = hysteresis;
        let mut cut = Cut::default();
        let first = |group: usize| errors[group % errors.len()];
        select_with(hierarchy, &settings, &mut cut, first);
        let expected = naive::select(hierarchy, &settings, &|_| false, &first);
        prop_assert_eq!(cut.units(), &expected);

        let before = cut.refined().to_vec();
        let second = |group: usize| next_errors[group % next_errors.len()];
        select_with(hierarchy, &settings, &mut cut, second);
        let expected = naive::select(hierarchy, &settings, &|group| before[group], &second);
        prop_assert_eq!(cut.units(), &expected);
    }

    #[test]
    fn any_view_equals_naive(which in 0usize..HIERARCHIES, view in any_view(), placement in any_placement(), error_px in 0.05f32..20.0) {
        let hierarchy = &hierarchies()[which];
        let settings = LodSettings::with_error_px(error_px);
        let mut cut = Cut::default();
        select(hierarchy, &placement, &view, &settings, &mut cut);
        // `select` adds the margins to the view.
        let instance = InstanceView::new(&view.with_margins(&settings), &placement);
        let criterion = |group: usize| group_error_px(&hierarchy.groups[group], &instance, &LodSettings::default(), false);
        let expected = naive::select(hierarchy, &settings, &|_| false, &criterion);
        prop_assert_eq!(cut.units(), &expected);
        let triangles = expected.iter().map(|&unit| u64::from(hierarchy.units[unit as usize].triangle_count));
        prop_assert_eq!(cut.triangle_count(), triangles.sum::<u64>());
    }
}
