//! The compared methods of choosing a level of detail.
//!
//! | Method | Rule |
//! |---|---|
//! | [`Method::Quality`], [`Method::Guaranteed`] | this project's selection, [`fieldlod_select`] |
//! | [`Method::Clusterlod`], [`Method::ClusterlodOnOurLevels`] | meshoptimizer, `demo/clusterlod.h`; NVIDIA's `vk_lod_clusters` has the same formula |
//! | [`Method::Godot`] | Godot from 4.3, automatic mesh LOD |
//! | [`Method::VisibilityRange`] | Bevy's `VisibilityRange` |
//!
//! # Fairness of the comparison
//! - The baselines use the same error of every group or level: the measured deviation
//!   ([`ErrorSource::Measured`]), or the error that the simplifier reports ([`ErrorSource::Reported`]).
//!   [`Method::Quality`] always uses the reported error, [`Method::Guaranteed`] the measured deviation.
//! - All methods run at the same threshold, 1 px unless stated otherwise.
//! - Ranges of [`Method::VisibilityRange`] start where the error of a level, at the near side of the object's sphere,
//!   equals the threshold in the *reference view*: 60° high, 1080 px, unit scale ([`LodObject::range_start`]).
//!   The chart scales them to the height of its pictures.
//! - The baselines have no hysteresis: their systems disable it by default.
//! - clusterlod's rule does not define orthographic views. The formula then omits the distance.
//!
//! [`ErrorSource::Measured`]: crate::object::ErrorSource::Measured
//! [`ErrorSource::Reported`]: crate::object::ErrorSource::Reported
//! [`LodObject::range_start`]: crate::object::LodObject::range_start

use fieldlod_select::LodSettings;
use serde::Serialize;

/// A method of choosing a level of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// This project's selection with a threshold of screen-space error.
    #[default]
    Quality,
    /// This project's selection with a threshold that no displacement exceeds.
    Guaranteed,
    /// [`Method::Quality`] with one sample of the field for groups over which it changes by less than 0.3.
    Curl,
    /// [`Method::Quality`] with errors relaxed where the aspect ratio of the sampling pattern is below 0.9.
    AspectRatio,
    /// clusterlod's rule on the hierarchy that clusterlod builds: nested spheres and the distance to the sphere.
    Clusterlod,
    /// clusterlod's rule on this project's hierarchy.
    ClusterlodOnOurLevels,
    /// Godot's rule: one level for the whole object, by the distance to its box.
    Godot,
    /// Bevy's rule: one level for the whole object, by the distance to its center.
    VisibilityRange,
}

impl Method {
    /// All methods, in the order of tables.
    pub const ALL: [Self; 6] = [
        Self::Quality,
        Self::Guaranteed,
        Self::ClusterlodOnOurLevels,
        Self::Clusterlod,
        Self::Godot,
        Self::VisibilityRange,
    ];

    /// The paper's other two thresholds (§4.2.2), which are off by default.
    pub const OF_PAPER: [Self; 2] = [Self::Curl, Self::AspectRatio];

    /// A name for tables and charts.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Quality => "fieldlod quality",
            Self::Guaranteed => "fieldlod guaranteed",
            Self::Curl => "quality, curl",
            Self::AspectRatio => "quality, aspect ratio",
            Self::Clusterlod => "clusterlod",
            Self::ClusterlodOnOurLevels => "clusterlod, our levels",
            Self::Godot => "Godot 4.3",
            Self::VisibilityRange => "VisibilityRange",
        }
    }

    /// Returns `true` if the method runs on the hierarchy that its own system builds.
    #[must_use]
    pub fn has_own_levels(self) -> bool {
        self == Self::Clusterlod
    }

    /// The settings of this project's methods at a threshold; `None` for other methods.
    #[must_use]
    pub fn settings(self, threshold_px: f32) -> Option<LodSettings> {
        let mut settings = LodSettings::with_error_px(threshold_px);
        match self {
            Self::Quality => {}
            Self::Guaranteed => settings = LodSettings::guaranteed(threshold_px),
            Self::Curl => settings.advanced.max_curl = 0.3,
            Self::AspectRatio => settings.advanced.min_aspect_ratio = 0.9,
            _ => return None,
        }
        Some(settings)
    }
}
