//! The methods to choose a level of detail that are compared: ours, ours without one of its terms, and
//! those of other systems.
//!
//! The rules of others are written on our hierarchies, so that only the criterion differs; charts run
//! clusterlod on its own hierarchy as well, as the whole system that it is:
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
//! - A baseline's hysteresis runs at its own default, which is none for all of them.
//! - Where a rule says nothing (orthographic views, mostly), the natural extension is taken.
//!
//! [`ErrorSource::Measured`]: crate::object::ErrorSource::Measured
//! [`ErrorSource::Reported`]: crate::object::ErrorSource::Reported
//! [`LodObject`]: crate::object::LodObject

use fieldlod_select::{LodSettings, VisibleFlux};
use serde::{Deserialize, Serialize};

use crate::baselines::{group_wise, whole_object};
use crate::object_view::ObjectView;
use crate::terms::Terms;

/// A method to choose a level of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Ours, with the threshold on quality.
    #[default]
    Quality,
    /// Ours, with the threshold that no displacement exceeds.
    Guaranteed,
    /// Ours: quality, and no displacement over twice the threshold.
    Both,
    /// Quality by the share of a group that nothing hides, from the occlusion buffer: where one object is drawn,
    /// what it hides of itself.
    VisibleFlux,
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
    /// The guarantee without the stretch off the axis.
    GuaranteedNoOffAxis,
    /// The guarantee without bounds over spheres: the field at the centre.
    GuaranteedNoBound,
    /// meshoptimizer's clusterlod: nested spheres, distance to the sphere. Charts run it on the
    /// hierarchy that it builds itself.
    Clusterlod,
    /// The same rule on our hierarchy, where charts tell the two apart.
    ClusterlodOnOurLevels,
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
    /// Knows the picture that each group's simplification gives: a limit, which only charts can draw.
    Oracle,
}

impl Method {
    /// A short name for tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Quality => "quality",
            Self::Guaranteed => "guaranteed",
            Self::Both => "both",
            Self::VisibleFlux => "visible flux",
            Self::NoProjection => "no projection factor",
            Self::NoOffAxis => "no off-axis stretch",
            Self::NoBound => "no bound over spheres",
            Self::NoSilhouette => "no silhouette term",
            Self::TwoSided => "two-sided",
            Self::ShareInView => "share in view",
            Self::GuaranteedNoOffAxis => "guaranteed, on axis",
            Self::GuaranteedNoBound => "guaranteed, unbounded",
            Self::Clusterlod => "clusterlod",
            Self::ClusterlodOnOurLevels => "clusterlod, our levels",
            Self::ClusterlodTight => "tight",
            Self::ClusterlodUnclosed => "unclosed",
            Self::Nanite => "Nanite",
            Self::Depth => "depth",
            Self::Meshlets => "meshlets",
            Self::Cesium => "Cesium",
            Self::Godot40 => "Godot 4.0",
            Self::Godot43 => "Godot 4.3",
            Self::Unity => "Unity",
            Self::VisibilityRange => "VisibilityRange",
            Self::ThreeLod => "three.js",
            Self::ProjectedSize => "projected size",
            Self::Oracle => "oracle",
        }
    }

    /// The name in charts, which says whose our own methods are.
    #[must_use]
    pub fn label(self) -> String {
        match self {
            Self::Quality | Self::Guaranteed | Self::Both => format!("fieldlod {}", self.name()),
            _ => self.name().to_owned(),
        }
    }

    /// Whether charts run the method on the hierarchy that its own system builds, and not on ours.
    #[must_use]
    pub fn has_own_levels(self) -> bool {
        self == Self::Clusterlod
    }

    /// Whether it is clusterlod's rule, on whichever hierarchy.
    pub(crate) fn is_clusterlods_rule(self) -> bool {
        matches!(self, Self::Clusterlod | Self::ClusterlodOnOurLevels)
    }

    /// The settings at a threshold of a method that the selection itself can be told to be.
    #[must_use]
    pub fn settings(self, threshold_px: f32) -> Option<LodSettings> {
        Some(match self {
            Self::Quality => LodSettings::with_error_px(threshold_px),
            Self::VisibleFlux => LodSettings {
                visible_flux: Some(VisibleFlux::default()),
                ..LodSettings::with_error_px(threshold_px)
            },
            Self::Guaranteed => LodSettings::guaranteed(threshold_px),
            Self::Both => LodSettings::capped(threshold_px, 2.0 * threshold_px),
            Self::NoBound => LodSettings {
                max_curl: f32::INFINITY,
                ..LodSettings::with_error_px(threshold_px)
            },
            _ => return None,
        })
    }

    /// The terms of our criterion that a method is made of, if it is.
    #[must_use]
    pub fn terms(self) -> Option<Terms> {
        let quality = Terms::default();
        let guarantee = Terms {
            displacement: true,
            ..quality
        };
        Some(match self {
            Self::Quality => quality,
            Self::Guaranteed => guarantee,
            Self::GuaranteedNoOffAxis => guarantee.on_axis(),
            Self::GuaranteedNoBound => guarantee.unbounded(),
            Self::NoOffAxis => quality.on_axis(),
            Self::NoBound => quality.unbounded(),
            Self::NoProjection => Terms {
                projection_factor: false,
                ..quality
            },
            Self::NoSilhouette => Terms {
                silhouette_weight: 0.0,
                ..quality
            },
            Self::TwoSided => Terms {
                two_sided: true,
                ..quality
            },
            Self::ShareInView => Terms {
                share_in_view: true,
                ..quality
            },
            _ => return None,
        })
    }

    /// The screen-space error of a group, in pixels, by plain code.
    ///
    /// `None` for methods that choose one level for the whole object or by unit, for those of several
    /// thresholds and for the oracle.
    #[must_use]
    pub fn group_error_px(self, view: &ObjectView, group: usize) -> Option<f32> {
        if let Some(terms) = self.terms() {
            return Some(terms.error_px(view, group));
        }
        let nested_bounds = &view.object.nested_bounds[group];
        let bounds = &view.object.hierarchy.groups[group].bounds;
        Some(match self {
            Self::Clusterlod | Self::ClusterlodOnOurLevels => {
                group_wise::clusterlod(view, group, nested_bounds)
            }
            Self::ClusterlodTight => group_wise::clusterlod(view, group, bounds),
            Self::Nanite => group_wise::nanite(view, group),
            Self::Depth => group_wise::depth(view, group),
            Self::Meshlets => group_wise::meshlets(view, group),
            Self::Cesium => group_wise::cesium(view, group),
            _ => return None,
        })
    }

    /// The level that a method chooses for the whole object at `threshold_px`; 0 is the source.
    ///
    /// `None` for methods that choose by group.
    #[must_use]
    pub fn object_level(self, view: &ObjectView, threshold_px: f32) -> Option<u32> {
        let level = match self {
            Self::Godot40 => whole_object::godot_4_0,
            Self::Godot43 => whole_object::godot_4_3,
            Self::Unity => whole_object::unity,
            Self::VisibilityRange => whole_object::visibility_range,
            Self::ThreeLod => whole_object::three_lod,
            Self::ProjectedSize => whole_object::projected_size,
            _ => return None,
        };
        Some(level(view, threshold_px))
    }
}
