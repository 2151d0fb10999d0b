//! Baselines that choose group by group: the screen-space error of a group in pixels, by each system's
//! rule.
//!
//! ```text
//! e  the group's error    s  greatest scale    f  focal length, px    d  distance to the sphere's centre
//! r  the sphere's radius  z  depth of its centre along the axis       near  distance of the near plane
//!
//! clusterlod   e s f / max(d − r, near)
//! depth        e s f / max(z − r, near)
//! meshlets     e f / max(d − r, near)                     the scale is not on e
//! Nanite       e s_min f / (max(z − r, near) cos_min)     s_min  least scale, cos_min  see below
//! Cesium       e s f / max(d − r, 1e-7)                   of tiles in view or under the camera
//! ```
//! Orthographic views have no distance: `e s f`, with `f` in pixels per unit.
//!
//! - **clusterlod** (meshoptimizer `demo/clusterlod.h`, `boundsError`; nvpro-samples `vk_lod_clusters`):
//!   turns of the camera change nothing, so it cannot know the stretch off the axis, up to 1/cos²φ.
//!   The scale is NVIDIA's; clusterlod itself works in local space.
//! - **depth**: right for displacements along the picture's tangent, short by 1/cos φ of those along
//!   its radius.
//! - **meshlets** (`bevy_pbr`, `meshlet/cull_clusters.wgsl`, `lod_error_is_imperceptible`): its
//!   threshold is fixed at 1 px.
//! - **Nanite** (Unreal Engine 5, `NaniteCullingCommon.ush`, `GetProjectedEdgeScales` and
//!   `ShouldVisitChild`): the one that knows the stretch off the axis. `cos_min` is the least cosine
//!   off the axis over the sphere, in the plane of the axis and its centre; where the sphere crosses
//!   the near plane, that of its widest point there. What is outside the view is culled first: 0.
//! - **Cesium** (CesiumJS `Cesium3DTile`, cesium-native `ViewState::computeScreenSpaceError`): a tile's
//!   volume holds its children's, so the nested spheres stand for it. Tiles out of view are not refined:
//!   0, but for those under the camera (cesium-native's `renderTilesUnderCamera`, on by default), with
//!   +Y for up. Its default threshold is 16 px; here it runs at everyone's.

use fieldlod_hierarchy::Sphere;
use glam::Vec3;

use crate::object_view::ObjectView;

/// `bounds` are the group's nested sphere, or what clusterlod's variants take instead.
pub(crate) fn clusterlod(view: &ObjectView, group: usize, bounds: &Sphere) -> f32 {
    let distance = view.distance_to(bounds).max(view.eye.near);
    error_px(view, group, view.max_scale, distance)
}

pub(crate) fn depth(view: &ObjectView, group: usize) -> f32 {
    let bounds = &view.object.nested_bounds[group];
    let depth = view.in_camera(bounds.center).z - bounds.radius * view.max_scale;
    error_px(view, group, view.max_scale, depth.max(view.eye.near))
}

pub(crate) fn meshlets(view: &ObjectView, group: usize) -> f32 {
    let distance = view.distance_to(&view.object.nested_bounds[group]);
    let is_orthographic = view.eye.is_orthographic();
    let scale = if is_orthographic { view.max_scale } else { 1.0 };
    error_px(view, group, scale, distance.max(view.eye.near))
}

pub(crate) fn cesium(view: &ObjectView, group: usize) -> f32 {
    let bounds = &view.object.nested_bounds[group];
    let from_eye = view.relative_to_eye(bounds.center);
    let is_under_camera = from_eye.x.hypot(from_eye.z) <= bounds.radius * view.max_scale;
    if view.touches_sphere(bounds) || is_under_camera {
        let distance = view.distance_to(bounds).max(1e-7);
        error_px(view, group, view.max_scale, distance)
    } else {
        0.0
    }
}

pub(crate) fn nanite(view: &ObjectView, group: usize) -> f32 {
    // What is out of view is culled first.
    let bounds = &view.object.nested_bounds[group];
    if !view.eye.is_orthographic() && !view.touches_sphere(bounds) {
        return 0.0;
    }
    // The least depth and the least cosine over the sphere.
    let center = view.in_camera(bounds.center);
    let radius = bounds.radius * view.max_scale;
    let near = view.eye.near;
    let depth = (center.z - radius).max(near);
    let distance = depth * least_cosine(center, radius, near);
    error_px(view, group, view.min_scale, distance)
}

/// `e scale f / distance`; without the distance in orthographic views.
fn error_px(view: &ObjectView, group: usize, scale: f32, distance: f32) -> f32 {
    let error_at_unit_px = view.object.errors_in_local[group] * scale * view.eye.focal_px();
    if view.eye.is_orthographic() {
        error_at_unit_px
    } else {
        error_at_unit_px / distance
    }
}

/// The least cosine off the axis over a sphere in camera space, as Nanite finds it.
fn least_cosine(center: Vec3, radius: f32, near: f32) -> f32 {
    let off_axis = center.truncate().length();
    let distance_squared = center.length_squared();
    let to_tangent_squared = distance_squared - radius * radius;
    let to_tangent = to_tangent_squared.max(0.0).sqrt();
    let cosine = (to_tangent * center.z - radius * off_axis) / distance_squared;
    if to_tangent_squared < 0.0 || cosine * to_tangent < near {
        // The sphere crosses the near plane: its widest point there.
        let height = near - center.z;
        let widest = off_axis + (radius * radius - height * height).max(0.0).sqrt();
        near / widest.hypot(near)
    } else {
        cosine
    }
}
