//! What a view sees of instances: its depth image, and the shares that this leaves visible.

use crate::occlusion::OcclusionBuffer;
use crate::scene::{Instance, Scene};
use crate::settings::{LodSettings, VisibleFlux};
use crate::shares::FULL_SHARE;
use crate::table::GroupTable;
use crate::view::View;

use super::share_memory::SeenShares;

/// The depth image of a view, as long as it is up to date.
#[derive(Debug, Default)]
pub(super) struct VisibleShares {
    pub(super) buffer: Option<OcclusionBuffer>,
    drawn_of: Option<(View, u64, u32, Option<f32>)>,
    /// Shares of the groups of one instance.
    groups: Vec<u8>,
}

impl VisibleShares {
    /// Draws the depth image if it is of another view or scene. Whether it was drawn.
    pub(super) fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        settings: &LodSettings,
        flux: &VisibleFlux,
    ) -> bool {
        let (triangles, displacement_px) = (flux.occluder_triangles, settings.certainty_px());
        let key = Some((*view, scene.revision, triangles, displacement_px));
        // A view of NaN equals none.
        if self.drawn_of == key {
            return false;
        }
        self.drawn_of = key;
        let buffer = self
            .buffer
            .get_or_insert_with(|| OcclusionBuffer::empty(view));
        buffer.redraw(scene, view, triangles, displacement_px);
        true
    }

    /// What is seen of an instance; `of_all` if that was asked before.
    pub(super) fn seen(
        &mut self,
        table: &GroupTable,
        index: u32,
        instance: &Instance,
        of_all: Option<u8>,
    ) -> SeenShares<'_> {
        let Some(buffer) = &self.buffer else {
            return SeenShares::OfAll(FULL_SHARE);
        };
        if let Some(share) = of_all.or_else(|| buffer.share_of_all(table, index, instance)) {
            return SeenShares::OfAll(share);
        }
        buffer.group_shares(table, index, instance, &mut self.groups);
        SeenShares::OfGroups(&self.groups)
    }

    /// Forgets the image. Whether there was one.
    pub(super) fn clear(&mut self) -> bool {
        self.drawn_of.take().is_some()
    }
}
