//! The cut of one view.

use bevy::camera::visibility::RenderLayers;
use bevy::prelude::*;

use fieldlod_select::{LodSettings, Scene, Selector, View};

/// The cut of one camera through the whole scene.
#[derive(Component, Default)]
pub(crate) struct ViewCut {
    pub(crate) selector: Selector,
    /// An opt-in feature that weighs errors; `None` if all count in full.
    pub(crate) weigher: Option<Weigher>,
    pub(crate) visibility: CutVisibility,
    /// The view of the last selection.
    pub(crate) view: Option<View>,
    /// The inputs of this frame's selection; `None` if the view selects nothing.
    pub(crate) wanted: Option<(View, LodSettings)>,
    pub(crate) state: ViewState,
    /// How many units and whole meshes the cut consists of.
    pub(crate) unit_count: u32,
    /// Layers that the view draws or whose shadows it shows, as [`layer_bits`].
    pub(crate) layers: u64,
    /// Whether the render world lists the sources of units for this view.
    pub(crate) lists_sources: bool,
}

/// Selects with weights of instances.
pub(crate) type Weigher = Box<dyn FnMut(&mut Selector, &Scene, &View, &LodSettings) + Send + Sync>;

/// One bit per layer. Layers that are 64 apart share a bit.
pub(crate) fn layer_bits(layers: Option<&RenderLayers>) -> u64 {
    let words = layers.unwrap_or_default().bits().iter();
    words.fold(0, |bits, word| bits | word)
}

/// How a view draws meshes with levels of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ViewState {
    /// It draws nothing: the camera is inactive or has no pixels.
    #[default]
    Inactive,
    /// It draws the source meshes.
    FullDetail,
    /// It draws its cut.
    Cut,
}

/// A bit for each draw record of a unit: whether the unit is in the cut of the view.
#[derive(Default)]
pub(crate) struct CutVisibility {
    is_visible: Vec<bool>,
    /// Records whose bit changed since the last call of [`CutVisibility::take_changed`].
    changed: Vec<u32>,
}

impl CutVisibility {
    pub(crate) fn contains(&self, record: u32) -> bool {
        self.is_visible.get(record as usize) == Some(&true)
    }

    pub(crate) fn set(&mut self, record: u32, is_visible: bool) {
        self.changed.push(record);
        let record = record as usize;
        if self.is_visible.len() <= record {
            self.is_visible.resize(record + 1, false);
        }
        self.is_visible[record] = is_visible;
    }

    /// Clears the bits of freed records.
    pub(crate) fn remove(&mut self, records: &[u32]) {
        for &record in records {
            if let Some(is_visible) = self.is_visible.get_mut(record as usize) {
                *is_visible = false;
            }
        }
    }

    /// Clears all bits and returns the records that were set.
    pub(crate) fn take(&mut self) -> Vec<u32> {
        let records = std::mem::take(&mut self.is_visible).into_iter().enumerate();
        let records =
            records.filter_map(|(record, is_visible)| is_visible.then_some(record as u32));
        let records: Vec<u32> = records.collect();
        self.changed.extend(&records);
        records
    }

    /// Returns the records whose bit changed since the last call.
    pub(crate) fn take_changed(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.changed)
    }
}
