//! One object in one view: distances, scales and boxes that the rules of all methods share.

use fieldlod_hierarchy::{Aabb, Sphere};
use glam::{Mat3, Vec3};

use crate::eye::{Eye, Instance};
use crate::object::LodObject;

/// An instance of an object in one view.
///
/// Positions are relative to the eye for all methods. Engines differ in their precision far from the origin, which is
/// not compared.
#[derive(Clone, Copy, Debug)]
pub struct ObjectView<'a> {
    /// The object.
    pub object: &'a LodObject,
    /// The place of the object.
    pub instance: Instance,
    /// The eye.
    pub eye: Eye,
    /// Largest scale along the local axes, in world units per local unit.
    pub max_scale: f32,
    world_from_local: Mat3,
    origin_from_eye: Vec3,
    camera_from_world: Mat3,
}

impl<'a> ObjectView<'a> {
    /// The view of an instance of `object`.
    #[must_use]
    pub fn new(object: &'a LodObject, instance: &Instance, eye: &Eye) -> Self {
        let m = Mat3::from(instance.world_from_local.matrix3);
        let scales = Vec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
        Self {
            object,
            instance: *instance,
            eye: *eye,
            max_scale: scales.max_element(),
            world_from_local: m,
            origin_from_eye: Vec3::from(instance.world_from_local.translation) - eye.position(),
            camera_from_world: eye.camera_from_world().as_mat3(),
        }
    }

    /// A local point relative to the eye, along the world's axes.
    pub(crate) fn relative_to_eye(&self, point_in_local: Vec3) -> Vec3 {
        self.world_from_local * point_in_local + self.origin_from_eye
    }

    /// A local point in camera space.
    pub(crate) fn in_camera(&self, point_in_local: Vec3) -> Vec3 {
        self.camera_from_world * self.relative_to_eye(point_in_local)
    }

    /// Returns `true` if the sphere around a local box touches the field of view.
    pub(crate) fn touches_box(&self, aabb: &Aabb) -> bool {
        self.touches_sphere(&Sphere {
            center: (aabb.min + aabb.max) * 0.5,
            radius: (aabb.max - aabb.min).length() * 0.5,
        })
    }

    /// Returns `true` if a local sphere touches the field of view.
    pub(crate) fn touches_sphere(&self, sphere: &Sphere) -> bool {
        let center = self.in_camera(sphere.center);
        let radius = sphere.radius * self.max_scale;
        self.eye.camera.touches_sphere(center, radius)
    }

    /// The `units` that pass frustum culling, by the spheres around their boxes.
    pub(crate) fn units_in_view(&self, units: &[u32]) -> Vec<u32> {
        let all = &self.object.hierarchy.units;
        let touches = |unit: &&u32| self.touches_box(&all[**unit as usize].aabb);
        units.iter().filter(touches).copied().collect()
    }

    /// Distance from the eye to a sphere's surface, negative inside, in world units.
    pub(crate) fn distance_to(&self, sphere: &Sphere) -> f32 {
        self.relative_to_eye(sphere.center).length() - self.max_scale * sphere.radius
    }

    /// Distance from the eye to the center of the object.
    pub(crate) fn distance_to_center(&self) -> f32 {
        self.relative_to_eye(self.object.center).length()
    }

    /// The instance's axis-aligned box in the world with the cull margin, relative to the eye.
    pub(crate) fn aabb_relative_to_eye(&self) -> Aabb {
        let Aabb { min, max } = self.object.aabb;
        let half = (max - min) * 0.5;
        // Half the size of the axis-aligned box around the rotated box.
        let m = &self.world_from_local;
        let extent = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
        let inflated = extent + self.instance.cull_margin;
        let center = self.relative_to_eye(self.object.center);
        Aabb {
            min: center - inflated,
            max: center + inflated,
        }
    }
}
