//! Every fast path equals its specification, bit for bit.

mod common;

use common::{HIERARCHIES, any_placement, any_settings, any_view, hierarchies};
use fieldlod_select::{GroupTable, InstanceView, group_error_px, refine};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn lanes_and_conservative_tests_equal_the_scalar_criterion(
        which in 0usize..HIERARCHIES,
        view in any_view(),
        placement in any_placement(),
        settings in any_settings(),
        was in prop_oneof![Just(0u64), Just(u64::MAX), any::<u64>()],
    ) {
        let hierarchy = &hierarchies()[which];
        let table = GroupTable::new(hierarchy);
        let instance = InstanceView::new(&view.with_margins(&settings), &placement);
        let was_refined = vec![was; hierarchy.groups.len().div_ceil(64)];
        let mut refined = Vec::new();
        refine(&table, &instance, &settings, &was_refined, &mut refined);
        let threshold_px = settings.threshold_px() / settings.resolution_scale;
        for (index, group) in hierarchy.groups.iter().enumerate() {
            let bit = |words: &[u64]| words[index / 64] >> (index % 64) & 1 == 1;
            let error_px = group_error_px(group, &instance, &settings, bit(&was_refined));
            let threshold_px = if bit(&was_refined) { threshold_px * settings.advanced.hysteresis } else { threshold_px };
            let expected = group.is_terminal() || error_px > threshold_px || error_px.is_nan();
            prop_assert_eq!(bit(&refined), expected, "group {}: {} px against {} px, {:?}", index, error_px, threshold_px, settings);
        }
    }
}
