//! The ways to choose a level of detail that charts compare.

use std::time::{Duration, Instant};

use fieldlod_select::{Cut, LodSettings, select_with};
use serde::{Deserialize, Serialize};

use super::Terms;
use crate::rivals::{Chooser, Method, Seen};

/// A way to choose a level of detail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// Ours: the promise of quality.
    Quality,
    /// Ours: no displacement exceeds the threshold.
    Guaranteed,
    /// Ours: quality, and no displacement over twice the threshold.
    Both,
    /// Quality without the projection factor: surfaces count alike from all sides.
    NoProjection,
    /// Quality without the stretch off the axis.
    NoOffAxis,
    /// Quality without bounds over spheres: the field at the centre.
    NoBound,
    /// Quality without the silhouette's term.
    NoSilhouette,
    /// Quality that takes all surfaces for two-sided.
    TwoSided,
    /// Quality by the share of a group that is in view.
    ShareInView,
    /// meshoptimizer's clusterlod: what others are compared with.
    Clusterlod,
    /// Unreal's Nanite.
    Nanite,
    /// Depth along the axis.
    Depth,
    /// Cesium's 3D Tiles.
    Cesium,
    /// Godot 4.3: whole objects.
    Godot,
    /// Unity 6.2's Mesh LOD: whole objects.
    Unity,
    /// Bevy's `VisibilityRange`: whole objects.
    VisibilityRange,
    /// Whole objects by their size in the picture.
    ProjectedSize,
    /// Knows the picture that each group's simplification gives: a limit.
    Oracle,
    /// Guaranteed without the stretch off the axis. Not in [`Way::ALL`]: only its displacements and
    /// costs are of interest.
    GuaranteedNoOffAxis,
    /// Guaranteed without bounds over spheres: the field at the centre. Likewise.
    GuaranteedNoBound,
}

impl Way {
    /// The ways whose pictures are compared.
    pub const ALL: [Self; 18] = [
        Self::Quality,
        Self::Guaranteed,
        Self::Both,
        Self::NoProjection,
        Self::NoOffAxis,
        Self::NoBound,
        Self::NoSilhouette,
        Self::TwoSided,
        Self::ShareInView,
        Self::Clusterlod,
        Self::Nanite,
        Self::Depth,
        Self::Cesium,
        Self::Godot,
        Self::Unity,
        Self::VisibilityRange,
        Self::ProjectedSize,
        Self::Oracle,
    ];

    /// A short name for charts and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Quality => "fieldlod quality",
            Self::Guaranteed => "fieldlod guaranteed",
            Self::Both => "fieldlod both",
            Self::NoProjection => "no projection factor",
            Self::NoOffAxis => "no off-axis stretch",
            Self::NoBound => "no bound over spheres",
            Self::NoSilhouette => "no silhouette term",
            Self::TwoSided => "two-sided",
            Self::ShareInView => "share in view",
            Self::Clusterlod => "clusterlod",
            Self::Nanite => "Nanite",
            Self::Depth => "depth",
            Self::Cesium => "Cesium",
            Self::Godot => "Godot",
            Self::Unity => "Unity",
            Self::VisibilityRange => "VisibilityRange",
            Self::ProjectedSize => "projected size",
            Self::Oracle => "oracle",
            Self::GuaranteedNoOffAxis => "guaranteed, on axis",
            Self::GuaranteedNoBound => "guaranteed, unbounded",
        }
    }

    /// What it leaves out of our criterion, if it is made of that.
    pub(super) fn terms(self) -> Option<Terms> {
        let all = Terms::default();
        let displacement = Terms {
            displacement: true,
            ..all
        };
        Some(match self {
            Self::Quality => all,
            Self::Guaranteed => displacement,
            Self::GuaranteedNoOffAxis => Terms {
                off_axis: false,
                ..displacement
            },
            Self::GuaranteedNoBound => Terms {
                bounded: false,
                ..displacement
            },
            Self::NoProjection => Terms {
                projection_factor: false,
                ..all
            },
            Self::NoOffAxis => Terms {
                off_axis: false,
                ..all
            },
            Self::NoBound => Terms {
                bounded: false,
                ..all
            },
            Self::NoSilhouette => Terms {
                silhouette_weight: 0.0,
                ..all
            },
            Self::TwoSided => Terms {
                two_sided: true,
                ..all
            },
            Self::ShareInView => Terms {
                share_in_view: true,
                ..all
            },
            _ => return None,
        })
    }

    pub(super) fn rival(self) -> Option<Method> {
        Some(match self {
            Self::Clusterlod => Method::Clusterlod,
            Self::Nanite => Method::Nanite,
            Self::Depth => Method::Depth,
            Self::Cesium => Method::Cesium,
            Self::Godot => Method::Godot43,
            Self::Unity => Method::Unity,
            Self::VisibilityRange => Method::VisibilityRange,
            Self::ProjectedSize => Method::ProjectedSize,
            _ => return None,
        })
    }

    /// The settings of a way that the selection itself can take.
    pub(super) fn settings(self, threshold_px: f32) -> Option<LodSettings> {
        Some(match self {
            Self::Quality => LodSettings::with_error_px(threshold_px),
            Self::Guaranteed => LodSettings::guaranteed(threshold_px),
            Self::Both => LodSettings::capped(threshold_px, 2.0 * threshold_px),
            Self::NoBound => LodSettings {
                max_curl: f32::INFINITY,
                ..LodSettings::with_error_px(threshold_px)
            },
            _ => return None,
        })
    }

    /// The units that a way draws at a threshold by plain code, group by group, without memory of
    /// earlier frames, and the time that the choice took.
    ///
    /// # Panics
    /// For the [oracle](Self::Oracle), which needs pictures.
    pub(super) fn choose_plainly(self, seen: &Seen, threshold_px: f32) -> (Vec<u32>, Duration) {
        let start = Instant::now();
        if let Some(terms) = self.terms() {
            let mut cut = Cut::default();
            let settings = LodSettings::with_error_px(threshold_px);
            select_with(&seen.object.hierarchy, &settings, &mut cut, |group| {
                terms.error_px(seen, group)
            });
            let elapsed = start.elapsed();
            return (cut.units().to_vec(), elapsed);
        }
        let method = self.rival().expect("the oracle chooses by pictures");
        let choice = Chooser::new(method, threshold_px).choose(seen);
        (choice.units, start.elapsed())
    }
}
