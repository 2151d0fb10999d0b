//! Cases that users of other systems reported.

use glam::{Vec2, Vec3};

use super::Fixture;
use super::case::{Case, Demands, Shot};
use super::stage::{HD, SMALL, around, distances, eye, from_front, ground, scaled};
use crate::rivals::{Eye, Instance, LodObject};

/// The cases, in the order of the table.
pub(super) const CASES: &[Case] = &[
    Case {
        name: "rotate only",
        story: "the camera turns on the spot and levels jump",
        reported: &["godot 81995", "godot 76436"],
        fixture: Fixture::Rock,
        demands: Demands::PROMISE_CALM,
        shots: rotate_only,
    },
    Case {
        name: "inside the box",
        story: "the camera stands inside the object's box, away from its surface",
        reported: &["godot 88273", "godot 79590"],
        fixture: Fixture::Knot,
        demands: Demands::PROMISE_THRIFT,
        shots: inside_the_box,
    },
    Case {
        name: "cull margin",
        story: "a box inflated for culling forces the worst level",
        reported: &["godot 67890"],
        fixture: Fixture::Rock,
        demands: Demands::PROMISE_THRIFT,
        shots: cull_margin,
    },
    Case {
        name: "orthographic",
        story: "an orthographic camera far away gets the worst level",
        reported: &["godot 57404"],
        fixture: Fixture::Rock,
        demands: Demands::PROMISE,
        shots: orthographic,
    },
    Case {
        name: "scaled bones",
        story: "bones enlarge what the node says is small",
        reported: &["godot 57895", "godot 59147"],
        fixture: Fixture::Rock,
        demands: Demands::PROMISE,
        shots: scaled_bones,
    },
    Case {
        name: "zoom ignored",
        story: "the camera zooms in from afar and the model stays coarse",
        reported: &["three.js 18557"],
        fixture: Fixture::Rock,
        demands: Demands::PROMISE,
        shots: zoom_ignored,
    },
    Case {
        name: "flicker",
        story: "small movements at a threshold switch levels back and forth",
        reported: &["three.js 14565"],
        fixture: Fixture::Rock,
        demands: Demands::CALM,
        shots: flicker,
    },
    Case {
        name: "window size",
        story: "the same view is good in one window and bad in another",
        reported: &["cesium 4043"],
        fixture: Fixture::Rock,
        demands: Demands::PROMISE,
        shots: window_size,
    },
    Case {
        name: "narrow fov",
        story: "a telephoto lens refines what is near and hardly in the picture",
        reported: &["cesium-native 1138"],
        fixture: Fixture::Terrain,
        demands: Demands::PROMISE_THRIFT,
        shots: narrow_fov,
    },
    Case {
        name: "shadow view",
        story: "a light sees the object in detail, from where the camera would not, or the other way round",
        reported: &["bevy 15084"],
        fixture: Fixture::Rock,
        demands: Demands::PROMISE,
        shots: shadow_view,
    },
    Case {
        name: "non-nested",
        story: "bounds that do not nest drop or double parts of the surface",
        reported: &["the rule's own documentation"],
        fixture: Fixture::Rock,
        demands: Demands::NONE,
        shots: non_nested,
    },
];

fn rotate_only(object: &LodObject) -> Vec<Shot> {
    let camera = || eye(90.0, HD, object);
    let shot = |distance: f32| {
        let start = from_front(camera(), object, distance);
        Shot::path(60, 6, |t| start.turned(58.0 * t, 42.0 * t))
    };
    distances(object, camera().focal_px()).map(shot).collect()
}

fn inside_the_box(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    let directions = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::new(0.5, 0.8, 0.3)];
    directions
        .map(|direction| {
            let position = object.center;
            Shot::still(camera.looking_at(position, position + direction + Vec3::Z * 0.01))
        })
        .to_vec()
}

