//! The cut: which units of a hierarchy to draw, and how it is chosen.

use fieldlod_hierarchy::Hierarchy;
use glam::Affine3A;

use crate::criterion::group_error_px;
use crate::settings::LodSettings;
use crate::view::{InstanceView, View};

/// The cut of one instance in one view. Keep it from frame to frame: the hysteresis needs the previous cut, and reusing
/// it allocates nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cut {
    refined: Vec<bool>,
    units: Vec<u32>,
    triangle_count: u64,
}

impl Cut {
    /// The units to draw: indices into the hierarchy's `units`, ascending.
    #[must_use]
    pub fn units(&self) -> &[u32] {
        &self.units
    }

    /// Triangles in the cut.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.triangle_count
    }

    /// Whether each group is refined.
    #[must_use]
    pub fn refined(&self) -> &[bool] {
        &self.refined
    }
}

/// Selects the cut of one instance, placed by `world_from_local`, in one view.
///
/// `cut` is the previous cut of the same instance in the same view, or an empty cut. It becomes the new cut. The cut is
/// valid for any input; a group with an error of NaN is refined.
pub fn select(
    hierarchy: &Hierarchy,
    world_from_local: &Affine3A,
    view: &View,
    settings: &LodSettings,
    cut: &mut Cut,
) {
    let view = view.with_margins(settings);
    let instance = InstanceView::new(&view, world_from_local);
    select_by(hierarchy, settings, cut, |group, was_refined| {
        group_error_px(&hierarchy.groups[group], &instance, settings, was_refined)
    });
}

/// Selects a cut by any criterion: `error_px` gives the screen-space error of a group by its index.
///
/// This is [`select`] with another criterion, to compare criteria on the same hierarchy. The cut is valid for any
/// errors.
pub fn select_with(
    hierarchy: &Hierarchy,
    settings: &LodSettings,
    cut: &mut Cut,
    error_px: impl Fn(usize) -> f32,
) {
    select_by(hierarchy, settings, cut, |group, _| error_px(group));
}

fn select_by(
    hierarchy: &Hierarchy,
    settings: &LodSettings,
    cut: &mut Cut,
    error_px: impl Fn(usize, bool) -> f32,
) {
    let thresholds = settings.thresholds(1.0);
    // The caller may pass a cut of another hierarchy, with another number of groups.
    cut.refined.resize(hierarchy.groups.len(), false);
    hierarchy.refine_by(&mut cut.refined, |group, was_refined| {
        thresholds.exceeded_by(error_px(group, was_refined), was_refined)
    });
    cut.units.clear();
    let drawn = hierarchy.drawn_units(&cut.refined).map(|unit| unit as u32);
    cut.units.extend(drawn);
    let units = cut
        .units
        .iter()
        .map(|&unit| &hierarchy.units[unit as usize]);
    cut.triangle_count = units.map(|unit| u64::from(unit.triangle_count)).sum();
}
