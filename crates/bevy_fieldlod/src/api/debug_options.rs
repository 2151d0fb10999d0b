//! Options of the debug view.

use bevy::prelude::*;

/// Shows what the selection does. All but `freeze` need `FieldLodDebugPlugin`, of the feature `debug`.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Clone, Default, PartialEq)]
pub struct FieldLodDebug {
    /// Paints each level of detail in its own colour.
    pub color_levels: bool,
    /// Paints a quantity of the camera-sampling field on the surfaces instead.
    pub heat_map: Option<FieldLodHeatMap>,
    /// Selects as if every camera stayed where it is, so that one can fly off and look at its cut.
    pub freeze: bool,
    /// Draws a box around each unit and whole mesh drawn, as gizmos of the group `FieldLodGizmos`.
    pub bounds: bool,
    /// Writes the numbers of all cameras over the picture.
    pub overlay: bool,
    /// Shows what one of the cameras with [`visible_flux`](crate::FieldLodSettings::visible_flux) takes to hide
    /// other things, in the lower left corner: the nearer, the brighter.
    pub depth_image: bool,
}

/// A quantity of the camera-sampling field, from blue (little) over green to red (much).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Reflect)]
#[reflect(Clone, PartialEq)]
pub enum FieldLodHeatMap {
    /// Samples per unit of surface area: `c·n` (eq. 16), by its logarithm.
    SamplingDensity,
    /// Aspect ratio of the sampling pattern, cos φ (§3.4): red where it is stretched.
    AspectRatio,
    /// Relative change of the field across a unit of length, `|curl c| / c` (eq. 12), by its
    /// logarithm.
    Curl,
    /// The error of what is drawn, in pixels: green at half a pixel, red from one on.
    PixelError,
    /// The share of an object that nothing hides from one of the cameras with
    /// [`visible_flux`](crate::FieldLodSettings::visible_flux): blue where it is hidden, red where it is
    /// seen as a whole, or no camera asks for it.
    VisibleShare,
    /// By how many pixels what is drawn in place of pieces that are not in memory errs: blue where nothing is
    /// missing, red from eight pixels on.
    Missing,
}
