//! The ways to choose a level of detail that charts compare.

use std::hint::black_box;
use std::time::{Duration, Instant};

use fieldlod_select::{Cut, LodSettings, select, select_with};
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
}

impl Way {
    /// All ways.
    pub const ALL: [Self; 17] = [
        Self::Quality,
        Self::Guaranteed,
        Self::Both,
        Self::NoProjection,
        Self::NoOffAxis,
        Self::NoBound,
        Self::NoSilhouette,
        Self::TwoSided,
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
            Self::Clusterlod => "clusterlod",
            Self::Nanite => "Nanite",
            Self::Depth => "depth",
            Self::Cesium => "Cesium",
            Self::Godot => "Godot",
            Self::Unity => "Unity",
            Self::VisibilityRange => "VisibilityRange",
            Self::ProjectedSize => "projected size",
            Self::Oracle => "oracle",
        }
    }

    fn terms(self) -> Option<Terms> {
        let all = Terms::default();
        Some(match self {
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
            _ => return None,
        })
    }

    fn rival(self) -> Option<Method> {
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

    fn settings(self, threshold_px: f32) -> LodSettings {
        match self {
            Self::Guaranteed => LodSettings::guaranteed(threshold_px),
            Self::Both => LodSettings::capped(threshold_px, 2.0 * threshold_px),
            _ => LodSettings::with_error_px(threshold_px),
        }
    }

    /// The units that this way draws at a threshold, without memory of earlier frames, and the time
    /// that the choice took.
    ///
    /// # Panics
    /// For the [oracle](Self::Oracle), which needs pictures.
    pub(crate) fn choose(self, seen: &Seen, threshold_px: f32) -> (Vec<u32>, Duration) {
        let hierarchy = &seen.object.hierarchy;
        let settings = self.settings(threshold_px);
        let mut cut = Cut::default();
        let start = Instant::now();
        if let Some(terms) = self.terms() {
            select_with(hierarchy, &settings, &mut cut, |group| {
                terms.error_px(seen, group)
            });
        } else if let Some(method) = self.rival() {
            let choice = Chooser::new(method, threshold_px).choose(seen);
            return (choice.units, start.elapsed());
        } else {
            assert!(self != Self::Oracle, "the oracle chooses by pictures");
            let placement = &seen.instance.world_from_local;
            select(hierarchy, placement, &seen.eye.view(), &settings, &mut cut);
        }
        let elapsed = black_box(start).elapsed();
        (cut.units().to_vec(), elapsed)
    }
}
