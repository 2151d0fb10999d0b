//! Cases without reports: difficult geometry, precision or motion.

use glam::{Affine3A, Vec2, Vec3};

use super::cameras::{HD, SMALL, around, at_distances, distances, eye, from_front, ground, scaled};
use super::case::{Frame, Shot, cases};
use crate::eye::{Eye, Instance};
use crate::object::LodObject;

cases! {
    "scaled mesh": "an instance is enlarged, evenly and along one axis",
        Rock, [Displaced], scaled_mesh;
    "inside the object": "the camera is inside and looks out",
        Shell, [Displaced], inside_the_object => two_sided;
    "near plane": "groups reach across the near plane",
        Shell, [Displaced], near_plane;
    "behind": "the object is close behind the camera",
        Rock, [Idles], behind;
    "grazing planes": "the ground is seen from just above it",
        Terrain, [Displaced], grazing;
    "thin shells": "the silhouette of a shell in a corner of the picture",
        Shell, [Displaced], thin_shells;
    "taa jitter": "the picture shifts by up to half a pixel, with the object on the edge",
        Rock, [Flips], taa_jitter;
    "head-bob": "a walk over hills at eye height",
        Terrain, [Displaced, Flips], head_bob;
    "dolly zoom": "the field of view widens while the camera approaches",
        Rock, [Displaced, Flips], dolly_zoom;
    "1e6 m away": "eye and object are 1e6 m from the origin",
        Rock, [Displaced], far_from_origin;
    "scales": "the world is 1e-3 and 1e3 times as large",
        Rock, [Displaced], scales;
    "split screen": "two views side by side, one near and one far",
        Rock, [Displaced], split_screen;
    "window resize": "the user enlarges the window",
        Rock, [Displaced, Flips], window_resize;
    "teleport": "the camera jumps near and far",
        Rock, [Displaced], teleport;
    "nan transform": "the transform contains NaN or infinity, or its scale is 0",
        Rock, [], nan_transform;
}

fn scaled_mesh(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    // One scale is uniform, the other is along one axis.
    let scales = [Vec3::splat(8.0), Vec3::new(8.0, 1.0, 1.0)];
    let shots = scales.map(|scale| {
        at_distances(object, &camera, |distance| {
            let away = from_front(camera, object, distance * 8.0);
            Shot::of_instance(away, scaled(object, scale))
        })
    });
    shots.concat()
}

fn inside_the_object(object: &LodObject) -> Vec<Shot> {
    let camera = eye(90.0, SMALL, object);
    let directions = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z];
    directions
        .map(|direction| {
            // The offset keeps the vertical view from being parallel to the camera's up axis.
            let position = object.center + direction * object.radius * 0.1;
            Shot::still(camera.looking_at(position, position + direction + Vec3::splat(0.01)))
        })
        .to_vec()
}

/// A view from just above a vertex along the surface.
fn near_plane(object: &LodObject) -> Vec<Shot> {
    let shot = |height: f32| {
        let camera = Eye::perspective(80.0, SMALL, object.radius * height * 0.5);
        let position = ground(object, 0.5, 0.5, height);
        let along = Vec3::new(1.0, -0.15, 0.4);
        Shot::still(camera.looking_at(position, position + along))
    };
    [0.02, 0.1, 0.3].map(shot).to_vec()
}

fn behind(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    let shot = |distance: f32| {
        let away = from_front(camera, object, object.radius * distance);
        Shot::still(away.turned(180.0, 0.0))
    };
    [1.5, 3.0, 10.0].map(shot).to_vec()
}

fn grazing(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, SMALL, object);
    let shot = |height: f32| {
        let position = ground(object, 0.02, 0.5, height);
        let level = Vec3::new(object.aabb.max.x, position.y, object.center.z);
        Shot::still(camera.looking_at(position, level))
    };
    [0.01, 0.05, 0.2].map(shot).to_vec()
}

fn thin_shells(object: &LodObject) -> Vec<Shot> {
    let camera = eye(90.0, HD, object);
    at_distances(object, &camera, |distance| {
        Shot::still(from_front(camera, object, distance).turned(50.0, 32.0))
    })
}

/// The first points of Halton's sequence in bases 2 and 3, within half a pixel of the center.
fn jitter_px(frame: usize) -> Vec2 {
    let radical_inverse = |base: usize| {
        let (mut index, mut digit, mut value) = (frame % 16 + 1, 1.0, 0.0);
        while index > 0 {
            digit /= base as f32;
            value += digit * (index % base) as f32;
            index /= base;
        }
        value
    };
    Vec2::new(radical_inverse(2), radical_inverse(3)) - 0.5
}

