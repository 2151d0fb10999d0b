//! Weights of instances: how much the errors of each count in a view.

use crate::scene::InstanceId;

/// Weights of the screen-space errors of instances in one view, for
/// [`Selector::select_weighed`](crate::Selector::select_weighed). `fieldlod_flux` weighs instances by how much of each is
/// visible.
pub trait Weights {
    /// Another number than before, if some weights may have changed although the view, the scene and the settings have
    /// not. Weights from another source need other numbers, or [`Selector::clear`](crate::Selector::clear).
    fn revision(&self) -> u64;

    /// The weight of an instance, from 0 to 1: its screen-space errors count that many times, its displacements in full.
    /// `is_refined` tells whether it was last drawn finer than at its coarsest level. NaN counts as 1.
    ///
    /// Selection calls it for instances that may be drawn finer than at their coarsest level, and once more for each
    /// threshold that the search for a triangle budget tries.
    fn weight(&mut self, instance: InstanceId, is_refined: bool) -> f32;
}

/// All errors count in full.
pub(crate) struct NoWeights;

impl Weights for NoWeights {
    fn revision(&self) -> u64 {
        0
    }

    fn weight(&mut self, _: InstanceId, _: bool) -> f32 {
        1.0
    }
}
