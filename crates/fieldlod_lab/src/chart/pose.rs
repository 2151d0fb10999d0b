//! The cameras of a chart.

use glam::{Vec2, Vec3};
use serde::Serialize;
use xxhash_rust::xxh3::xxh3_64;

use crate::eye::Eye;
use crate::object::LodObject;

/// Vertical fields of view of successive poses, in degrees.
const FOVS_DEG: [f32; 3] = [60.0, 45.0, 90.0];
/// Distances from the center of an object, in radii. Nearer than 1 radius, cameras can be inside the object. At 6
/// radii, the object's sphere is 105 px high in a picture of 640 x 360 px at 60°, and smaller farther away.
const NEAREST_RADII: f32 = 1.25;
const FARTHEST_RADII: f32 = 6.0;
/// Heights of the eye above a ground, in radii of the ground.
const LOWEST_RADII: f32 = 0.01;
const HIGHEST_RADII: f32 = 0.25;

/// A camera in a model's space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pose {
    /// The camera's position.
    pub position: [f32; 3],
    /// The point that the camera looks at.
    pub target: [f32; 3],
    /// Vertical field of view, in degrees.
    pub fovy_deg: f32,
}

impl Pose {
    /// The camera, with a picture of `size_px`.
    #[must_use]
    pub fn eye(&self, object: &LodObject, size_px: Vec2) -> Eye {
        let eye = Eye::perspective(self.fovy_deg, size_px, object.radius * 1e-3);
        eye.looking_at(self.position.into(), self.target.into())
    }
}

/// `count` poses around an object, or above a ground, at near and far distances. Most cameras do not look at the
/// object's center. The same seed gives the same poses.
pub(super) fn poses(object: &LodObject, count: usize, seed: u64) -> Vec<Pose> {
    let is_ground = is_ground(object);
    let pose = |index: usize| {
        let random = Random { seed, index };
        // Each pose has its own part of the range, so even a few poses cover the whole range.
        let share = (index as f32 + random.share(0)) / count as f32;
        let fovy_deg = FOVS_DEG[index % FOVS_DEG.len()];
        let (position, target) = if is_ground {
            on_ground(object, share, random)
        } else {
            around(object, share, random)
        };
        Pose {
            position: position.to_array(),
            target: target.to_array(),
            fovy_deg,
        }
    };
    (0..count).map(pose).collect()
}

/// Returns `true` if an object is a ground: much wider than it is high, along +Y. The generated hills are a fifth as high as
/// wide.
fn is_ground(object: &LodObject) -> bool {
    let extent = object.aabb.max - object.aabb.min;
    extent.y < 0.3 * extent.x.min(extent.z)
}

fn around(object: &LodObject, share: f32, random: Random) -> (Vec3, Vec3) {
    // Distances are even on a logarithmic scale.
    let radii = NEAREST_RADII * (FARTHEST_RADII / NEAREST_RADII).powf(share);
    let position = object.center + random.direction(1) * (radii * object.radius);
    let aside = random.direction(3) * (0.5 * object.radius * random.share(5));
    (position, object.center + aside)
}

fn on_ground(object: &LodObject, share: f32, random: Random) -> (Vec3, Vec3) {
    let height = LOWEST_RADII * (HIGHEST_RADII / LOWEST_RADII).powf(share);
    // The camera looks from one place on the ground to another. Both are away from the border.
    let place = |slot: u64| {
        let (x, z) = (random.share(slot), random.share(slot + 1));
        object.vertex_below(0.1 + 0.8 * x, 0.1 + 0.8 * z)
    };
    let (from, mut to) = (place(1), place(3));
    // A camera that looks straight down has no direction upwards in its image.
    if from == to {
        to += Vec3::X * object.radius;
    }
    (from + Vec3::Y * (height * object.radius), to)
}

/// Random numbers that depend only on the seed, the pose and the slot.
#[derive(Clone, Copy)]
struct Random {
    seed: u64,
    index: usize,
}

impl Random {
    /// A number from 0 to 1.
    fn share(self, slot: u64) -> f32 {
        // An `f32` holds 24 bits exactly.
        let key = [self.seed, self.index as u64, slot].map(u64::to_le_bytes);
        (xxh3_64(key.as_flattened()) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// A random direction, uniform over the sphere. Uses `slot` and the next slot.
    fn direction(self, slot: u64) -> Vec3 {
        let z = 2.0 * self.share(slot) - 1.0;
        let (sin, cos) = (std::f32::consts::TAU * self.share(slot + 1)).sin_cos();
        let across = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(across * cos, z, across * sin)
    }
}
