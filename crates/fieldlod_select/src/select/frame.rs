//! The input of a frame, and the tests made from it.

use super::limits::keep_test::KeepTest;
use crate::criterion::limits::ErrorUnits;
use crate::scene::Scene;
use crate::settings::LodSettings;
use crate::view::View;

/// The input of a frame, and the tests that are made from it once.
pub(crate) struct Frame<'a> {
    pub(crate) scene: &'a Scene,
    /// The view with its margins.
    pub(crate) view: &'a View,
    pub(crate) settings: &'a LodSettings,
    pub(super) input: &'a Input,
    /// Input of the last selection; `None` in a first frame.
    pub(super) last: Option<Input>,
    /// Whether another selection of the same frame has updated the visible shares.
    pub(crate) are_shares_known: bool,
    /// Weights of errors and deviations.
    pub(super) units: ErrorUnits,
    pub(super) test: KeepTest,
}

impl<'a> Frame<'a> {
    pub(crate) fn new(
        scene: &'a Scene,
        input: &'a Input,
        last: Option<Input>,
        are_shares_known: bool,
    ) -> Self {
        let (view, settings) = (&input.view, &input.settings);
        Self {
            scene,
            view,
            settings,
            input,
            last,
            are_shares_known,
            units: ErrorUnits::new(&view.camera, settings),
            test: KeepTest::new(view, settings),
        }
    }

    /// Whether instances may keep their states. If layers, forced level or visible flux have changed, each instance
    /// is decided again.
    pub(super) fn keeps_states(&self) -> bool {
        let of = |input: &Input| {
            // These change what is drawn within the same limits.
            let hides = input.settings.visible_flux.is_some();
            let forced_level = input.settings.forced_level;
            (input.view.layers, forced_level, hides)
        };
        let last = self.last.as_ref();
        last.is_none_or(|last| of(last) == of(self.input))
    }

    /// Whether limits in the units of the last selection are valid.
    pub(super) fn keeps_units(&self) -> bool {
        let units = |last: &Input| ErrorUnits::new(&last.view.camera, &last.settings);
        self.last.as_ref().map(units) == Some(self.units)
    }
}

/// Everything that a cut depends on, except the previous cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Input {
    pub(crate) view: View,
    pub(crate) settings: LodSettings,
    revision: u64,
}

impl Input {
    pub(crate) fn new(scene: &Scene, view: &View, settings: &LodSettings) -> Self {
        Self {
            view: *view,
            settings: *settings,
            revision: scene.revision,
        }
    }
}
