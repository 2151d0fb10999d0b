//! Our criterion with its terms apart, so that each can be switched off.

use camera_field::{Camera, Intrinsics, SphereBound};
use glam::Vec3;

use crate::object_view::ObjectView;

/// The terms and constants of the criterion; [`Default`] is the criterion as it is.
///
/// ```text
/// screen error = e √( 4 c (V + w p) )        quality
/// displacement = d √(c / cos φ)              guaranteed
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// Whether it is the displacement of the guarantee, which has neither projection factor nor
    /// silhouette, instead of the quality's screen error.
    pub displacement: bool,
    /// Whether surfaces count by the projection factor, as `4 (V + w p)`; if not, as 1.
    pub projection_factor: bool,
    /// Whether the field's strength knows the stretch off the axis; if not, it is that of the
    /// distance.
    pub off_axis: bool,
    /// Whether the strength is bounded over the sphere, as the curl demands; if not, it is that at
    /// the centre.
    pub bounded: bool,
    /// `w`: 0 leaves out the silhouette.
    pub silhouette_weight: f32,
    /// Whether surfaces are view from behind as from the front, with |m·s| in place of m·s.
    pub two_sided: bool,
    /// Whether a group that the view's edge cuts counts by the share of it that is in view. Not part
    /// of the criterion.
    pub share_in_view: bool,
}

impl Default for Terms {
    fn default() -> Self {
        Self {
            displacement: false,
            projection_factor: true,
            off_axis: true,
            bounded: true,
            silhouette_weight: 0.1,
            two_sided: false,
            share_in_view: false,
        }
    }
}

impl Terms {
    /// Without the stretch off the axis.
    pub(crate) fn on_axis(self) -> Self {
        Self {
            off_axis: false,
            ..self
        }
    }

    /// Without the bound over the sphere.
    pub(crate) fn unbounded(self) -> Self {
        Self {
            bounded: false,
            ..self
        }
    }

    /// The screen-space error of a group in a perspective view, in pixels.
    #[must_use]
    pub fn error_px(&self, view: &ObjectView, group: usize) -> f32 {
        // The group's sphere in camera space.
        let data = &view.object.hierarchy.groups[group];
        let center = view.in_camera(data.bounds.center);
        let radius = data.bounds.radius * view.max_scale;
        // The guarantee asks for the displacement alone.
        if self.displacement {
            let scale = self.pixel_scale(view, center, radius);
            return data.deviation_in_local * view.max_scale * scale;
        }
        // Quality weighs the field's strength by how the surface faces the camera.
        let strength = self.strength(view, center, radius);
        let weight = if self.projection_factor {
            let to_camera = -center.normalize_or_zero();
            let mean_normal = view.direction_in_camera(data.mean_normal);
            self.picture_weight(mean_normal, to_camera)
        } else {
            1.0
        };
        let share = match &view.eye.camera {
            Camera::Perspective(camera) if self.share_in_view => {
                share_in_view(camera, center, radius)
            }
            _ => 1.0,
        };
        let error = view.object.errors_in_local[group] * view.max_scale;
        error * (strength * weight * share).sqrt()
    }

    fn strength(&self, view: &ObjectView, center: Vec3, radius: f32) -> f32 {
        let camera = &view.eye.camera;
        let SphereBound::Bounded(bound) = camera.strength_over_sphere(center, radius) else {
            return f32::INFINITY;
        };
        let Camera::Perspective(intrinsics) = camera else {
            return bound;
        };
        // Nothing is left out, or the sphere is not in view.
        if bound == 0.0 || (self.off_axis && self.bounded) {
            return bound;
        }
        let (distance, depth) = self.place(view, center, radius);
        if self.off_axis {
            intrinsics.constant_px2() * distance / (depth * depth * depth)
        } else {
            intrinsics.constant_px2() / (distance * distance)
        }
    }

    fn pixel_scale(&self, view: &ObjectView, center: Vec3, radius: f32) -> f32 {
        let SphereBound::Bounded(bound) = view.eye.camera.pixel_scale_over_sphere(center, radius)
        else {
            return f32::INFINITY;
        };
        if bound == 0.0 || (self.off_axis && self.bounded) {
            return bound;
        }
        let (distance, depth) = self.place(view, center, radius);
        if self.off_axis {
            view.eye.focal_px() * distance / (depth * depth)
        } else {
            view.eye.focal_px() / distance
        }
    }