fn cull_margin(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    let shot = |distance: f32| {
        let instance = Instance {
            cull_margin: object.radius * 100.0,
            ..Instance::default()
        };
        Shot::of_instance(from_front(camera, object, distance), instance)
    };
    distances(object, camera.focal_px()).map(shot).collect()
}

fn orthographic(object: &LodObject) -> Vec<Shot> {
    let shot = |heights: f32| {
        let camera = Eye::orthographic(object.radius * heights, HD);
        Shot::still(from_front(camera, object, object.radius * 1000.0))
    };
    [0.5, 2.2, 8.0].map(shot).to_vec()
}

fn scaled_bones(object: &LodObject) -> Vec<Shot> {
    let scale = 100.0;
    let camera = eye(60.0, HD, object);
    let shot = |distance: f32| {
        let instance = Instance {
            bone_scale: scale,
            ..scaled(object, Vec3::splat(scale))
        };
        Shot::of_instance(from_front(camera, object, distance * scale), instance)
    };
    distances(object, camera.focal_px()).map(shot).collect()
}

fn zoom_ignored(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    let shot = |distance: f32| Shot::still(from_front(camera, object, distance).zoomed(8.0));
    distances(object, camera.focal_px()).map(shot).collect()
}

/// A sway of 3 % of the distance with a period of six frames, on a slow walk through the start of a
/// level's range.
fn flicker(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    let middle = distances(object, camera.focal_px())
        .nth(1)
        .unwrap_or(object.radius * 4.0);
    let sway = |t: f32| {
        let frame = t * 359.0;
        let walked = 0.7 * 2.0f32.powf(t);
        let swayed = 1.0 + 0.03 * (frame * std::f32::consts::TAU / 6.0).sin();
        from_front(camera, object, middle * walked * swayed)
    };
    vec![Shot::path(360, 2, sway)]
}

fn window_size(object: &LodObject) -> Vec<Shot> {
    let windows = [
        (640.0, 360.0),
        (1920.0, 1080.0),
        (5120.0, 1440.0),
        (1080.0, 2400.0),
    ];
    let mut shots = Vec::new();
    for (width, height) in windows {
        let camera = eye(60.0, Vec2::new(width, height), object);
        let half_width_deg = (30f32.to_radians().tan() * width / height)
            .atan()
            .to_degrees();
        shots.extend(distances(object, camera.focal_px()).map(|distance| {
            let reach_deg = (object.radius / distance).asin().to_degrees();
            let turn_deg = (half_width_deg - reach_deg).max(0.0);
            Shot::still(from_front(camera, object, distance).turned(turn_deg, 0.0))
        }));
    }
    shots
}

/// From above the middle of the ground down to a spot near its border.
fn narrow_fov(object: &LodObject) -> Vec<Shot> {
    let shot = |fovy_deg: f32| {
        let camera = eye(fovy_deg, SMALL, object);
        let position = ground(object, 0.5, 0.5, 0.3);
        let target = ground(object, 0.9, 0.6, 0.0);
        Shot::still(camera.looking_at(position, target))
    };
    [4.0, 2.0, 1.0].map(shot).to_vec()
}

/// The camera from near by and far away, and the sun's view: a map of shadows that the object fills, of a
/// near cascade, and one in which it is small.
fn shadow_view(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    let by_camera = distances(object, camera.focal_px())
        .map(|distance| Shot::still(from_front(camera, object, distance)));
    let by_light = [2.2, 40.0].map(|heights| {
        let light = Eye::orthographic(object.radius * heights, Vec2::splat(2048.0));
        Shot::still(around(light, object, object.radius * 200.0, 70.0))
    });
    by_camera.chain(by_light).collect()
}

fn non_nested(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, SMALL, object);
    let approach = |t: f32| {
        around(
            camera,
            object,
            object.radius * (1.02 + t * t * 6.0),
            300.0 * t,
        )
    };
    vec![Shot::path(64, 32, approach)]
}
