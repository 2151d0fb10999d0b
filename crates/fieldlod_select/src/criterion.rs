//! The criterion: how many pixels of error a group's simplification shows in a view.
//!
//! From the camera-sampling field (P.-H. Lin and T.-Y. Lee, "Camera-Sampling Field and Its
//! Applications", IEEE TVCG 2004): the error of a piece of surface counts in the picture by its
//! projection factor c·n (eq. 16), the samples per unit area of surface.
//!
//! ```text
//! screen error = e √( c (V + 0.1 p) )        pixels
//!
//! e   error of the simplification, a length, times the most that the instance stretches lengths
//! c   upper bound of the field's strength over the group's sphere (eq. 5), samples per unit area
//! V   mean of max(n·s, 0) over the group's surface: the visible share of its projection factor
//! p   likelihood of a silhouette in the group, where c·n is 0 but an error is seen edge-on
//!
//! V = (μ + √(μ² + v)) / 2,   μ = m·s,   v = (1 − |m|²) / 4
//! p = 1 / (1 + u + u²/2),    u = μ² / (2v + 0.005)
//! m   mean of the group's unit normals;  s  unit vector from the group to the camera
//! ```
//! V, p and the constants are ours, not the paper's: a smooth estimate from the mean normal alone.
//! The screen error is RMS-like: it weighs errors by how much of the picture they touch, and is no
//! upper bound of a displacement.

use camera_field::{Camera, SphereBound};
use fieldlod_hierarchy::{Group, Sphere};
use glam::Vec3;

use crate::InstanceView;

const SILHOUETTE_WEIGHT: f32 = 0.1;
const FLATNESS_FLOOR: f32 = 0.005;

/// The screen-space error of the simplification of `group`, in pixels: what [`select`] compares with
/// [`LodSettings::error_px`].
///
/// Zero outside the field of view; infinite for a terminal group and where the group's sphere
/// reaches the camera plane inside the field of view. Never negative; NaN only for input that holds
/// NaN.
///
/// [`select`]: crate::select
/// [`LodSettings::error_px`]: crate::LodSettings::error_px
#[must_use]
pub fn screen_error_px(group: &Group, instance: &InstanceView) -> f32 {
    if group.is_terminal() {
        return f32::INFINITY;
    }
    let sphere = instance.sphere_in_camera(&group.bounds);
    let SphereBound::Bounded(strength) = strength_over(&instance.camera, &sphere) else {
        return f32::INFINITY;
    };
    let mean_normal = instance.mean_normal_in_camera(group.mean_normal);
    let to_camera = direction_to_camera(&instance.camera, sphere.center);
    let weight = picture_weight(mean_normal, to_camera);
    let error = group.error_in_local * instance.camera_per_local;
    error * (strength * weight).sqrt()
}

/// Upper bound of the field's strength over a sphere in camera space, zero outside the field of
/// view.
fn strength_over(camera: &Camera, sphere: &Sphere) -> SphereBound {
    let Sphere { center, radius } = *sphere;
    match camera {
        Camera::Perspective(intrinsics) => intrinsics.strength_over_sphere(center, radius),
        Camera::Orthographic(intrinsics) => intrinsics.strength_over_sphere(center, radius),
    }
}

fn direction_to_camera(camera: &Camera, point_in_camera: Vec3) -> Vec3 {
    match camera {
        Camera::Perspective(_) => {
            let distance = point_in_camera.length();
            if distance > 0.0 {
                point_in_camera * (-1.0 / distance)
            } else {
                Vec3::ZERO
            }
        }
        Camera::Orthographic(_) => Vec3::NEG_Z,
    }
}

/// `V + 0.1 p` of the module's formula.
fn picture_weight(mean_normal: Vec3, to_camera: Vec3) -> f32 {
    let facing = mean_normal.dot(to_camera);
    // Rounding may leave |m| a hair above 1.
    let variance = (1.0 - mean_normal.length_squared()).max(0.0) * 0.25;
    let visible_share = 0.5 * (facing + (facing * facing + variance).sqrt());
    let u = facing * facing / (2.0 * variance + FLATNESS_FLOOR);
    let silhouette = 1.0 / (1.0 + u + 0.5 * u * u);
    visible_share.max(0.0) + SILHOUETTE_WEIGHT * silhouette
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_group_facing_the_camera_counts_in_full() {
        let weight = picture_weight(Vec3::Z, Vec3::Z);
        assert!((weight - 1.0).abs() < 1e-3, "{weight}");
    }

    #[test]
    fn a_flat_group_turned_away_counts_nothing() {
        let weight = picture_weight(Vec3::Z, Vec3::NEG_Z);
        assert!((0.0..1e-3).contains(&weight), "{weight}");
    }

    #[test]
    fn a_flat_group_seen_edge_on_counts_by_its_silhouette() {
        let weight = picture_weight(Vec3::Z, Vec3::X);
        assert!((weight - SILHOUETTE_WEIGHT).abs() < 1e-6, "{weight}");
    }

    #[test]
    fn a_closed_group_counts_the_same_from_everywhere() {
        let weight = picture_weight(Vec3::ZERO, Vec3::X);
        assert_eq!(weight, picture_weight(Vec3::ZERO, Vec3::NEG_Y));
        // The mean of max(n·s, 0) over a sphere is 1/4: what V gives for m = 0.
        assert!((weight - (0.25 + SILHOUETTE_WEIGHT)).abs() < 1e-6);
    }
}
