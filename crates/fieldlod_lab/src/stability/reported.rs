//! Cases that users of other systems reported.

use glam::{Vec2, Vec3};

use super::cameras::{HD, SMALL, around, at_distances, distances, eye, from_front, ground, scaled};
use super::case::{Shot, cases};
use crate::eye::{Eye, Instance};
use crate::object::LodObject;

cases! {
    "rotate only": "the camera turns on the spot and levels jump",
        Rock, [Displaced, Flips], rotate_only, reported as ["godot 81995", "godot 76436"];
    "inside the box": "the camera stands inside the object's box, away from its surface",
        Knot, [Displaced, Wastes], inside_the_box, reported as ["godot 88273", "godot 79590"];
    "cull margin": "a box inflated for culling forces the worst level",
        Rock, [Displaced, Wastes], cull_margin, reported as ["godot 67890"];
    "orthographic": "an orthographic camera far away gets the worst level",
        Rock, [Displaced], orthographic, reported as ["godot 57404"];
    "scaled bones": "the object is scaled by 100, as by bones",
        Rock, [Displaced], scaled_bones, reported as ["godot 57895", "godot 59147"];
    "zoom ignored": "the camera zooms in from afar and the model stays coarse",
        Rock, [Displaced], zoom_ignored, reported as ["three.js 18557"];
    "flicker": "small movements at a threshold switch levels back and forth",
        Rock, [Flips], flicker, reported as ["three.js 14565"];
    "window size": "the same view is good in one window and bad in another",
        Rock, [Displaced], window_size, reported as ["cesium 4043"];
    "narrow fov": "a telephoto lens refines near parts at the edge of the picture",
        Terrain, [Displaced, Wastes], narrow_fov, reported as ["cesium-native 1138"];
    "shadow view": "a light and a camera need different levels",
        Rock, [Displaced], shadow_view, reported as ["bevy 15084"];
    "non-nested": "bounds that do not nest drop or double parts of the surface",
        Rock, [], non_nested, reported as ["the rule's own documentation"];
}

fn rotate_only(object: &LodObject) -> Vec<Shot> {
    let camera = eye(90.0, HD, object);
    // At the end of the turn, the object is in a corner of the picture.
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
            // The offset keeps the vertical view from being parallel to the camera's up axis.
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
    // The second usable start of a level.
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
    let sizes = [[640, 360], [1920, 1080], [5120, 1440], [1080, 2400u16]];
    let mut shots = Vec::new();
    for [width, height] in sizes.map(|size| size.map(f32::from)) {
        let camera = eye(60.0, Vec2::new(width, height), object);
        let half_width = 30f32.to_radians().tan() * width / height;
        let half_width_deg = half_width.atan().to_degrees();
        // The turn puts the object at the side of the picture.
        shots.extend(at_distances(object, &camera, |distance| {
            let radius_deg = (object.radius / distance).asin().to_degrees();
            let turn_deg = (half_width_deg - radius_deg).max(0.0);
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
        let distance = object.radius * (1.02 + t * t * 6.0);
        around(camera, object, distance, 300.0 * t)
    };
    vec![Shot::path(64, 32, approach)]
}
