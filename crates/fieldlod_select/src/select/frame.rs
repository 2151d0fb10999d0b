//! The input of a frame, and the tests made from it.

use super::bounds_test::ViewBounds;
use super::limits::keep_test::KeepTest;
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
    /// Nothing was selected before: instances at their coarsest levels are listed at the end of the frame.
    pub(crate) is_first: bool,
    /// Whether another selection of the same frame has updated the visible shares.
    pub(crate) are_shares_known: bool,
    /// Weights of errors and deviations.
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

/// Everything that a cut depends on, except the last cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Input {
    pub(crate) view: View,
    pub(crate) settings: LodSettings,
    revision: u64,
    available_revision: u64,
}

impl Input {
    /// Whether all but the pose and the scene's instances is the same.
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
