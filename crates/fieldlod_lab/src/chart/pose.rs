//! The cameras of a chart.

use fieldlod_hierarchy::fixtures::Random;
use glam::{Vec2, Vec3};
use serde::Serialize;

use crate::eye::Eye;
use crate::object::LodObject;
use crate::props::direction;

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
    let mut random = Random::new(seed);
    let pose = |index: usize| {
        // Each pose has its own part of the range, so even a few poses cover the whole range.
        let share = (index as f32 + random.unit()) / count as f32;
        let fovy_deg = FOVS_DEG[index % FOVS_DEG.len()];
        let (position, target) = if is_ground {
            on_ground(object, share, &mut random)
        } else {
            around(object, share, &mut random)
        };
        Pose {
            position: position.to_array(),
            target: target.to_array(),
            fovy_deg,
        }
    };
    (0..count).map(pose).collect()
}

/// Returns `true` if an object is a ground: nearly all of its surface faces up, along +Y.
fn is_ground(object: &LodObject) -> bool {
    let (hierarchy, mut facing) = (&object.hierarchy, [0.0f32; 2]);
    for unit in hierarchy.source_units() {
        for triangle in hierarchy.triangles_of(&hierarchy.units[unit]) {
            let [a, b, c] = triangle.map(|v| hierarchy.vertices.positions[v as usize]);
            let up = (b - a).cross(c - a).y;
            facing[usize::from(up < 0.0)] += up.abs();
        }
    }
    // Closed meshes have equal areas that face up and down.
    facing[0] > 9.0 * facing[1]
}

fn around(object: &LodObject, share: f32, random: &mut Random) -> (Vec3, Vec3) {
    let mut any_direction = || direction(random.index(4096) as u32, 4096);
    let (from, aside) = (any_direction(), any_direction());
    // Distances are even on a logarithmic scale.
    let radii = NEAREST_RADII * (FARTHEST_RADII / NEAREST_RADII).powf(share);
    let position = object.center + from * (radii * object.radius);
    let aside = aside * (0.5 * object.radius * random.unit());
    (position, object.center + aside)
}

fn on_ground(object: &LodObject, share: f32, random: &mut Random) -> (Vec3, Vec3) {
    let height = LOWEST_RADII * (HIGHEST_RADII / LOWEST_RADII).powf(share);
    // The camera looks from one place on the ground to another. Both are away from the border.
    let mut place = || {
        let (x, z) = (random.unit(), random.unit());
        object.vertex_below(0.1 + 0.8 * x, 0.1 + 0.8 * z)
    };
    let (from, mut to) = (place(), place());
    // A camera that looks straight down has no direction upwards in its image.
    if from == to {
        to += Vec3::X * object.radius;
    }
    (from + Vec3::Y * (height * object.radius), to)
}
