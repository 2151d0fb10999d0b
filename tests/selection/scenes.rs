//! Baked fixtures and cameras for the suites.

use std::sync::OnceLock;

use camera_field::Camera;
use fieldlod_bake::{BakeConfig, bake_mesh};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::View;
use glam::{Affine3A, Mat4, Quat, Vec2, Vec3};
use proptest::prelude::*;

/// Closed and open fixtures with many groups: a boulder, a knot with texture seams, hills, leaves.
pub(crate) fn hierarchies() -> &'static [Hierarchy] {
    static BAKED: OnceLock<Vec<Hierarchy>> = OnceLock::new();
    BAKED.get_or_init(|| {
        let config = BakeConfig {
            cluster_triangles: 64,
            group_clusters: 6,
            ..BakeConfig::default()
        };
        let meshes = [
            fieldlod_tests::rock(5, 1),
            fieldlod_tests::torus_knot(200, 24),
            fieldlod_tests::height_field(64),
            fieldlod_tests::islands(500),
        ];
        let bake = |mesh| bake_mesh(mesh, &config).unwrap();
        meshes.iter().map(bake).collect()
    })
}

/// A camera of vertical field of view `fov_y` (radians) with 1920 × 1080 pixels.
pub(crate) fn camera(fov_y: f32) -> Camera {
    let projection = Mat4::perspective_infinite_reverse_rh(fov_y, 16.0 / 9.0, 0.01);
    Camera::from_projection(&projection, Vec2::new(1920.0, 1080.0)).unwrap()
}

/// The view from `eye` towards `target`.
pub(crate) fn view(fov_y: f32, eye: Vec3, target: Vec3) -> View {
    let world_from_view = Mat4::look_at_rh(eye, target, Vec3::Y).inverse();
    View::new(camera(fov_y), &Affine3A::from_mat4(world_from_view))
}

/// Views from anywhere, inside the object and turned away from it included.
pub(crate) fn any_view() -> impl Strategy<Value = View> {
    let vector = || prop::array::uniform3(-1.0f32..1.0).prop_map(Vec3::from);
    let distance = prop_oneof![0.0f32..2.0, 2.0f32..50.0, 50.0f32..5000.0];
    (0.05f32..2.4, vector(), distance, vector())
        .prop_filter("the eye needs a direction", |(_, direction, _, _)| {
            direction.length() > 0.1 && direction.cross(Vec3::Y).length() > 0.05
        })
        .prop_map(|(fov_y, direction, distance, target)| {
            let eye = direction.normalize() * distance;
            view(
                fov_y,
                eye,
                target + eye * 1e-3 + direction.cross(Vec3::Y) * 1e-2,
            )
        })
}

/// Any placement: rotated, scaled unevenly, mirrored, moved.
pub(crate) fn any_placement() -> impl Strategy<Value = Affine3A> {
    let turn = prop::array::uniform4(-1.0f32..1.0).prop_map(Quat::from_array);
    let scale = prop::array::uniform3(prop_oneof![-3.0f32..-0.1, 0.1f32..3.0]);
    let shift = prop::array::uniform3(-2.0f32..2.0);
    (turn, scale, shift)
        .prop_filter("a rotation needs length", |(turn, _, _)| {
            turn.length() > 0.1
        })
        .prop_map(|(turn, scale, shift)| {
            Affine3A::from_scale_rotation_translation(scale.into(), turn.normalize(), shift.into())
        })
}
