//! Hierarchies and views for the suites of this crate.
#![allow(dead_code, reason = "each suite uses its part")]

pub(crate) mod synthetic;
pub(crate) mod world;

use std::sync::OnceLock;

use camera_field::{Camera, Intrinsics, OrthographicIntrinsics};
use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{AdvancedSettings, LodSettings, Offscreen, View};
use glam::{Affine3A, Mat3, Mat4, Quat, Vec2, Vec3};
use proptest::prelude::*;

/// Number of [`hierarchies`].
pub(crate) const HIERARCHIES: usize = 7;

/// Hierarchies of closed and open meshes: baked and synthetic, with and without deviations, in units and whole.
pub(crate) fn hierarchies() -> &'static [Hierarchy] {
    static ALL: OnceLock<Vec<Hierarchy>> = OnceLock::new();
    ALL.get_or_init(|| {
        let config = BakeConfig {
            cluster_triangles: 64,
            group_clusters: 6,
            ..BakeConfig::default()
        };
        let bake = |mesh| bake_mesh(&mesh, &config).unwrap();
        vec![
            bake(fixtures::rock(5, 1)),
            bake(fixtures::height_field(64)),
            bake(fixtures::islands(200)),
            synthetic::ball(4, 0.002),
            unmeasured(synthetic::ball(4, 0.002)),
            synthetic::whole_mesh_levels(11, 0.002),
            bake(fixtures::height_field(16))
                .whole_mesh_levels()
                .unwrap(),
        ]
    })
}

/// The hierarchy without its deviations.
pub(crate) fn unmeasured(mut hierarchy: Hierarchy) -> Hierarchy {
    for group in &mut hierarchy.groups {
        group.deviation_in_local = f32::INFINITY;
    }
    hierarchy
}

pub(crate) fn perspective(fov_y: f32) -> Camera {
    let projection = Mat4::perspective_infinite_reverse_rh(fov_y, 16.0 / 9.0, 0.01);
    Camera::from_projection(&projection, Vec2::new(1920.0, 1080.0)).unwrap()
}

/// An off-centre camera, as for one tile of a video wall or one eye of a headset.
pub(crate) fn off_centre() -> Camera {
    let projection = Mat4::frustum_rh(-0.02, 0.12, -0.08, 0.03, 0.1, 100.0);
    Camera::from_projection(&projection, Vec2::new(900.0, 700.0)).unwrap()
}

pub(crate) fn orthographic() -> Camera {
    let projection = Mat4::orthographic_rh(-4.0, 4.0, -3.0, 3.0, 1000.0, 0.0);
    Camera::from_projection(&projection, Vec2::new(800.0, 600.0)).unwrap()
}

/// The same camera, zoomed in by `factor`.
pub(crate) fn zoomed(camera: Camera, factor: f32) -> Camera {
    match camera {
        Camera::Perspective(lens) => Camera::Perspective(Intrinsics {
            focal_px: lens.focal_px * factor,
            slope_min: lens.slope_min / factor,
            slope_max: lens.slope_max / factor,
        }),
        Camera::Orthographic(lens) => Camera::Orthographic(OrthographicIntrinsics {
            pixels_per_unit: lens.pixels_per_unit * factor,
            min: lens.min / factor,
            max: lens.max / factor,
        }),
    }
}

pub(crate) fn look(camera: Camera, eye: Vec3, target: Vec3) -> View {
    let world_from_view = Mat4::look_at_rh(eye, target, Vec3::new(0.1, 1.0, 0.05)).inverse();
    View::new(camera, &Affine3A::from_mat4(world_from_view))
}

/// Cameras from 0.1° to 170°, off-centre and orthographic.
pub(crate) fn any_camera() -> impl Strategy<Value = Camera> {
    prop_oneof![
        6 => (0.05f32..2.4).prop_map(perspective),
        1 => Just(perspective(170.0f32.to_radians())),
        1 => Just(perspective(0.1f32.to_radians())),
        1 => Just(off_centre()),
        1 => Just(orthographic()),
    ]
}

