//! Options of the debug view.

use bevy::prelude::*;

/// Options of [`FieldLodDebugPlugin`](crate::FieldLodDebugPlugin).
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Clone, Default, PartialEq)]
pub struct FieldLodDebug {
    /// Paints each level of detail in its own colour.
    pub color_levels: bool,
    /// Paints a quantity of the camera-sampling field. It overrides [`color_levels`](Self::color_levels).
    pub heat_map: Option<FieldLodHeatMap>,
    /// Freezes the cuts of all cameras, so that a moving camera can show them from other sides.
    pub freeze: bool,
    /// Draws a box around each drawn unit and whole mesh, as gizmos of the group
    /// [`FieldLodGizmos`](crate::FieldLodGizmos).
    pub bounds: bool,
    /// Shows the statistics of all cameras as text.
    pub overlay: bool,
}

/// A quantity of the camera-sampling field (Lin and Lee, 2004), painted from blue (small) over green to red (large).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Reflect)]
#[reflect(Clone, PartialEq)]
pub enum FieldLodHeatMap {
    /// Logarithm of the samples per surface area: `c·n` (eq. 16).
    SamplingDensity,
    /// Stretch of the sampling pattern, 1 − cos φ (§3.4): red where the pattern is stretched.
    AspectRatio,
    /// Logarithm of the relative change of the field per length, `|curl c| / c` (eq. 12).
    Curl,
    /// The error of the drawn level, in pixels: green at half a pixel, red at one pixel and above.
    PixelError,
}