    /// Distance and depth at which the field is taken: of the sphere's nearest point where it is
    /// bounded, else of its centre.
    fn place(&self, view: &ObjectView, center: Vec3, radius: f32) -> (f32, f32) {
        let towards_eye = if self.bounded { radius } else { 0.0 };
        let distance = (center.length() - towards_eye).max(view.eye.near);
        (distance, center.z.max(view.eye.near))
    }

    fn picture_weight(&self, mean_normal: Vec3, to_camera: Vec3) -> f32 {
        let mean_facing = mean_normal.dot(to_camera);
        let facing = if self.two_sided {
            mean_facing.abs()
        } else {
            mean_facing
        };
        // The shorter the mean normal, the more the normals of the group differ.
        let variance = (1.0 - mean_normal.length_squared()).max(0.0) * 0.25;
        let visible = 0.5 * (facing + (facing * facing + variance).sqrt());
        // The silhouette's term is greatest where the surface is seen from the side.
        let u = facing * facing / (2.0 * variance + 0.005);
        4.0 * (visible.max(0.0) + self.silhouette_weight / (1.0 + u + 0.5 * u * u))
    }
}

/// About the share of a sphere that lies within the four sides of the view.
fn share_in_view(camera: &Intrinsics, center: Vec3, radius: f32) -> f32 {
    // By how far the centre is inside of each of the four planes, relative to the radius.
    let inside = |along: f32, slope: f32, side: f32| {
        let distance = side * (slope * center.z - along) / (1.0 + slope * slope).sqrt();
        (0.5 + 0.5 * distance / radius.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    let (min, max) = (camera.slope_min, camera.slope_max);
    inside(center.x, min.x, -1.0)
        * inside(center.x, max.x, 1.0)
        * inside(center.y, min.y, -1.0)
        * inside(center.y, max.y, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eye::{Eye, Instance};
    use crate::object::{ErrorSource, LodObject};
    use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
    use fieldlod_select::{InstanceView, screen_displacement_px, screen_error_px};
    use glam::Vec2;

    #[test]
    fn half_of_a_sphere_on_a_side_is_in_view() {
        let eye = Eye::perspective(90.0, Vec2::splat(512.0), 0.01);
        let Camera::Perspective(camera) = eye.camera else {
            panic!("perspective")
        };
        let share = |x: f32| share_in_view(&camera, Vec3::new(x, 0.0, 10.0), 1.0);
        assert!((share(0.0) - 1.0).abs() < 1e-6);
        assert!((share(10.0) - 0.5).abs() < 1e-4, "{}", share(10.0));
        assert!(share(9.5) > 0.6 && share(-10.5) < 0.4);
        assert_eq!(share(-12.0), 0.0);
    }

    /// With all its terms, this is the criterion that the project selects by.
    #[test]
    fn all_terms_make_the_criterion_itself() {
        let hierarchy = bake_mesh(&fixtures::rock(4, 3), &BakeConfig::fine_grained()).unwrap();
        let object = LodObject::new(hierarchy, ErrorSource::Reported);
        for (position, target) in [
            (Vec3::new(0.4, 1.5, 3.0), Vec3::new(1.0, 0.0, 0.0)),
            (Vec3::new(-1.4, 0.2, 0.0), Vec3::new(0.0, 0.0, 1.0)),
        ] {
            let eye = Eye::perspective(70.0, Vec2::new(640.0, 360.0), 0.01);
            let eye = eye.looking_at(position, target);
            let instance = Instance::default();
            let view = ObjectView::new(&object, &instance, &eye);
            let selected = InstanceView::new(&eye.view(), &instance.world_from_local);
            for (index, group) in object.hierarchy.groups.iter().enumerate() {
                let displacement = Terms {
                    displacement: true,
                    ..Terms::default()
                };
                for (own, terms) in [
                    (screen_error_px(group, &selected), Terms::default()),
                    (screen_displacement_px(group, &selected), displacement),
                ] {
                    let lab = terms.error_px(&view, index);
                    let close = own == lab || (own - lab).abs() <= 1e-3 * own;
                    assert!(close || group.is_terminal(), "{index}: {own} {lab}");
                }
            }
        }
    }
}
