//! What cuts are decided with in one frame.

use crate::object_test::ObjectTest;
use crate::validity::CameraTravel;
use crate::view::View;
use crate::view_parts::ViewParts;

/// What cuts are decided with.
#[derive(Clone, Copy)]
pub(super) struct DecideContext<'a> {
    pub(super) view: &'a View,
    pub(super) parts: &'a ViewParts<'a>,
    pub(super) test: &'a ObjectTest<'a>,
    pub(super) now: CameraTravel,
    /// The camera's travel since the last frame.
    pub(super) last_step: CameraTravel,
}
