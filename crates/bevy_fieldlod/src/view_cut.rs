//! What one view draws.

use bevy::prelude::*;
use fieldlod_select::{Selector, View};

/// The cut of one camera through the whole scene.
#[derive(Component, Default)]
pub(crate) struct ViewCut {
    pub(crate) selector: Selector,
    pub(crate) visibility: CutVisibility,
    /// The view that was last selected for.
    pub(crate) view: Option<View>,
    pub(crate) state: ViewState,
}

/// What a view draws of meshes with levels of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ViewState {
    /// Nothing: the camera is not active.
    #[default]
    Inactive,
    /// The source meshes.
    FullDetail,
    /// Its cut.
    Cut,
}

/// The units and levels in the cut of one view.
#[derive(Default)]
pub(crate) struct CutVisibility {
    /// By draw record: whether it is in the cut.
    records: Vec<bool>,
    /// By the index of the instance: the level of a whole mesh that is in the cut.
    levels: Vec<u8>,
}

/// The level of an instance of which this view has none.
const NO_LEVEL: u8 = u8::MAX;

impl CutVisibility {
    pub(crate) fn contains(&self, record: u32) -> bool {
        self.records.get(record as usize) == Some(&true)
    }

    /// The level of a whole mesh that this view asks for; `None` if it asks for none.
    pub(crate) fn level(&self, instance: u32) -> Option<u32> {
        let level = self.levels.get(instance as usize).copied();
        level.filter(|&level| level != NO_LEVEL).map(u32::from)
    }

    pub(crate) fn set(&mut self, record: u32, is_visible: bool) {
        let record = record as usize;
        if self.records.len() <= record {
            self.records.resize(record + 1, false);
        }
        self.records[record] = is_visible;
    }

    pub(crate) fn set_level(&mut self, instance: usize, level: u32) {
        if self.levels.len() <= instance {
            self.levels.resize(instance + 1, NO_LEVEL);
        }
        // A mesh has far fewer levels: each keeps at most three quarters of the triangles.
        self.levels[instance] = level.min(u32::from(NO_LEVEL) - 1) as u8;
    }

    /// Removes records that are out of use.
    pub(crate) fn remove(&mut self, records: &[u32]) {
        for &record in records {
            if let Some(is_visible) = self.records.get_mut(record as usize) {
                *is_visible = false;
            }
        }
    }

    /// Removes all records and returns them.
    pub(crate) fn take_records(&mut self) -> impl Iterator<Item = u32> + use<> {
        let records = std::mem::take(&mut self.records).into_iter().enumerate();
        records.filter_map(|(record, is_visible)| is_visible.then_some(record as u32))
    }

    /// Removes all levels and returns whether there were any.
    pub(crate) fn take_levels(&mut self) -> bool {
        !std::mem::take(&mut self.levels).is_empty()
    }
}
