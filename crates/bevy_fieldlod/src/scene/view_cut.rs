//! What one view draws.

use bevy::camera::visibility::RenderLayers;
use bevy::prelude::*;

use fieldlod_select::{LodSettings, Selector, View};

use crate::scene::deferred_cuts::DeferredCuts;

/// The cut of one camera through the whole scene.
#[derive(Component, Default)]
pub(crate) struct ViewCut {
    pub(crate) selector: Selector,
    pub(crate) visibility: CutVisibility,
    /// The view that was last selected for.
    pub(crate) view: Option<View>,
    /// What is to be selected in this frame.
    pub(crate) wanted: Option<(View, LodSettings)>,
    pub(crate) state: ViewState,
    /// The camera whose cut it draws, and how often that was cleared when this began.
    pub(crate) leader: Option<(Entity, u32)>,
    /// How often it was cleared.
    pub(crate) clear_count: u32,
    /// What is not drawn yet as the selector says.
    pub(crate) deferred: DeferredCuts,
    /// The layers that it draws or whose shadows it shows, as [`layer_bits`].
    pub(crate) layers: u64,
    /// Whether the render world was told that it draws the sources of units.
    pub(crate) lists_sources: bool,
    /// The revisions of the scene and of the cut, and the layers, for which what it draws was counted last.
    pub(crate) counted: Option<[u64; 3]>,
}

/// One bit for each layer; layers that are 64 apart share one.
pub(crate) fn layer_bits(layers: Option<&RenderLayers>) -> u64 {
    let words = layers.unwrap_or_default().bits().iter();
    words.fold(0, |bits, word| bits | word)
}

/// What a view draws of meshes with levels of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ViewState {
    /// Nothing: the camera is not active, or has no pixel to draw.
    #[default]
    Inactive,
    /// The source meshes.
    FullDetail,
    /// Its cut.
    Cut,
}

/// A bit for each draw record, by its number: of a unit, whether it is in the cut of one view; of a whole mesh,
/// whether it is too small for that; of the source of units, whether it is drawn in their place.
#[derive(Default)]
pub(crate) struct CutVisibility {
    is_visible: Vec<bool>,
    /// Records that came or went since this was last asked for.
    changed: Vec<u32>,
    /// Counts changes.
    pub(crate) revision: u64,
}

impl CutVisibility {
    pub(crate) fn contains(&self, record: u32) -> bool {
        self.is_visible.get(record as usize) == Some(&true)
    }

    pub(crate) fn set(&mut self, record: u32, is_visible: bool) {
        self.revision += 1;
        self.changed.push(record);
        let record = record as usize;
        if self.is_visible.len() <= record {
            self.is_visible.resize(record + 1, false);
        }
        self.is_visible[record] = is_visible;
    }

    /// Removes records that are out of use.
    pub(crate) fn remove(&mut self, records: &[u32]) {
        for &record in records {
            if let Some(is_visible) = self.is_visible.get_mut(record as usize) {
                *is_visible = false;
            }
        }
    }

    /// Removes all records and returns them.
    pub(crate) fn take(&mut self) -> Vec<u32> {
        let records = std::mem::take(&mut self.is_visible).into_iter().enumerate();
        let records =
            records.filter_map(|(record, is_visible)| is_visible.then_some(record as u32));
        let records: Vec<u32> = records.collect();
        self.revision += 1;
        self.changed.extend(&records);
        records
    }

    /// Records that came or went since this was last called.
    pub(crate) fn take_changed(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.changed)
    }
}
