//! The depth image of a view, and the visible shares of instances.

use crate::hidden::OcclusionBuffer;
use crate::hidden::shares::FULL_SHARE;
use crate::scene::table::GroupTable;
use crate::scene::{Instance, Scene};
use crate::settings::VisibleFlux;
use crate::view::View;

use super::held_shares::SeenShares;

/// The depth image of a view, as long as it is up to date.
#[derive(Debug, Default)]
pub(crate) struct VisibleShares {
    pub(crate) buffer: Option<OcclusionBuffer>,
    drawn_of: Option<(View, u64, u32)>,
    /// Shares of the groups of one instance.
    groups: Vec<u8>,
}

impl VisibleShares {
    /// Draws the depth image if it is of another view or scene.
    pub(crate) fn draw(&mut self, scene: &Scene, view: &View, flux: &VisibleFlux) {
        let triangles = flux.occluder_triangles;
        let key = Some((*view, scene.revision, triangles));
        // A view of NaN equals none.
        if self.drawn_of == key {
            return;
        }
        self.drawn_of = key;
        let buffer = self
            .buffer
            .get_or_insert_with(|| OcclusionBuffer::empty(view));
        buffer.redraw(scene, view, triangles);
    }

    /// The visible shares of an instance.
    pub(crate) fn seen(
        &mut self,
        table: &GroupTable,
        index: u32,
        instance: &Instance,
    ) -> SeenShares<'_> {
        let Some(buffer) = &self.buffer else {
            return SeenShares::OfAll(FULL_SHARE);
        };
        if let Some(share) = buffer.share_of_all(table, index, instance) {
            return SeenShares::OfAll(share);
        }
        buffer.group_shares(table, index, instance, &mut self.groups);
        SeenShares::OfGroups(&self.groups)
    }

    /// Removes the image.
    pub(crate) fn clear(&mut self) {
        self.drawn_of = None;
    }
}
