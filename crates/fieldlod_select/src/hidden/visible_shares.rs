//! The depth image of a view, and the visible shares of instances.

use crate::hidden::OcclusionBuffer;
use crate::hidden::shares::FULL_SHARE;
use crate::scene::table::GroupTable;
use crate::scene::{Instance, InstanceId, Scene};
use crate::settings::{LodSettings, VisibleFlux};
use crate::view::View;

use super::held_shares::SeenShares;

/// The depth image of a view.
#[derive(Debug, Default)]
pub(crate) struct VisibleShares {
    pub(crate) buffer: Option<OcclusionBuffer>,
    drawn_of: Option<(View, u64, u32)>,
    /// Shares of the groups of one instance.
    groups: Vec<u8>,
}

impl VisibleShares {
    /// Draws the depth image if the view or the scene has changed.
    pub(crate) fn draw(&mut self, scene: &Scene, view: &View, flux: &VisibleFlux) {
        let triangles = flux.occluder_triangles;
        let key = Some((*view, scene.revision, triangles));
        // A view of NaN does not equal itself.
        if self.drawn_of == key {
            return;
        }
        self.drawn_of = key;
        let buffer = self
            .buffer
            .get_or_insert_with(|| OcclusionBuffer::empty(view));
        buffer.redraw(scene, view, triangles);
    }

    /// The settings of visible flux and the image; `None` without flux.
    pub(crate) fn of<'a>(
        &'a self,
        settings: &'a LodSettings,
    ) -> Option<(&'a VisibleFlux, &'a OcclusionBuffer)> {
        settings.visible_flux.as_ref().zip(self.buffer.as_ref())
    }

    /// The visible shares of an instance.
    pub(crate) fn seen(
        &mut self,
        table: &GroupTable,
        id: InstanceId,
        instance: &Instance,
    ) -> SeenShares<'_> {
        let of_all = match &self.buffer {
            Some(buffer) => buffer.shares(table, id, instance, &mut self.groups),
            None => Some(FULL_SHARE),
        };
        (of_all, &self.groups)
    }
}
