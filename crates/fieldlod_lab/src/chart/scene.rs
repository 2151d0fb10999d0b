//! A model before the renderer, ready for all methods.

use glam::{UVec2, Vec2};

use super::fast_selection::FastSelection;
use super::pose::Pose;
use crate::eye::{Eye, Instance};
use crate::method::Method;
use crate::object::LodObject;
use crate::object_view::ObjectView;
use crate::render::{DrawnModel, Renderer};

/// A model at the origin, before the renderer, ready for all methods.
#[derive(Debug)]
pub(super) struct ChartScene<'a> {
    pub(super) renderer: &'a Renderer,
    pub(super) size_px: Vec2,
    pub(super) instance: Instance,
    /// The levels that all methods choose from but those that have their own.
    pub(super) ours: SceneLevels<'a>,
    clusterlods: SceneLevels<'a>,
}

/// The levels of a model, on the adapter and laid out for a choice.
#[derive(Debug)]
pub(super) struct SceneLevels<'a> {
    pub(super) object: &'a LodObject,
    pub(super) model: DrawnModel,
    pub(super) fast_selection: FastSelection,
}

impl<'a> SceneLevels<'a> {
    fn new(renderer: &Renderer, object: &'a LodObject, instance: &Instance) -> Self {
        Self {
            object,
            model: renderer.upload(&object.hierarchy),
            fast_selection: FastSelection::new(object, instance),
        }
    }
}

impl<'a> ChartScene<'a> {
    /// Brings a mesh, with our levels and with clusterlod's, to the adapter, for pictures of `size_px`.
    pub(super) fn new(
        renderer: &'a Renderer,
        ours: &'a LodObject,
        clusterlods: &'a LodObject,
        size_px: UVec2,
    ) -> Self {
        let instance = Instance::default();
        Self {
            renderer,
            size_px: size_px.as_vec2(),
            ours: SceneLevels::new(renderer, ours, &instance),
            clusterlods: SceneLevels::new(renderer, clusterlods, &instance),
            instance,
        }
    }

    /// The levels that a method chooses from.
    pub(super) fn levels(&self, method: Method) -> &SceneLevels<'a> {
        if method.has_own_levels() {
            &self.clusterlods
        } else {
            &self.ours
        }
    }

    pub(super) fn eye(&self, pose: &Pose) -> Eye {
        pose.eye(self.ours.object, self.size_px)
    }

    /// What a method sees of the model.
    pub(super) fn view(&self, method: Method, eye: &Eye) -> ObjectView<'a> {
        ObjectView::new(self.levels(method).object, &self.instance, eye)
    }
}