/// Orthographic cameras of different widths, also off-centre.
pub(crate) fn any_orthographic() -> impl Strategy<Value = Camera> {
    let shift = prop_oneof![Just(0.0f32), -8.0f32..8.0];
    (0.05f32..20.0, shift).prop_map(|(zoom, shift)| match zoomed(orthographic(), zoom) {
        Camera::Orthographic(lens) => Camera::Orthographic(OrthographicIntrinsics {
            min: lens.min + Vec2::X * shift,
            max: lens.max + Vec2::X * shift,
            ..lens
        }),
        camera @ Camera::Perspective(_) => camera,
    })
}

pub(crate) fn vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-1.0f32..1.0).prop_map(Vec3::from)
}

/// Views from anywhere, inside the object and turned away from it included.
pub(crate) fn any_view() -> impl Strategy<Value = View> {
    let distance = prop_oneof![0.0f32..2.0, 2.0f32..50.0, 50.0f32..5000.0];
    let camera = prop_oneof![9 => any_camera(), 2 => any_orthographic()];
    (camera, vector(), distance, vector()).prop_map(|(camera, direction, distance, target)| {
        let eye = (direction + Vec3::new(0.01, 0.02, 0.03)) * distance;
        look(camera, eye, target + eye * 1e-3 + Vec3::X * 1e-3)
    })
}

/// Placements that rotate, scale evenly or not, mirror, shear and flatten.
pub(crate) fn any_placement() -> impl Strategy<Value = Affine3A> {
    let turn = || {
        prop::array::uniform4(-1.0f32..1.0)
            .prop_map(|q| (Quat::from_array(q) + Quat::IDENTITY * 1.5).normalize())
    };
    let even = (0.01f32..10.0).prop_map(Vec3::splat);
    let uneven = prop::array::uniform3(prop_oneof![-3.0f32..-0.1, 0.1f32..3.0, Just(0.0f32)]);
    let scale = prop_oneof![3 => even, 3 => uneven.prop_map(Vec3::from)];
    (turn(), scale, turn(), vector()).prop_map(|(after, scale, before, shift)| {
        let linear = Mat3::from_quat(after) * Mat3::from_diagonal(scale) * Mat3::from_quat(before);
        Affine3A::from_mat3_translation(linear, shift * 2.0)
    })
}

/// The default with other advanced settings.
pub(crate) fn with_advanced(change: impl FnOnce(&mut AdvancedSettings)) -> LodSettings {
    let mut settings = LodSettings::default();
    change(&mut settings.advanced);
    settings
}

/// Settings with either threshold, both or none, with and without each relaxation.
pub(crate) fn any_settings() -> impl Strategy<Value = LodSettings> {
    let threshold = || prop_oneof![1 => Just(0.0f32), 9 => 0.05f32..20.0];
    let thresholds = prop_oneof![
        6 => threshold().prop_map(|error_px| (Some(error_px), None)),
        6 => threshold().prop_map(|displacement_px| (None, Some(displacement_px))),
        6 => (threshold(), 0.1f32..10.0).prop_map(|(error_px, cap_px)| (Some(error_px), Some(cap_px))),
        1 => Just((None, None)),
    ];
    let bias = prop_oneof![1 => Just(1.0f32), 1 => 0.1f32..1.0];
    let offscreen = prop_oneof![
        1 => Just(Offscreen::Coarsest),
        1 => bias.prop_map(|bias| Offscreen::OnAxis { bias }),
    ];
    let ratio = || prop_oneof![2 => Just(0.0f32), 1 => 0.0f32..0.9];
    let advanced = (0.0f32..=1.0, offscreen, prop::array::uniform4(ratio()));
    let advanced = advanced.prop_map(|(hysteresis, offscreen, ratios)| AdvancedSettings {
        hysteresis,
        min_aspect_ratio: ratios[0],
        max_curl: ratios[1],
        offscreen_margin: ratios[2],
        offscreen,
        edge_hysteresis: ratios[3],
    });
    (thresholds, 0.3f32..1.5, advanced).prop_map(|(thresholds, resolution_scale, advanced)| {
        LodSettings {
            error_px: thresholds.0,
            displacement_px: thresholds.1,
            resolution_scale,
            advanced,
            ..LodSettings::default()
        }
    })
}
