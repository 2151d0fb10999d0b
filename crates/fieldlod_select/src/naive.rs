//! The specification of [`select`](crate::select): the cut rule in its shortest form. It is slow; the fast paths are
//! tested against it.

use fieldlod_hierarchy::Hierarchy;

use crate::settings::LodSettings;

/// Whether `group` is refined: it has no simplification, or its error exceeds the threshold, or a
/// finer group is refined.
///
/// `was_refined` returns whether the previous cut refined a group, for the hysteresis.
pub fn is_refined(
    hierarchy: &Hierarchy,
    group: usize,
    settings: &LodSettings,
    was_refined: &impl Fn(usize) -> bool,
    error_px: &impl Fn(usize) -> f32,
) -> bool {
    let data = &hierarchy.groups[group];
    data.is_terminal()
        || settings
            .thresholds(1.0)
            .exceeded_by(error_px(group), was_refined(group))
        || hierarchy
            .finer_groups(data)
            .iter()
            .any(|&finer| is_refined(hierarchy, finer as usize, settings, was_refined, error_px))
}

/// The units to draw, ascending. A unit is drawn if the group that consumes it is refined and the group that produced
/// it is not. No group produced source geometry.
pub fn select(
    hierarchy: &Hierarchy,
    settings: &LodSettings,
    was_refined: &impl Fn(usize) -> bool,
    error_px: &impl Fn(usize) -> f32,
) -> Vec<u32> {
    let refined =
        |group: u32| is_refined(hierarchy, group as usize, settings, was_refined, error_px);
    let drawn = |index: &u32| {
        let unit = &hierarchy.units[*index as usize];
        refined(unit.consumed_by) && unit.producer().is_none_or(|group| !refined(group))
    };
    (0..hierarchy.units.len() as u32).filter(drawn).collect()
}