fn taa_jitter(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    at_distances(object, &camera, |distance| {
        // The turn puts the object on the edge of the picture.
        let still = from_front(camera, object, distance).turned(45.7, 0.0);
        let frame = |index: usize| Frame {
            eye: still.jittered(jitter_px(index)),
            instance: Instance::default(),
        };
        Shot {
            frames: (0..64).map(frame).collect(),
            measure_every: 32,
        }
    })
}

/// Two steps per second at 60 frames per second. At an eye height of 1.7 m, the bob is 5 cm up and down, and half
/// as much along x.
fn head_bob(object: &LodObject) -> Vec<Shot> {
    let camera = eye(70.0, HD, object);
    let (from, to) = (ground(object, 0.1, 0.2, 0.1), ground(object, 0.4, 0.6, 0.1));
    let target = ground(object, 0.9, 0.9, 0.0);
    let walk = |t: f32| {
        let step = t * 119.0 / 30.0 * std::f32::consts::TAU;
        let bob = Vec3::new(0.5 * (step * 0.5).sin(), step.sin(), 0.0) * 0.003 * object.radius;
        camera.looking_at(from.lerp(to, t) + bob, target)
    };
    vec![Shot::path(120, 8, walk)]
}

fn dolly_zoom(object: &LodObject) -> Vec<Shot> {
    // The object's sphere is 71 to 55 % as high as the picture.
    let zoom = |t: f32| {
        let fovy_deg = 5.0 + 95.0 * t;
        let camera = eye(fovy_deg, SMALL, object);
        let distance = object.radius * 1.4 / (fovy_deg * 0.5).to_radians().sin();
        from_front(camera, object, distance)
    };
    vec![Shot::path(90, 9, zoom)]
}

fn far_from_origin(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, HD, object);
    // The offset is exact in `f32`, but the sum rounds the position of the eye by up to 1/16 m.
    let offset = Vec3::new(1_048_576.0, 64.0, -1_048_576.0);
    at_distances(object, &camera, |distance| {
        let mut away = from_front(camera, object, distance);
        away.world_from_view.translation += glam::Vec3A::from(offset);
        let instance = Instance::at(Affine3A::from_translation(offset));
        Shot::of_instance(away, instance)
    })
}

fn scales(object: &LodObject) -> Vec<Shot> {
    let mut shots = Vec::new();
    for scale in [1e-3, 1e3] {
        let camera = Eye::perspective(60.0, HD, object.radius * scale * 1e-3);
        shots.extend(at_distances(object, &camera, |distance| {
            let mut away = from_front(camera, object, distance);
            away.world_from_view.translation *= scale;
            let instance = Instance::at(Affine3A::from_scale(Vec3::splat(scale)));
            Shot::of_instance(away, instance)
        }));
    }
    shots
}

fn split_screen(object: &LodObject) -> Vec<Shot> {
    let camera = eye(60.0, Vec2::new(960.0, 1080.0), object);
    let distances = distances(object, &camera);
    let ends = [distances.first(), distances.last()];
    let shot = |&distance: &f32| Shot::still(from_front(camera, object, distance));
    ends.into_iter().flatten().map(shot).collect()
}

fn window_resize(object: &LodObject) -> Vec<Shot> {
    // The window grows from a quarter of HD's width to twice its width.
    let resize = |t: f32| {
        let window_px = Vec2::new(480.0, 270.0).lerp(Vec2::new(3840.0, 2160.0), t);
        let camera = eye(60.0, window_px.round(), object);
        from_front(camera, object, object.radius * 12.0)
    };
    vec![Shot::path(90, 6, resize)]
}

fn teleport(object: &LodObject) -> Vec<Shot> {
    let camera = eye(75.0, HD, object);
    let jump = |t: f32| {
        // The last frame is still at the fourth stop.
        let stop = (t * 3.999) as usize;
        let distance = [1.2, 60.0, 2.5, 15.0][stop] * object.radius;
        around(camera, object, distance, 77.0 * stop as f32).turned(0.0, 10.0)
    };
    vec![Shot::path(32, 32, jump)]
}

fn nan_transform(object: &LodObject) -> Vec<Shot> {
    let camera = from_front(eye(60.0, HD, object), object, object.radius * 3.0);
    let transforms = [
        Affine3A::from_translation(Vec3::new(f32::NAN, 0.0, 0.0)),
        Affine3A::from_scale(Vec3::splat(f32::NAN)),
        Affine3A::from_scale(Vec3::splat(f32::INFINITY)),
        Affine3A::from_scale(Vec3::ZERO),
    ];
    transforms
        .map(|transform| Shot::of_instance(camera, Instance::at(transform)))
        .to_vec()
}
