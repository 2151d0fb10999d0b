//! Selects the cut of each view.

pub(crate) mod shadow_lights;
pub(crate) mod views;
