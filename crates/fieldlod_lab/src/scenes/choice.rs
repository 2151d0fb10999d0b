//! How much each method lets hidden things count, and the cuts that it draws.

use std::time::{Duration, Instant};

use fieldlod_select::{
    Cut, InstanceView, LodSettings, OcclusionBuffer, Selector, VisibleFlux, select_with,
    visible_error_px,
};
use serde::{Deserialize, Serialize};

use super::frame::Frame;
use super::world::World;
use crate::oracle::UnitsOfAll;

/// What a method knows of what hides what.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Visibility {
    /// Nothing: all things count as if they were seen.
    Unknown,
    /// Shares by the occlusion buffer; hidden things count so much at least.
    Buffer {
        /// [`VisibleFlux::least_share`].
        least_share: f32,
    },
    /// Which things the occlusion buffer takes for wholly hidden.
    HiddenInBuffer,
    /// Shares by the picture of full detail.
    Picture,
    /// Which things the picture of full detail does not show.
    HiddenInPicture,
    /// The error that each level makes in the picture: a limit.
    Oracle,
}

impl Visibility {
    /// What tables call it.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Unknown => "without".to_owned(),
            Self::Buffer { least_share } if least_share == VisibleFlux::default().least_share => {
                "visible flux".to_owned()
            }
            Self::Buffer { least_share } => format!("visible flux, hidden counts {least_share}"),
            Self::HiddenInBuffer => "hidden alone, by the buffer".to_owned(),
            Self::Picture => "share known from the picture".to_owned(),
            Self::HiddenInPicture => "hidden alone, known from the picture".to_owned(),
            Self::Oracle => "oracle".to_owned(),
        }
    }

    /// The cuts at a threshold in pixels, or of the oracle in squared levels of error per triangle, chosen from
    /// scratch.
    pub(super) fn choose(self, world: &World, frame: &Frame, threshold: f32) -> UnitsOfAll {
        match self {
            Self::Unknown => by_selector(world, frame, &frame.settings(threshold, None)).0,
            Self::Buffer { least_share } => {
                let settings = frame.settings(threshold, Some(least_share));
                by_selector(world, frame, &settings).0
            }
            Self::HiddenInBuffer => {
                let triangles = VisibleFlux::default().occluder_triangles;
                let buffer = OcclusionBuffer::new(&world.scene, &frame.eye.view(), triangles);
                let shares = |index: usize| buffer.visible_shares(&world.scene, world.ids[index]);
                by_shares(frame, threshold, |index| hidden_alone(&shares(index)))
            }
            Self::Picture => by_shares(frame, threshold, |index| {
                frame.limits().shares_in_picture[index].clone()
            }),
            Self::HiddenInPicture => by_shares(frame, threshold, |index| {
                hidden_alone(&frame.limits().shares_in_picture[index])
            }),
            Self::Oracle => frame.limits().oracle.choose(&frame.views, threshold),
        }
    }
}

/// The cuts of the selection itself, and the time that it took.
pub(super) fn by_selector(
    world: &World,
    frame: &Frame,
    settings: &LodSettings,
) -> (UnitsOfAll, Duration) {
    let mut selector = Selector::default();
    for eye in frame.approach {
        selector.select(&world.scene, &eye.view(), settings);
    }
    let start = Instant::now();
    selector.select(&world.scene, &frame.eye.view(), settings);
    let elapsed = start.elapsed();
    let units = |&id| selector.units(&world.scene, id).to_vec();
    (world.ids.iter().map(units).collect(), elapsed)
}

/// The cuts by the criterion, with given shares of each instance's groups.
fn by_shares(
    frame: &Frame,
    threshold_px: f32,
    shares_of: impl Fn(usize) -> Vec<f32>,
) -> UnitsOfAll {
    let settings = frame.settings(threshold_px, None);
    let view = frame.eye.view().with_margins(&settings);
    let mut cut = Cut::default();
    let mut choose = |(index, it): (usize, &crate::object_view::ObjectView)| {
        let instance = InstanceView::new(&view, &it.instance.world_from_local);
        let (hierarchy, shares) = (&it.object.hierarchy, shares_of(index));
        cut.clear();
        select_with(hierarchy, &settings, &mut cut, |group| {
            let share = shares[group];
            visible_error_px(&hierarchy.groups[group], &instance, &settings, false, share)
        });
        cut.units().to_vec()
    };
    frame.views.iter().enumerate().map(&mut choose).collect()
}

/// Full for all that is not wholly hidden, or seems so.
fn hidden_alone(shares: &[f32]) -> Vec<f32> {
    let is_seen = |&share: &f32| f32::from(share > f32::MIN_POSITIVE);
    shares.iter().map(is_seen).collect()
}
