//! The weights of one view from frame to frame.

use fieldlod_select::{InstanceId, Scene, View, Weights};

use crate::depth_image::DepthImage;
use crate::held_share::{FULL_SHARE, HeldShare};
use crate::occluder::Occluders;

/// Settings of [`VisibleFlux`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluxSettings {
    /// Triangle budget of the depth image; 32 points count as one triangle.
    pub occluder_triangles: u32,
    /// Number of selections in a row with a smaller visible share before an instance is coarsened. A larger share refines
    /// it at once.
    pub hold_frames: u8,
    /// Smallest visible share, from 0 to 1: an instance estimated as hidden may be slightly visible, or cast a shadow into
    /// the view.
    pub least_share: f32,
}

impl Default for FluxSettings {
    /// 16,000 triangles; 45 frames, longer than one step of a walk; a share of at least a hundredth.
    fn default() -> Self {
        Self {
            occluder_triangles: 16_000,
            hold_frames: 45,
            least_share: 0.01,
        }
    }
}

/// The visible shares of instances in one view, from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct VisibleFlux {
    settings: FluxSettings,
    image: Option<DepthImage>,
    /// By index of the instance.
    shares: Vec<ShareInFrame>,
    /// Counts frames from 1.
    frame: u64,
    /// Whether a share is held above what the frame sees. A later frame may lower it even without other changes.
    is_any_held: bool,
    revision: u64,
}

/// The share of an instance, and the frame in which it was updated.
#[derive(Clone, Copy, Debug, Default)]
struct ShareInFrame {
    instance: Option<InstanceId>,
    frame: u64,
    share: HeldShare,
}

impl VisibleFlux {
    /// Visible flux without shares of earlier frames.
    #[must_use]
    pub fn new(settings: FluxSettings) -> Self {
        Self {
            settings,
            ..Self::default()
        }
    }

    /// Begins a frame: draws the depth image, if the view, the scene or the occluders have changed. Each frame must have
    /// the same scene and occluders. Use the weights in one selection, by the selector of the frame before.
    pub fn look<'a>(
        &'a mut self,
        scene: &'a Scene,
        view: &View,
        occluders: &'a Occluders,
    ) -> FluxWeights<'a> {
        let triangles = self.settings.occluder_triangles;
        let is_redrawn = match &mut self.image {
            Some(image) => image.update(scene, view, occluders, triangles),
            image => {
                *image = Some(DepthImage::new(scene, view, occluders, triangles));
                true
            }
        };
        self.revision += u64::from(is_redrawn || self.is_any_held);
        self.is_any_held = false;
        self.frame += 1;
        FluxWeights {
            flux: self,
            scene,
            occluders,
        }
    }

    /// The depth image of the last frame.
    #[must_use]
    pub fn depth_image(&self) -> Option<&DepthImage> {
        self.image.as_ref()
    }
}

/// The weights of one frame.
#[derive(Debug)]
pub struct FluxWeights<'a> {
    flux: &'a mut VisibleFlux,
    scene: &'a Scene,
    occluders: &'a Occluders,
}

impl Weights for FluxWeights<'_> {
    fn revision(&self) -> u64 {
        self.flux.revision
    }

    /// `√o`.
    fn weight(&mut self, instance: InstanceId, is_refined: bool) -> f32 {
        let share = self.held_share(instance, is_refined);
        let share = f32::from(share) / f32::from(FULL_SHARE);
        share.max(self.flux.settings.least_share).min(1.0).sqrt()
    }
}

impl FluxWeights<'_> {
    /// The share of an instance in steps. The tries of a search for a triangle budget get the same share.
    fn held_share(&mut self, instance: InstanceId, is_refined: bool) -> u8 {
        let flux = &mut *self.flux;
        let index = instance.index();
        if flux.shares.len() <= index {
            flux.shares.resize(index + 1, ShareInFrame::default());
        }
        let known = &mut flux.shares[index];
        // An instance that was removed leaves its index to another instance.
        if known.instance != Some(instance) {
            *known = ShareInFrame {
                instance: Some(instance),
                ..ShareInFrame::default()
            };
        }
        if known.frame != flux.frame {
            known.frame = flux.frame;
            let image = flux.image.as_ref();
            let now = image.map(|image| image.share(self.scene, self.occluders, instance));
            let now = now.unwrap_or(FULL_SHARE);
            let hold_frames = flux.settings.hold_frames;
            known.share.update(now, is_refined, hold_frames);
            flux.is_any_held |= known.share.held != now;
        }
        known.share.held
    }
}
