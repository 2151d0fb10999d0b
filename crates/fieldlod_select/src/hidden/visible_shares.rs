//! The depth image of a view, and the visible shares of instances.

use crate::hidden::OcclusionBuffer;
use crate::hidden::shares::{FULL_SHARE, Shares};
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

    /// What counts of an instance as a whole; all of what is so large in the image that its groups would be looked at.
    pub(crate) fn shares_of_whole(
        &self,
        table: &GroupTable,
        index: u32,
        instance: &Instance,
        flux: &VisibleFlux,
    ) -> Shares<'static> {
        let buffer = self.buffer.as_ref();
        let share = buffer.and_then(|buffer| buffer.share_of_all(table, index, instance));
        Shares::of_all(share.unwrap_or(FULL_SHARE), flux.least_share)
    }

    /// Removes the image.
    pub(crate) fn clear(&mut self) {
        self.drawn_of = None;
    }
}
