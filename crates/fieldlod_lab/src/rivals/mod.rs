//! How others choose a level of detail, written on our hierarchies so that only the criterion
//! differs.
//!
//! | Method | Source of its rule |
//! |---|---|
//! | [`Method::Clusterlod`] | meshoptimizer, `demo/clusterlod.h`; NVIDIA `vk_lod_clusters` has the same distance |
//! | [`Method::ClusterlodTight`] | the same with our tight spheres and a closure pass |
//! | [`Method::ClusterlodUnclosed`] | the same by each unit's own bounds, the mistake that its notes warn of |
//! | [`Method::Nanite`] | Unreal Engine 5, projected edge scales of `NaniteHZBCull` and friends |
//! | [`Method::Depth`] | distance along the axis, as in many engines and papers |
//! | [`Method::Meshlets`] | Bevy, `bevy_pbr::meshlet`, LOD test of its culling shader |
//! | [`Method::Cesium`] | CesiumJS and cesium-native, screen-space error of 3D Tiles |
//! | [`Method::Godot40`] | Godot 4.0 to 4.2 and its alphas, as users reported it |
//! | [`Method::Godot43`] | Godot from 4.3 |
//! | [`Method::Unity`] | Unity 6.2, Mesh LOD selection curve |
//! | [`Method::VisibilityRange`] | Bevy's `VisibilityRange`; three.js `LOD` before r114 |
//! | [`Method::ThreeLod`] | three.js `LOD`, distance over zoom, hysteresis fraction 0 |
//! | [`Method::ProjectedSize`] | whole objects by their height in the picture, as Unreal's and Unity's `LODGroup` |
//!
//! # What is fair
//! - All see the same error of every group or level: the measured deviation
//!   ([`ErrorSource::Measured`]), or what the simplifier reports ([`ErrorSource::Reported`]).
//! - Methods with a threshold in pixels run at the same one, 1 px unless told otherwise.
//! - Methods with ranges or curves are tuned so that each level starts where its error is 1 px on
//!   the axis of the *reference view*: 60° high, 1080 px, unit scale ([`LodObject`]).
//! - A rival's hysteresis runs at its own default, which is none for all of them.
//! - Where a rule says nothing (orthographic views, mostly), the natural extension is taken.

mod cesium;
mod choose;
mod clusterlod;
mod depth;
mod eye;
mod godot;
mod meshlets;
mod nanite;
mod object;
mod projected_size;
mod ranges;
mod scan;
mod seen;
mod unity;

use serde::Serialize;

pub use choose::{Choice, Chooser};
pub use eye::{Eye, Instance};
pub use object::{ErrorSource, LodObject, REFERENCE_FOCAL_PX};
pub use scan::SphereScan;
pub use seen::Seen;

/// A way to choose a level of detail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Ours, with the promise of quality.
    Quality,
    /// Ours, with the promise that no displacement exceeds the threshold.
    Guaranteed,
    /// Nested spheres, distance to the sphere.
    Clusterlod,
    /// Tight spheres and a closure pass, distance to the sphere.
    ClusterlodTight,
    /// Tight bounds of every unit for itself: what shared, nested bounds are there to prevent.
    ClusterlodUnclosed,
    /// Nested spheres with off-axis stretch, least axis of the scale.
    Nanite,
    /// Depth along the axis.
    Depth,
    /// Nested spheres, scale left out of the error.
    Meshlets,
    /// Nested bounding volumes, distance to the volume.
    Cesium,
    /// Whole object: distance to the box's corner nearest along the view axis.
    Godot40,
    /// Whole object: distance to the box.
    Godot43,
    /// Whole object: a line fitted over the logarithm of the relative size.
    Unity,
    /// Whole object: distance alone.
    VisibilityRange,
    /// Whole object: distance over zoom.
    ThreeLod,
    /// Whole object: height in pixels.
    ProjectedSize,
}

impl Method {
    /// All methods, ours first.
    pub const ALL: [Self; 15] = [
        Self::Quality,
        Self::Guaranteed,
        Self::Clusterlod,
        Self::ClusterlodTight,
        Self::ClusterlodUnclosed,
        Self::Nanite,
        Self::Depth,
        Self::Meshlets,
        Self::Cesium,
        Self::Godot40,
        Self::Godot43,
        Self::Unity,
        Self::VisibilityRange,
        Self::ThreeLod,
        Self::ProjectedSize,
    ];

    /// A short name for tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Quality => "quality",
            Self::Guaranteed => "guaranteed",
            Self::Clusterlod => "clusterlod",
            Self::ClusterlodTight => "tight",
            Self::ClusterlodUnclosed => "unclosed",
            Self::Nanite => "nanite",
            Self::Depth => "depth",
            Self::Meshlets => "meshlets",
            Self::Cesium => "cesium",
            Self::Godot40 => "godot4.0",
            Self::Godot43 => "godot4.3",
            Self::Unity => "unity",
            Self::VisibilityRange => "range",
            Self::ThreeLod => "three",
            Self::ProjectedSize => "size",
        }
    }

    /// Whether this is one of our own.
    #[must_use]
    pub fn is_ours(self) -> bool {
        matches!(self, Self::Quality | Self::Guaranteed)
    }

    /// The screen-space error of a group, in pixels, for rivals that choose by group.
    ///
    /// `None` for our own methods, for those that choose one level for the whole object and for
    /// those that choose by unit.
    #[must_use]
    pub fn group_error_px(self, seen: &Seen, group: usize) -> Option<f32> {
        let error_px = match self {
            Self::Clusterlod => {
                clusterlod::error_px(seen, group, &seen.object.nested_bounds[group])
            }
            Self::ClusterlodTight => {
                let bounds = &seen.object.hierarchy.groups[group].bounds;
                clusterlod::error_px(seen, group, bounds)
            }
            Self::Nanite => nanite::error_px(seen, group),
            Self::Depth => depth::error_px(seen, group),
            Self::Meshlets => meshlets::error_px(seen, group),
            Self::Cesium => cesium::error_px(seen, group),
            _ => return None,
        };
        Some(error_px)
    }

    /// The level that a rival chooses for the whole object at `threshold_px`; 0 is the source.
    ///
    /// `last_level` is what it chose in the last frame. `None` for methods that choose by group.
    #[must_use]
    pub fn object_level(
        self,
        seen: &Seen,
        threshold_px: f32,
        last_level: Option<u32>,
    ) -> Option<u32> {
        let level = match self {
            Self::Godot40 => godot::level_4_0(seen, threshold_px),
            Self::Godot43 => godot::level_4_3(seen, threshold_px),
            Self::Unity => unity::level(seen, threshold_px),
            Self::VisibilityRange => ranges::visibility_range(seen, threshold_px),
            Self::ThreeLod => ranges::three_lod(seen, threshold_px, last_level),
            Self::ProjectedSize => projected_size::level(seen, threshold_px),
            _ => return None,
        };
        Some(level)
    }
}
