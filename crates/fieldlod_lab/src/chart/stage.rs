//! A model before the renderer.

use glam::{UVec2, Vec2};

use super::Pose;
use super::chooser::Prepared;
use crate::render::{DrawnModel, Renderer};
use crate::rivals::{Eye, Instance, LodObject, Seen};

/// A model before the renderer.
#[derive(Debug)]
pub struct Stage<'a> {
    pub(super) renderer: &'a Renderer,
    pub(super) model: DrawnModel,
    pub(super) object: &'a LodObject,
    pub(super) size_px: Vec2,
    pub(super) instance: Instance,
    pub(super) prepared: Prepared,
}

impl<'a> Stage<'a> {
    /// Brings an object to the adapter, for pictures of `size_px`.
    #[must_use]
    pub fn new(renderer: &'a Renderer, object: &'a LodObject, size_px: UVec2) -> Self {
        let instance = Instance::default();
        Self {
            renderer,
            model: renderer.upload(&object.hierarchy),
            object,
            size_px: size_px.as_vec2(),
            prepared: Prepared::new(object, &instance),
            instance,
        }
    }

    pub(super) fn eye(&self, pose: &Pose) -> Eye {
        pose.eye(self.object, self.size_px)
    }

    pub(super) fn seen(&self, eye: &Eye) -> Seen<'a> {
        Seen::new(self.object, &self.instance, eye)
    }

    /// The source's units.
    pub(super) fn source_units(&self) -> Vec<u32> {
        let units = self.object.hierarchy.units.iter().zip(0..);
        let source = units.filter(|(unit, _)| unit.producer().is_none());
        source.map(|(_, index)| index).collect()
    }
}

/// Those of `units` that touch the view, and their triangles.
pub(super) fn in_view(seen: &Seen, units: &[u32]) -> (Vec<u32>, u64) {
    let all = &seen.object.hierarchy.units;
    let touches = |unit: &&u32| seen.touches_box(&all[**unit as usize].aabb);
    let drawn: Vec<u32> = units.iter().filter(touches).copied().collect();
    let triangles = drawn
        .iter()
        .map(|&unit| u64::from(all[unit as usize].triangle_count));
    let triangles = triangles.sum();
    (drawn, triangles)
}
