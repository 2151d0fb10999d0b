//! The cut of a whole scene in one view, from frame to frame.

mod changes;
mod memory;
mod pool;
mod slot;
#[cfg(test)]
mod tests;
mod visit;
mod word_holds;

use crate::decide::ViewParts;
use crate::hold::{Hold, Odometer, WholeTest};
use crate::scene::Scene;
use crate::{InstanceId, LodSettings, View, budget};
pub use changes::Change;
use changes::Changes;
use memory::{Frame, Memory, Moment, NodeMemory, Pending, State, coarsest_of};
use pool::Pool;
use visit::Context;

/// Selects, for one view, the cut of every instance of a scene, and remembers it: for the
/// hysteresis, for what changed, and for how long each answer holds.
///
/// A frame visits the nodes of a tree over the instances whose answer may have changed since they
/// were last visited: by the way the camera has gone and turned, or because an instance did. A node
/// that is wholly outside the view or far enough is answered at once; what remains is decided group
/// by group. In perspective views of instances whose placement is a similarity, groups are decided
/// again only when the camera has gone as far as their decisions can bear. The cuts are those that
/// deciding every group anew would give. With nothing changed a frame costs nothing; once its
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
    odometer: Odometer,
    last: Option<Frame>,
    memories: Vec<Memory>,
    /// For how long each instance, tested by itself, stays as it is.
    holds: Vec<Hold>,
    nodes: Vec<Vec<NodeMemory>>,
    pending: Vec<Pending>,
    pool: Pool,
    changes: Changes,
    triangle_count: u64,
    statistics: Statistics,
    budget: budget::Search,
}

/// What the last selection did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Nodes of the tree whose answer had to be looked at again.
    pub nodes_visited: usize,
    /// Instances tested as a whole.
    pub instances_tested: usize,
    /// Instances decided group by group.
    pub instances_decided: usize,
    /// Their groups.
    pub groups_decided: usize,
}

impl Selector {
    /// Selects the cut of every instance in `view`.
    ///
    /// # Panics
    /// If the scene was changed without [`Scene::update`].
    pub fn select(&mut self, scene: &Scene, view: &View, settings: &LodSettings) {
        assert!(scene.is_up_to_date(), "Scene::update was not called");
        self.changes.clear();
        self.statistics = Statistics::default();
        let view = view.with_margins(settings);
        let Some(budget) = settings.triangle_budget else {
            return self.step(scene, &view, settings);
        };
        let settings = self.budget.settings(settings);
        self.step(scene, &view, &settings);
        if !budget::is_met(budget, self.triangle_count) {
            self.budget.begin();
            for (index, memory) in self.memories.iter().enumerate() {
                let refined = memory.state.slot().map(|slot| self.pool.at(slot).refined());
                self.budget.add(scene, index, refined, &view, &settings);
            }
            let settings = self.budget.finish(budget, &settings);
            self.step(scene, &view, &settings);
        }
    }

    /// One selection with plain settings; changes add up.
    fn step(&mut self, scene: &Scene, view: &View, settings: &LodSettings) {
        let frame = Frame {
            view: *view,
            settings: *settings,
            revision: scene.revision,
            tree_revision: scene.tree_revision,
        };
        // A view of NaN equals none.
        if self.last == Some(frame) {
            return;
        }
        let is_first = self.last.is_none();
        let seen_revision = self.last.map_or(0, |last| last.revision);
        let step = self.take_over(scene, &frame);
        let context = Context {
            scene,
            test: WholeTest::new(view, settings, self.odometer),
            now: self.odometer,
            seen_revision,
            is_first,
        };
        if !scene.tree.order.is_empty() {
            self.visit(&context, scene.tree.levels.len() - 1, 0);
        }
        let moment = Moment {
            view,
            parts: &ViewParts::new(&view.camera, &view.kept_camera, settings),
            settings,
            test: &context.test,
            now: self.odometer,
            step,
        };
        for pending in &mut self.pending {
            pending.decide(scene, &moment);
        }
        self.merge(scene);
        if is_first {
            self.settle_rest(scene);
        }
    }

