//! Cases that users of other systems reported.

use glam::{Vec2, Vec3};

use super::cameras::{HD, SMALL, around, at_distances, distances, eye, from_front, ground, scaled};
use super::case::{Case, Fault, Shot};
use super::fixtures::Fixture;
use crate::eye::{Eye, Instance};
use crate::object::LodObject;

/// The cases, in the order of the table.
pub(super) const CASES: &[Case] = &[
    Case::new(
        "rotate only",
        "the camera turns on the spot and levels jump",
        Fixture::Rock,
        &[Fault::Displaced, Fault::Flips],
        rotate_only,
    )
    .reported_as(&["godot 81995", "godot 76436"]),
    Case::new(
        "inside the box",
        "the camera stands inside the object's box, away from its surface",
        Fixture::Knot,
        &[Fault::Displaced, Fault::Wastes],
        inside_the_box,
    )
    .reported_as(&["godot 88273", "godot 79590"]),
    Case::new(
        "cull margin",
        "a box inflated for culling forces the worst level",
        Fixture::Rock,
        &[Fault::Displaced, Fault::Wastes],
        cull_margin,
    )
    .reported_as(&["godot 67890"]),
    Case::new(
        "orthographic",
        "an orthographic camera far away gets the worst level",
        Fixture::Rock,
        &[Fault::Displaced],
        orthographic,
    )
    .reported_as(&["godot 57404"]),
    Case::new(
        "scaled bones",
        "the object is scaled by 100, as by bones",
        Fixture::Rock,
        &[Fault::Displaced],
        scaled_bones,
    )
    .reported_as(&["godot 57895", "godot 59147"]),
    Case::new(
        "zoom ignored",
        "the camera zooms in from afar and the model stays coarse",
        Fixture::Rock,
        &[Fault::Displaced],
        zoom_ignored,
    )
    .reported_as(&["three.js 18557"]),
    Case::new(
        "flicker",
        "small movements at a threshold switch levels back and forth",
        Fixture::Rock,
        &[Fault::Flips],
        flicker,
    )
    .reported_as(&["three.js 14565"]),
    Case::new(
        "window size",
        "the same view is good in one window and bad in another",
        Fixture::Rock,
        &[Fault::Displaced],
        window_size,
    )
    .reported_as(&["cesium 4043"]),
    Case::new(
        "narrow fov",
        "a telephoto lens refines near parts at the edge of the picture",
        Fixture::Terrain,
        &[Fault::Displaced, Fault::Wastes],
        narrow_fov,
    )
    .reported_as(&["cesium-native 1138"]),
    Case::new(
        "shadow view",
        "a light and a camera need different levels",
        Fixture::Rock,
        &[Fault::Displaced],
        shadow_view,
    )
    .reported_as(&["bevy 15084"]),
    Case::new(
        "non-nested",
        "bounds that do not nest drop or double parts of the surface",
        Fixture::Rock,
        &[],
        non_nested,
    )
    .reported_as(&["the rule's own documentation"]),
];

fn rotate_only(object: &LodObject) -> Vec<Shot> {
    let camera = eye(90.0, HD, object);
    at_distances(object, &camera, |distance| {
        let start = from_front(camera, object, distance);
        Shot::path(60, 6, |t| start.turned(58.0 * t, 42.0 * t))
    })
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
    at_distances(object, &camera, |distance| {
        let instance = Instance {
            cull_margin: object.radius * 100.0,
            ..Instance::default()
        };
        Shot::of_instance(from_front(camera, object, distance), instance)
    })
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
    at_distances(object, &camera, |distance| {
        let instance = scaled(object, Vec3::splat(scale));
        Shot::of_instance(from_front(camera, object, distance * scale), instance)
    })
}

fn zoom_ignored(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    at_distances(object, &camera, |distance| {
        Shot::still(from_front(camera, object, distance).zoomed(8.0))
    })
}

/// The camera sways by 3 % of the distance with a period of six frames, and walks slowly across the start of a level.
fn flicker(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    // The start of the second level.
    let second = distances(object, &camera).get(1).copied();
    let middle = second.unwrap_or(object.radius * 4.0);
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
        // The turn puts the object at the side of the picture.
        shots.extend(at_distances(object, &camera, |distance| {
            let reach_deg = (object.radius / distance).asin().to_degrees();
            let turn_deg = (half_width_deg - reach_deg).max(0.0);
            Shot::still(from_front(camera, object, distance).turned(turn_deg, 0.0))
        }));
    }
    shots
}

/// A view from above the center of the ground to a place near its border.
fn narrow_fov(object: &LodObject) -> Vec<Shot> {
    let shot = |fovy_deg: f32| {
        let camera = eye(fovy_deg, SMALL, object);
        let position = ground(object, 0.5, 0.5, 0.3);
        let target = ground(object, 0.9, 0.6, 0.0);
        Shot::still(camera.looking_at(position, target))
    };
    [4.0, 2.0, 1.0].map(shot).to_vec()
}

/// A camera near and far, and two views of a light: the object fills one shadow map and is small in the other.
fn shadow_view(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    // The camera, then the light.
    let mut shots = at_distances(object, &camera, |distance| {
        Shot::still(from_front(camera, object, distance))
    });
    shots.extend([2.2, 40.0].map(|heights| {
        let light = Eye::orthographic(object.radius * heights, Vec2::splat(2048.0));
        Shot::still(around(light, object, object.radius * 200.0, 70.0))
    }));
    shots
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
