//! Cesium's 3D Tiles.
//!
//! ```text
//! geometricError H / (max(dist, 1e-7) 2 tan(fovy/2))        dist to the bounding volume, 0 inside
//! ```
//! A tile's volume holds its children's, so the nested spheres stand for it. Tiles out of view are
//! not refined, and have an error of 0 here, but for those under the camera (cesium-native's
//! `renderTilesUnderCamera`, on by default), with +Y for up. Its default threshold
//! is 16 px; here it runs at everyone's. Source: CesiumJS `Cesium3DTile`, cesium-native
//! `ViewState::computeScreenSpaceError`.

use fieldlod_hierarchy::Sphere;

use super::Seen;

pub(super) fn error_px(seen: &Seen, group: usize) -> f32 {
    let bounds = &seen.object.nested_bounds[group];
    if !seen.touches_sphere(bounds) && !is_under_camera(seen, bounds) {
        return 0.0;
    }
    let error = seen.object.errors_in_local[group] * seen.max_scale;
    let error_at_unit_px = error * seen.eye.focal_px();
    if seen.eye.is_orthographic() {
        error_at_unit_px
    } else {
        error_at_unit_px / seen.distance_to(bounds).max(1e-7)
    }
}

fn is_under_camera(seen: &Seen, bounds: &Sphere) -> bool {
    let from_eye = seen.relative_to_eye(bounds.center);
    from_eye.x.hypot(from_eye.z) <= bounds.radius * seen.max_scale
}
