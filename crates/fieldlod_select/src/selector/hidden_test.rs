//! What a depth image tells of instances that are at their coarsest.

use crate::occlusion::OcclusionBuffer;
use crate::scene::{MeshId, Scene};
use crate::settings::LodSettings;
use crate::shares::{Shares, share_of_step};

/// A depth image, and how much what it hides counts. Its answers are valid as long as the image.
#[derive(Clone, Copy)]
pub(super) struct HiddenTest<'a> {
    pub(super) buffer: &'a OcclusionBuffer,
    pub(super) least_share: f32,
    pub(super) hold_frames: u8,
}

impl<'a> HiddenTest<'a> {
    /// `None` where hidden things count in full.
    pub(super) fn new(buffer: Option<&'a OcclusionBuffer>, settings: &LodSettings) -> Option<Self> {
        let flux = settings.visible_flux?;
        buffer.map(|buffer| Self {
            buffer,
            least_share: flux.least_share,
            hold_frames: flux.hold_frames,
        })
    }

    /// What a share in steps counts.
    pub(super) fn counted(&self, share: u8) -> f32 {
        share_of_step(share, self.least_share)
    }

    /// What is visible of an instance of a mesh, in steps, where that is the same of all of it.
    /// It is asked for sooner if it is as hidden as is likely.
    pub(super) fn share_of_whole(
        &self,
        scene: &Scene,
        mesh: MeshId,
        instance: u32,
        is_likely_hidden: bool,
    ) -> Option<u8> {
        let (table, placed) = (scene.table(mesh), &scene.instances[instance as usize]);
        self.buffer
            .share_of_all_likely(table, instance, placed, is_likely_hidden)
    }

    /// What counts of an instance as a whole; where it is so large in the image that its groups would be
    /// asked for, all of it.
    pub(super) fn shares(&self, scene: &Scene, index: usize) -> Shares<'static> {
        let Some(mesh) = scene.entries[index].mesh else {
            return Shares::FULL;
        };
        let share = self.share_of_whole(scene, mesh, index as u32, true);
        share.map_or(Shares::FULL, |share| {
            Shares::of_all(share, self.least_share)
        })
    }
}
