//! Baselines that choose one level for the whole object; 0 is the source.
//!
//! # Godot 4, automatic mesh LOD
//! ```text
//! coarsest level with   e s bias / (dist mult) ≤ threshold_px / width_px
//!
//! perspective   mult = 2 tan(fovx/2), so that the left is e s / dist in pixels over the width
//! orthographic  mult = half the width of the view
//! ```
//! From 4.3 `dist` is that to the box (godot pull request 92290), 0 inside, and 1 for orthographic
//! views (57419). As users reported it before:
//!
//! - `dist` to the corner of the box that is nearest along the axis of the view. A turn of the
//!   camera picks another corner (81995, 76436); inside the box that corner is behind or far
//!   (88273, 79590), and an extra cull margin makes the box large (67890);
//! - `dist` for orthographic views too (57404, from the alpha versions);
//! - a scale that bones apply left out (57895, 59147).
//!
//! # Unity 6.2, Mesh LOD
//! ```text
//! level = ⌊ slope · log₂( d C / (2 |extents|) ) + bias ⌋        C = 2 tan(fovy/2)
//! ```
//! `extents` are those of the box along the *world's* axes, so that turning the object changes its
//! level. Slope and bias are the least-squares line through the starts of the tuned ranges. Source:
//! Unity 6.2 manual, "Mesh LOD"; `Mesh.lodSelectionCurve`.
//!
//! # Ranges of distance, written by hand
//! ```text
//! VisibilityRange   level starts at   d        ≥ range of the level
//! three.js LOD                        d / zoom ≥ range (1 − hysteresis if shown in the last frame)
//! ```
//! `d` is the distance to the middle of the object. Neither knows the field of view, the window or
//! the object's scale; three.js did not know the zoom before pull request 18557. Its hysteresis is
//! a fraction, 0 by default (14565), and so it is here. Sources: `bevy_camera::visibility::VisibilityRange`;
//! three.js `src/objects/LOD.js`.
//!
//! # The height of the object in the picture
//! ```text
//! size = 2 R s f / d pixels;   a level starts below the size at which its error is the threshold
//! ```
//! Knows zoom, window and scale; not where in the picture the object is, nor that its near parts are
//! nearer than its middle. Sources: Unreal's `ScreenSize`, Unity's `LODGroup`.

use glam::Vec3;

use crate::object::{LodObject, REFERENCE_FOCAL_PX};
use crate::object_view::ObjectView;

/// Height of the reference view's window, in pixels.
const REFERENCE_HEIGHT_PX: f32 = 1080.0;

/// Godot from 4.3: by the distance to the box.
pub(crate) fn godot_4_3(view: &ObjectView, threshold_px: f32) -> u32 {
    let distance = if view.eye.is_orthographic() {
        1.0
    } else {
        let aabb = view.aabb_relative_to_eye();
        aabb.min.max(-aabb.max).max(Vec3::ZERO).length()
    };
    godot(view, threshold_px, distance, view.max_scale)
}

/// Godot before 4.3: by the distance to the corner nearest along the axis.
pub(crate) fn godot_4_0(view: &ObjectView, threshold_px: f32) -> u32 {
    let aabb = view.aabb_relative_to_eye();
    let corner = Vec3::select(view.forward().cmpgt(Vec3::ZERO), aabb.min, aabb.max);
    let node_scale = view.max_scale / view.instance.bone_scale;
    godot(view, threshold_px, corner.length(), node_scale)
}

fn godot(view: &ObjectView, threshold_px: f32, distance: f32, scale: f32) -> u32 {
    // The `mult` of orthographic views is half a width, that of perspective views a whole one.
    let widths = if view.eye.is_orthographic() { 2.0 } else { 1.0 };
    let focal_px = view.eye.focal_px() * widths;
    let within = |error: &&f32| **error * scale * focal_px / distance <= threshold_px;
    let errors = view.object.level_errors_in_local.iter().skip(1);
    errors.take_while(within).count() as u32
}

/// Bevy's `VisibilityRange`: by distance alone.
pub(crate) fn visibility_range(view: &ObjectView, threshold_px: f32) -> u32 {
    range_at(view, threshold_px, view.distance_to_center())
}

/// three.js `LOD`: by distance over zoom.
pub(crate) fn three_lod(view: &ObjectView, threshold_px: f32) -> u32 {
    range_at(
        view,
        threshold_px,
        view.distance_to_center() / view.eye.zoom,
    )
}

fn range_at(view: &ObjectView, threshold_px: f32, distance: f32) -> u32 {
    let starts = |level: &u32| distance >= view.object.range_start(*level, threshold_px);
    levels(view.object).take_while(starts).count() as u32
}

/// Unreal's and Unity's groups: by the height of the object in the picture.
pub(crate) fn projected_size(view: &ObjectView, threshold_px: f32) -> u32 {
    let diameter = 2.0 * view.object.radius;
    let size_at_unit_px = diameter * view.max_scale * view.eye.focal_px();
    // Each level starts below the size that it has at its range in the reference view.
    let size_px = if view.eye.is_orthographic() {
        size_at_unit_px
    } else {
        size_at_unit_px / view.distance_to_center()
    };
    let starts = |level: &u32| {
        let start = view.object.range_start(*level, threshold_px);
        size_px <= diameter * REFERENCE_FOCAL_PX / start
    };
    levels(view.object).take_while(starts).count() as u32
}

/// Unity's Mesh LOD: by a line over the logarithm of the relative size.
pub(crate) fn unity(view: &ObjectView, threshold_px: f32) -> u32 {
    let (slope, bias) = unity_curve(view.object, threshold_px);
    let aabb = view.aabb_relative_to_eye();
    // How much of the world the window covers at the object, relative to its size.
    let size = (aabb.max - aabb.min).length();
    let height_at_unit = view.eye.height_px() / view.eye.focal_px();
    let covered = if view.eye.is_orthographic() {
        height_at_unit
    } else {
        height_at_unit * view.distance_to_center()
    };
    let level = (slope * (covered / size).log2() + bias).floor();
    // NaN becomes 0.
    (level.max(0.0) as u32).min(view.object.level_count().saturating_sub(1))
}

/// Slope and bias of the least-squares line through the starts of the tuned ranges.
fn unity_curve(object: &LodObject, threshold_px: f32) -> (f32, f32) {
    // Where each level starts, over the logarithm of the size seen.
    let size = (object.aabb.max - object.aabb.min).length();
    let height = REFERENCE_HEIGHT_PX / REFERENCE_FOCAL_PX;
    let point = |level: u32| {
        let covered = object.range_start(level, threshold_px) * height;
        ((covered / size).log2(), level as f32)
    };
    let points: Vec<(f32, f32)> = levels(object).map(point).collect();
    // The line through them.
    let count = points.len().max(1) as f32;
    let mean_x = points.iter().map(|p| p.0).sum::<f32>() / count;
    let mean_y = points.iter().map(|p| p.1).sum::<f32>() / count;
    let variance: f32 = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let covariance: f32 = points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    let slope = if variance > 0.0 {
        covariance / variance
    } else {
        0.0
    };
    (slope, mean_y - slope * mean_x)
}

/// The levels coarser than the source.
fn levels(object: &LodObject) -> std::ops::Range<u32> {
    1..object.level_count()
}