    /// Makes room for the scene and drops what does not hold any more. Returns how far the view has gone.
    fn take_over(&mut self, scene: &Scene, frame: &Frame) -> Odometer {
        self.memories
            .resize(scene.instances.len(), Memory::default());
        self.holds.resize(scene.instances.len(), Hold::NONE);
        let last = self.last.replace(*frame);
        let same_criterion = last.is_some_and(|last| {
            last.settings == frame.settings && last.view.camera() == frame.view.camera()
        });
        let step = last.map(|last| Odometer::between(&last.view, &frame.view));
        let step = step.unwrap_or_default();
        self.odometer.advance(&step);
        if !(same_criterion && self.odometer.is_usable()) {
            self.odometer.set_back();
        }
        if last.is_none_or(|last| last.tree_revision != frame.tree_revision) {
            self.nodes.iter_mut().for_each(Vec::clear);
            self.drop_removed(scene);
        }
        let levels = &scene.tree.levels;
        self.nodes
            .resize_with(levels.len().max(self.nodes.len()), Vec::new);
        for (memories, nodes) in self.nodes.iter_mut().zip(levels) {
            memories.resize(nodes.len(), NodeMemory::new(last.is_none()));
        }
        step
    }

    /// A new tree does not lead to instances that were removed.
    fn drop_removed(&mut self, scene: &Scene) {
        for (index, occupant) in (0..).zip(&scene.occupants) {
            let is_drawn = self.memories[index as usize].state != State::Empty;
            if occupant.mesh.is_none() && is_drawn {
                self.change_state(scene, index, State::Empty);
            }
        }
    }

    /// Puts what was decided in place.
    fn merge(&mut self, scene: &Scene) {
        let mut pending = std::mem::take(&mut self.pending);
        for Pending {
            instance,
            was,
            slot,
            ..
        } in pending.drain(..)
        {
            self.statistics.instances_decided += 1;
            self.statistics.groups_decided += slot.groups_decided();
            self.holds[instance as usize] = slot.hold();
            let (before, before_triangles) = match was {
                State::Mixed(_) => (slot.units_before(), slot.triangles_before()),
                other => coarsest_of(scene, other),
            };
            if !matches!(was, State::Mixed(_)) || slot.has_changed() {
                let id = scene.instance_at(instance);
                self.changes.record(id, before, slot.units());
                self.triangle_count =
                    self.triangle_count + slot.triangle_count() - before_triangles;
            }
            if let State::Mixed(place) = was {
                self.pool.put_back(place, slot);
            } else {
                let state = State::Mixed(self.pool.place(slot));
                self.memories[instance as usize].state = state;
            }
        }
        self.pending = pending;
    }

    /// The units of `instance` to draw: indices into its hierarchy's `units`, ascending. `scene` must be
    /// the one that was selected from.
    #[must_use]
    pub fn units<'a>(&'a self, scene: &'a Scene, instance: InstanceId) -> &'a [u32] {
        let Some(memory) = self.memories.get(instance.index()) else {
            return &[];
        };
        match memory.state {
            _ if memory.generation != instance.generation => &[],
            State::Mixed(slot) => self.pool.at(slot).units(),
            other => coarsest_of(scene, other).0,
        }
    }

    /// Instances whose cut changed in the last selection, each with its units ascending.
    ///
    /// The order of the instances follows from the scene and the views so far alone. It is not that of
    /// their ids, which would take a sort of everything in the first frame: sort by
    /// [`Change::instance`] where that matters. Where an
    /// index has gone from one instance to another, what left of the first comes before what
    /// entered of the second. With a triangle budget an instance may come twice: apply the changes
    /// one after the other.
    pub fn changes(&self) -> impl Iterator<Item = Change<'_>> {
        self.changes.iter()
    }

    /// Triangles in the view.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.triangle_count
    }

    /// What the last selection did.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// The [threshold](LodSettings::threshold_px) in use: that which meets the triangle budget, if
    /// there is one. `None` before the first selection.
    #[must_use]
    pub fn threshold_px(&self) -> Option<f32> {
        self.last.map(|frame| frame.settings.threshold_px())
    }

    /// Forgets the last cuts, as after a teleport: the next selection depends on its input alone.
    pub fn clear(&mut self) {
        self.last = None;
        self.odometer.set_back();
        self.memories.clear();
        self.nodes.iter_mut().for_each(Vec::clear);
        self.pool.clear();
        self.changes.clear();
        self.triangle_count = 0;
        self.budget = budget::Search::default();
    }
}
