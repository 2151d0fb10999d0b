//! The cut of a whole scene in one view, from frame to frame.

mod changes;
mod chunk_validity;
mod decide_context;
mod demand;
mod hidden_test;
mod instance_cut;
mod level_cuts;
mod memory;
mod pool;
mod scene_cuts;
mod share_memory;
#[cfg(test)]
mod tests;
mod traversal;
mod visible_shares;

use crate::budget::BudgetSearch;
use crate::object_test::ObjectTest;
use crate::occlusion::OcclusionBuffer;
use crate::scene::{InstanceId, Scene};
use crate::settings::LodSettings;
use crate::shares::Shares;
use crate::size_test::SizeTest;
use crate::validity::CameraTravel;
use crate::view::View;
use crate::view_parts::ViewParts;
pub use changes::Change;
use decide_context::DecideContext;
pub use demand::GroupDemand;
use hidden_test::HiddenTest;
use instance_cut::InstanceCut;
use scene_cuts::SceneCuts;
pub use scene_cuts::Statistics;
use traversal::TraversalContext;

/// Selects, for one view, the cut of every instance of a scene, and remembers it: for the
/// hysteresis, for what changed, and for how long each answer is valid.
///
/// A frame visits the nodes of a tree over the instances whose answer may have changed since they
/// were last visited: because the camera has moved or turned so far, or because an instance did. A
/// node that is wholly outside the view or far enough is answered at once; what remains is decided
/// group by group; of a mesh that is drawn as a whole, that is one level. Groups are
/// decided again only when the camera has moved, turned or zoomed as far as their decisions tolerate: in an orthographic
/// view moves change nothing but what is in the image. The cuts are those
/// that deciding every group anew would give. Where hidden things count less
/// ([`LodSettings::visible_flux`]), the depth image is drawn anew for each new view and each change of
/// the scene, and what it leaves visible is asked for anew: of nodes that stay at their coarsest because they are
/// hidden, of instances that do, and of what is refined. A node that is not hidden any more leads to what is below. An
/// instance as a whole is decided again if more of it is visible than at its last answer, or if less is held; of what is
/// decided group by group, those are in chunks where what counts has changed.
/// With nothing changed a frame costs nothing; once its
/// storage has grown to the scene, none allocates.
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
    travel: CameraTravel,
    last: Option<Frame>,
    cuts: SceneCuts,
    budget: BudgetSearch,
    /// The frame that a threshold was last sought for, and how often.
    sought: Option<(Frame, u32)>,
    /// Whether this selection has taken notice of what is visible.
    has_seen: bool,
}

/// Searches for the threshold of a budget in one and the same frame: each changes what the hysteresis
/// remembers, and so what the next one finds.
const MOST_SEARCHES: u32 = 3;

/// All that a cut depends on, but for its memory.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    view: View,
    settings: LodSettings,
    revision: u64,
    tree_revision: u64,
}

impl Frame {
    fn new(scene: &Scene, view: &View, settings: &LodSettings) -> Self {
        Self {
            view: *view,
            settings: *settings,
            revision: scene.revision,
            tree_revision: scene.tree_revision,
        }
    }
}

impl Selector {
    /// Selects the cut of every instance in `view`.
    ///
    /// # Panics
    /// If the scene was changed without [`Scene::update`].
    pub fn select(&mut self, scene: &Scene, view: &View, settings: &LodSettings) {
        assert!(scene.is_up_to_date(), "Scene::update was not called");
        self.cuts.begin();
        self.has_seen = false;
        let wide_view = view.with_margins(settings);
        let budget = settings
            .triangle_budget
            .filter(|_| settings.forced_level.is_none());
        let Some(budget) = budget else {
            return self.select_with_thresholds(scene, &wide_view, settings);
        };
        // The threshold that kept to the budget last; if it does not any more, another.
        let last_settings = self.budget.settings(settings);
        self.select_with_thresholds(scene, &wide_view, &last_settings);
        let frame = Frame::new(scene, view, settings);
        let searches = match self.sought {
            Some((sought, searches)) if sought == frame => searches,
            _ => 0,
        };
        let is_due = self.budget.is_due(budget, self.cuts.triangle_count);
        if is_due && searches < MOST_SEARCHES {
            self.sought = Some((frame, searches + 1));
            self.search(scene, &wide_view, settings, budget);
        }
    }

    /// Seeks the threshold that keeps to a budget, and selects with it.
    fn search(&mut self, scene: &Scene, view: &View, settings: &LodSettings, budget: u64) {
        self.cuts.statistics.budget_searches += 1;
        self.budget.begin();
        let hidden = HiddenTest::new(self.cuts.visible.buffer.as_ref(), settings);
        let mut forced_triangles = 0;
        for index in 0..scene.instances.len() {
            if self.cuts.is_culled(index) {
                continue;
            }
            let cut = self.cuts.cut(index);
            // Those of forced levels are drawn at any threshold.
            if scene.instances[index].forced_level.is_some() {
                forced_triangles += cut.map_or(0, |cut| cut.drawn().1);
                continue;
            }
            let refined = cut.map(InstanceCut::refined);
            let refined = refined.or_else(|| self.cuts.refined_at_level(index));
            let steps = self.cuts.level_steps(index);
            let shares = match (cut, &steps, hidden) {
                (Some(cut), ..) => cut.shares().shares(settings),
                (None, Some(steps), Some(hidden)) => Shares::new(steps, hidden.least_share),
                (None, _, hidden) => {
                    hidden.map_or(Shares::FULL, |hidden| hidden.shares(scene, index))
                }
            };
            self.budget
                .add(scene, index, refined, shares, view, settings);
        }
        let budget_left = budget.saturating_sub(forced_triangles);
        let settings = self.budget.finish(budget_left, settings);
        self.select_with_thresholds(scene, view, &settings);
        self.budget.note_found(budget, self.cuts.triangle_count);
    }

