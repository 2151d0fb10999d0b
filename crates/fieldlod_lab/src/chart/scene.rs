//! A model before the renderer, ready for all methods.

use glam::{UVec2, Vec2};

use super::fast_selection::FastSelection;
use super::pose::Pose;
use crate::eye::{Eye, Instance};
use crate::object::LodObject;
use crate::object_view::ObjectView;
use crate::render::{DrawnModel, Renderer};

/// A model at the origin, before the renderer, ready for all methods.
#[derive(Debug)]
pub(super) struct ChartScene<'a> {
    pub(super) renderer: &'a Renderer,
    pub(super) model: DrawnModel,
    pub(super) object: &'a LodObject,
    pub(super) size_px: Vec2,
    pub(super) instance: Instance,
    pub(super) fast_selection: FastSelection,
}

impl<'a> ChartScene<'a> {
    /// Brings an object to the adapter, for pictures of `size_px`.
    pub(super) fn new(renderer: &'a Renderer, object: &'a LodObject, size_px: UVec2) -> Self {
        let instance = Instance::default();
        Self {
            renderer,
            model: renderer.upload(&object.hierarchy),
            object,
            size_px: size_px.as_vec2(),
            fast_selection: FastSelection::new(object, &instance),
            instance,
        }
    }

    pub(super) fn eye(&self, pose: &Pose) -> Eye {
        pose.eye(self.object, self.size_px)
    }

    pub(super) fn view(&self, eye: &Eye) -> ObjectView<'a> {
        ObjectView::new(self.object, &self.instance, eye)
    }
}
