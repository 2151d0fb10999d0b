//! What one view draws.

use bevy::camera::visibility::RenderLayers;
use bevy::prelude::*;

use fieldlod_select::{Selector, View};

use crate::deferred_cuts::DeferredCuts;

/// The cut of one camera through the whole scene.
#[derive(Component, Default)]
pub(crate) struct ViewCut {
    pub(crate) selector: Selector,
    pub(crate) visibility: CutVisibility,
    /// The view that was last selected for.
    pub(crate) view: Option<View>,
    pub(crate) state: ViewState,
    /// The camera whose cut it draws, and how often that was cleared when this began.
    pub(crate) leader: Option<(Entity, u32)>,
    /// How often it was cleared.
    pub(crate) clear_count: u32,
    /// What is not drawn yet as the selector says.
    pub(crate) deferred: DeferredCuts,
    /// The layers that it draws or whose shadows it shows, as [`layer_bits`].
    pub(crate) layers: u64,
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
pub(crate) struct CutVisibility(Vec<bool>);

impl CutVisibility {
    pub(crate) fn contains(&self, record: u32) -> bool {
        self.0.get(record as usize) == Some(&true)
    }

    pub(crate) fn set(&mut self, record: u32, is_visible: bool) {
        let record = record as usize;
        if self.0.len() <= record {
            self.0.resize(record + 1, false);
        }
        self.0[record] = is_visible;
    }

    /// Removes records that are out of use.
    pub(crate) fn remove(&mut self, records: &[u32]) {
        for &record in records {
            if let Some(is_visible) = self.0.get_mut(record as usize) {
                *is_visible = false;
            }
        }
    }

    /// Removes all records and returns them.
    pub(crate) fn take(&mut self) -> impl Iterator<Item = u32> + use<> {
        let records = std::mem::take(&mut self.0).into_iter().enumerate();
        records.filter_map(|(record, is_visible)| is_visible.then_some(record as u32))
    }
}
