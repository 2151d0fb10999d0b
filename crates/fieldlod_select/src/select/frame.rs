//! What one frame selects with.

use super::bounds_test::ViewBounds;
use super::keep_test::KeepTest;
use crate::criterion::limits::ErrorUnits;
use crate::scene::Scene;
use crate::settings::LodSettings;
use crate::view::View;

/// The input of a frame, and the tests that are made of it once.
pub(crate) struct Frame<'a> {
    pub(crate) scene: &'a Scene,
    /// The view with its margins.
    pub(crate) view: &'a View,
    pub(crate) settings: &'a LodSettings,
    /// Nothing is remembered: what is at its coarsest is listed in the end, in one go.
    pub(crate) is_first: bool,
    /// Whether another selection of the same frame has taken notice of what is visible.
    pub(crate) are_shares_known: bool,
    /// How errors count against each other.
    pub(super) units: ErrorUnits,
    pub(super) test: KeepTest,
    pub(super) bounds: ViewBounds,
}

impl<'a> Frame<'a> {
    pub(crate) fn new(
        scene: &'a Scene,
        view: &'a View,
        settings: &'a LodSettings,
        is_first: bool,
        are_shares_known: bool,
    ) -> Self {
        Self {
            scene,
            view,
            settings,
            is_first,
            are_shares_known,
            units: ErrorUnits::new(&view.camera, settings),
            test: KeepTest::new(view, settings),
            bounds: ViewBounds::new(&view.camera, &view.kept_camera, settings),
        }
    }
}

/// All that a cut depends on, but for its memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Input {
    pub(crate) view: View,
    pub(crate) settings: LodSettings,
    revision: u64,
    available_revision: u64,
}

impl Input {
    /// Whether the view, but for its pose, the settings and what is at hand are the same.
    pub(crate) fn differs_by_pose_alone(&self, last: &Self) -> bool {
        let view = View {
            camera_from_world: last.view.camera_from_world,
            eye_in_world: last.view.eye_in_world,
            ..self.view
        };
        let is_same_view = view == last.view && self.settings == last.settings;
        is_same_view && self.available_revision == last.available_revision
    }

    pub(crate) fn new(scene: &Scene, view: &View, settings: &LodSettings) -> Self {
        Self {
            view: *view,
            settings: *settings,
            revision: scene.revision,
            available_revision: scene.available_revision,
        }
    }
}
