//! What a depth image tells of instances that are at their coarsest.

use crate::occlusion::OcclusionBuffer;
use crate::scene::Scene;
use crate::settings::LodSettings;
use crate::shares::{Shares, share_of_step};

/// A depth image, and how much what it hides counts. Its answers are valid as long as the image.
#[derive(Clone, Copy)]
pub(super) struct HiddenTest<'a> {
    pub(super) buffer: &'a OcclusionBuffer,
    pub(super) least_share: f32,
}

impl<'a> HiddenTest<'a> {
    /// `None` where hidden things count in full.
    pub(super) fn new(buffer: Option<&'a OcclusionBuffer>, settings: &LodSettings) -> Option<Self> {
        let least_share = settings.visible_flux?.least_share;
        buffer.map(|buffer| Self {
            buffer,
            least_share,
        })
    }

    /// What a share in steps counts.
    pub(super) fn counted(&self, share: u8) -> f32 {
        share_of_step(share, self.least_share)
    }

    /// What counts of an instance as a whole; where it is so large in the image that its groups would be
    /// asked for, all of it.
    pub(super) fn shares(&self, scene: &Scene, index: usize) -> Shares<'static> {
        let Some(mesh) = scene.entries[index].mesh else {
            return Shares::FULL;
        };
        let instance = &scene.instances[index];
        let share = self
            .buffer
            .share_of_all(scene.table(mesh), index as u32, instance);
        share.map_or(Shares::FULL, |share| {
            Shares::of_all(share, self.least_share)
        })
    }
}