    /// One selection without a budget; changes add up.
    fn select_with_thresholds(&mut self, scene: &Scene, view: &View, settings: &LodSettings) {
        let frame = Frame::new(scene, view, settings);
        self.cuts.update_available(scene);
        // A view of NaN equals none.
        let is_awake = !self.has_seen && self.cuts.has_unsettled_shares;
        if self.last == Some(frame) && !is_awake {
            return;
        }
        // What stays valid of the last frame.
        let last = self.last.replace(frame);
        let is_first = last.is_none();
        let last_step = self.travel(last.as_ref(), &frame);
        let is_new_tree = last.is_none_or(|last| last.tree_revision != frame.tree_revision);
        self.cuts.resize(scene, is_first, is_new_tree);
        let are_shares_known = std::mem::replace(&mut self.has_seen, true);
        if !are_shares_known {
            self.cuts.update_shares(scene, view, settings);
        }
        // Whole nodes and instances, as far as those can be told.
        let parts = ViewParts::new(&view.camera, &view.kept_camera, settings);
        let visible = std::mem::take(&mut self.cuts.visible);
        let test = ObjectTest::new(view, &parts, self.travel);
        let context = TraversalContext {
            scene,
            layers: view.layers,
            test: &test,
            size: SizeTest::new(view, settings, self.travel, test.is_usable()),
            forced_level: settings.forced_level,
            now: self.travel,
            // On other layers, every answer may be another one.
            seen_revision: last
                .filter(|last| last.view.layers == view.layers)
                .map_or(0, |last| last.revision),
            is_first,
            hidden: HiddenTest::new(visible.buffer.as_ref(), settings),
            are_shares_known,
            view,
            parts: &parts,
            last_step,
        };
        self.cuts.traverse(&context);
        // What remains, group by group.
        self.cuts.visible = visible;
        let context = DecideContext {
            view,
            parts: &parts,
            test: &test,
            now: self.travel,
            last_step,
        };
        self.cuts.decide_pending(scene, &context);
        if is_first {
            self.cuts.emit_coarsest(scene, view.layers);
        }
    }

    /// Adds the way from the last frame to the camera's travel, and returns it.
    fn travel(&mut self, last: Option<&Frame>, frame: &Frame) -> CameraTravel {
        let step = last.map(|last| CameraTravel::between(&last.view, &frame.view));
        let is_comparable = !matches!(step, Some(None));
        let step = step.flatten().unwrap_or_default();
        self.travel.add(&step);
        let lights = last.and_then(|last| CameraTravel::of_lights(&last.view, &frame.view));
        if let Some(lights) = &lights {
            self.travel.add(lights);
        }
        let is_same_criterion = last.is_some_and(|last| last.settings == frame.settings);
        if is_same_criterion && is_comparable && lights.is_some() && self.travel.is_finite() {
            self.travel.go_on();
        } else {
            self.travel.reset();
        }
        step
    }

    /// The units of `instance` to draw: indices into its hierarchy's `units`, ascending. `scene` must be
    /// the one that was selected from.
    #[must_use]
    pub fn units<'a>(&'a self, scene: &'a Scene, instance: InstanceId) -> &'a [u32] {
        self.cuts.units(scene, instance)
    }

    /// Instances whose cut changed in the last selection, each with its units ascending.
    ///
    /// The order of the instances follows from the scene and the views so far alone. It is not that of
    /// their ids, which would take a sort of everything in the first frame: sort by
    /// [`Change::instance`] where that matters. Where an
    /// index has gone from one instance to another, what left of the first comes before what
    /// entered of the second. With a triangle budget, or where other groups
    /// [are at hand](Scene::set_available) than before, an instance may come twice: apply the changes one
    /// after the other.
    pub fn changes(&self) -> impl Iterator<Item = Change<'_>> {
        self.cuts.changes.iter()
    }

    /// Triangles in the view.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.cuts.triangle_count
    }

    /// What the last selection did.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.cuts.statistics
    }

    /// The [threshold](LodSettings::threshold_px) in use: that which keeps to the triangle budget, if
    /// there is one. `None` before the first selection.
    #[must_use]
    pub fn threshold_px(&self) -> Option<f32> {
        self.last.map(|frame| frame.settings.threshold_px())
    }

    /// The depth image that the last selection asked; `None` if nothing counted as hidden.
    #[must_use]
    pub fn occlusion(&self) -> Option<&OcclusionBuffer> {
        let flux = self.last.and_then(|frame| frame.settings.visible_flux);
        self.cuts.visible.buffer.as_ref().filter(|_| flux.is_some())
    }

    /// Forgets the last cuts, as after a teleport: the next selection depends on its input alone.
    pub fn clear(&mut self) {
        self.last = None;
        // There is no validity left that another camera's travel could end.
        self.travel = CameraTravel::default();
        self.cuts.clear();
        self.budget = BudgetSearch::default();
        self.sought = None;
    }
}
