//! The cut of a whole scene in one view, from frame to frame.

use crate::scene::{InstanceId, Scene};
use crate::select::budget::BudgetSearch;
use crate::select::changes::Change;
use crate::select::cuts::{SceneCuts, Statistics};
use crate::select::frame::{Frame, Input};
use crate::select::weights::{NoWeights, Weights};
use crate::settings::LodSettings;
use crate::view::View;

/// Selects the cut of every instance of a scene in one view. It keeps the previous cuts for the hysteresis and the list
/// of changes.
///
/// If the scene, the view, the settings or weights have changed since the previous frame, one pass tests all instances, eight at
/// a time. Most are outside the view, or within the limits of their level, and keep their cuts. The criterion decides
/// the levels and groups of the other instances. The cuts are the same as if every group of every instance were
/// decided.
///
/// Without changes a frame returns at once.
///
/// ```
/// # use camera_field::Camera;
/// # use fieldlod_hierarchy::fixtures;
/// # use fieldlod_select::{LodSettings, Scene, Selector, View};
/// # use glam::{Affine3A, Mat4, Vec2, Vec3};
/// let mut scene = Scene::default();
/// let strip = scene.add_mesh(&fixtures::two_level_strip());
/// let near = scene.add_instance(strip, Affine3A::IDENTITY, 1.0);
/// let far = scene.add_instance(strip, Affine3A::from_translation(Vec3::Z * -500.0), 1.0);
/// scene.update();
///
/// let projection = Mat4::perspective_infinite_reverse_rh(1.0, 16.0 / 9.0, 0.1);
/// let camera = Camera::from_projection(&projection, Vec2::new(1920.0, 1080.0)).unwrap();
/// let view = View::new(camera, &Affine3A::from_translation(Vec3::new(1.0, 0.5, 5.0)));
/// let mut selector = Selector::default();
/// selector.select(&scene, &view, &LodSettings::default());
/// assert_eq!(selector.units(&scene, near), [0]);
/// assert_eq!(selector.units(&scene, far), [1]);
/// assert_eq!(selector.triangle_count(), 4 + 2);
/// ```
#[derive(Debug, Default)]
pub struct Selector {
    pub(crate) last: Option<Input>,
    pub(crate) cuts: SceneCuts,
    budget: BudgetSearch,
    /// Input of the last selection, before the budget changed its settings.
    last_given: Option<Input>,
}

impl Selector {
    /// Selects the cut of every instance in `view`.
    ///
    /// # Panics
    /// If the scene was changed without [`Scene::update`].
    pub fn select(&mut self, scene: &Scene, view: &View, settings: &LodSettings) {
        self.select_frame(scene, view, settings, &mut NoWeights, None);
    }

    /// [`Selector::select`] with a weight for the screen-space errors of each instance, for example by how much of it is
    /// visible. A [forced level](LodSettings::forced_level) ignores weights.
    ///
    /// # Panics
    /// If the scene was changed without [`Scene::update`].
    pub fn select_weighed(
        &mut self,
        scene: &Scene,
        view: &View,
        settings: &LodSettings,
        weights: &mut impl Weights,
    ) {
        let is_free = settings.forced_level.is_none();
        let revision = is_free.then(|| weights.revision());
        self.select_frame(scene, view, settings, weights, revision);
    }

    fn select_frame(
        &mut self,
        scene: &Scene,
        view: &View,
        settings: &LodSettings,
        weights: &mut impl Weights,
        weights_revision: Option<u64>,
    ) {
        assert!(scene.is_up_to_date(), "Scene::update was not called");
        self.cuts.begin();
        let settings = &settings.in_effect();
        let given = Input::new(
            scene,
            &view.with_margins(settings),
            settings,
            weights_revision,
        );
        let has_changed = self.last_given.replace(given) != Some(given);
        self.budget.begin(has_changed);
        self.select_once(scene, given.with(&self.budget.settings(settings)), weights);
        // A search tries other thresholds until the triangles fit the budget.
        while let Some(settings) = self.budget.next(settings, self.cuts.triangle_count) {
            self.cuts.statistics.budget_tries += 1;
            self.select_once(scene, given.with(&settings), weights);
        }
    }

    /// One selection. Its changes are added to the changes of other selections of the frame.
    fn select_once(&mut self, scene: &Scene, input: Input, weights: &mut impl Weights) {
        // A view of NaN does not equal itself.
        if self.last == Some(input) {
            return;
        }
        let last = self.last.replace(input);
        let frame = Frame::new(scene, &input, last);
        // The limits of instances after changes of the scene or the settings.
        self.cuts.update_limits(&frame);
        // One pass over all instances, which decides the instances outside their limits and records changes.
        self.cuts.decide_near(&frame, weights);
    }

    /// The units of `instance` to draw: indices into its hierarchy's `units`, ascending. `scene` must be
    /// the one that was selected from.
    #[must_use]
    pub fn units<'a>(&'a self, scene: &'a Scene, instance: InstanceId) -> &'a [u32] {
        self.cuts.units(scene, instance)
    }

    /// Instances whose cut changed in the last selection, each with its units ascending.
    ///
    /// The order of the instances depends only on the scene and the views so far. It is not the order of their ids,
    /// which would need a sort of all instances in the first frame. If another instance has taken over an index, the
    /// units that left the old instance come first. With a triangle budget, an instance may come more than once: apply
    /// the changes in order.
    pub fn changes(&self) -> impl Iterator<Item = Change<'_>> {
        self.cuts.changes()
    }

    /// Triangles of all selected units, before culling.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.cuts.triangle_count
    }

    /// Counters of the last selection.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.cuts.statistics
    }

    /// The [threshold](LodSettings::threshold_px) of the last selection; with a triangle budget, the threshold that
    /// fits the budget. `None` before the first selection.
    #[must_use]
    pub fn threshold_px(&self) -> Option<f32> {
        self.last.map(|frame| frame.settings.threshold_px())
    }

    /// Removes the previous cuts, as after a teleport: the next selection depends on its input alone.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}
