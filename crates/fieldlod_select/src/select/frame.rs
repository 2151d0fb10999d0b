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
    /// Weights of errors and deviations.
    pub(super) units: ErrorUnits,
    pub(super) test: KeepTest,
}

impl<'a> Frame<'a> {
    pub(crate) fn new(scene: &'a Scene, input: &'a Input, last: Option<Input>) -> Self {
        let (view, settings) = (&input.view, &input.settings);
        Self {
            scene,
            view,
            settings,
            input,
            last,
            units: ErrorUnits::new(&view.camera, settings),
            test: KeepTest::new(view, settings),
        }
    }

    /// Whether instances have weights.
    pub(crate) fn is_weighed(&self) -> bool {
        self.input.weights_revision.is_some()
    }

    /// Whether instances may keep their states. If layers or forced level have changed, or weights are now used or no
    /// longer used, each instance is decided again.
    pub(super) fn keeps_states(&self) -> bool {
        let of = |input: &Input| {
            // These change what is drawn within the same limits.
            let is_weighed = input.weights_revision.is_some();
            let forced_level = input.settings.forced_level;
            (input.view.layers, forced_level, is_weighed)
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
    /// [`Weights::revision`](crate::Weights::revision); `None` without weights.
    weights_revision: Option<u64>,
}

impl Input {
    pub(crate) fn new(
        scene: &Scene,
        view: &View,
        settings: &LodSettings,
        weights_revision: Option<u64>,
    ) -> Self {
        Self {
            view: *view,
            settings: *settings,
            revision: scene.revision,
            weights_revision,
        }
    }

    /// The same input with other settings.
    pub(crate) fn with(&self, settings: &LodSettings) -> Self {
        Self {
            settings: *settings,
            ..*self
        }
    }
}
