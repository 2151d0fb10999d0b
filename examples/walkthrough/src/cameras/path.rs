//! The camera's path through the scene: a closed, smooth curve.

use bevy::prelude::*;

use crate::noise::smoothstep;
use crate::shapes::terrain::{self, TOMB, TOMB_HEIGHT_IN_M};

/// Time that the camera takes for one round.
pub(crate) const DURATION_IN_S: f32 = 60.0;

/// Number of samples of the curve. Its length is measured between them.
const SAMPLES: usize = 1024;

/// A point of the path.
struct Knot {
    /// x, height above the ground, z, in metres.
    eye: Vec3,
    target: Vec3,
    /// Vertical field of view. At [`NARROW_IN_DEG`] the camera is a telescope that looks at [`TELESCOPE_TARGET`].
    fov_in_deg: f32,
}

impl Knot {
    fn is_telescope(&self) -> bool {
        self.fov_in_deg == NARROW_IN_DEG
    }
}

const fn knot(eye: [f32; 3], target: [f32; 3], fov_in_deg: f32) -> Knot {
    Knot {
        eye: Vec3::from_array(eye),
        target: Vec3::from_array(target),
        fov_in_deg,
    }
}

/// Usual vertical field of view.
const USUAL_IN_DEG: f32 = 54.0;
/// Vertical field of view between the columns. At 16:9 it is 110 degrees horizontally.
const WIDE_IN_DEG: f32 = 78.0;
/// Vertical field of view of the telescope. At 16:9 it is 14 degrees horizontally.
const NARROW_IN_DEG: f32 = 8.0;

/// The target of the telescope: the round temple in the far hills.
const TELESCOPE_TARGET: Vec3 = Vec3::new(TOMB.x, TOMB_HEIGHT_IN_M + 4.0, TOMB.y);
/// Distance from the eye to the target of the pose while the camera is a telescope.
const FOCUS_IN_M: f32 = 20.0;

/// The path leads up the avenue, around the great knot, and back over the western slope. On the slope, the camera looks
/// through the telescope.
const KNOTS: [Knot; 18] = [
    knot([1.5, 2.6, 96.0], [0.0, 4.4, 60.0], USUAL_IN_DEG),
    knot([0.3, 2.1, 78.0], [0.0, 3.2, 30.0], USUAL_IN_DEG),
    knot([-0.4, 1.9, 60.0], [1.2, 3.4, 30.0], WIDE_IN_DEG),
    knot([-2.2, 1.8, 40.0], [3.5, 3.4, 12.0], WIDE_IN_DEG),
    knot([1.6, 1.8, 20.0], [-0.6, 4.2, -20.0], USUAL_IN_DEG),
    knot([1.5, 2.2, 4.0], [-1.5, 4.0, -20.0], USUAL_IN_DEG),
    knot([7.5, 2.4, -11.0], [-2.5, 3.8, -22.0], USUAL_IN_DEG),
    knot([7.5, 2.6, -27.0], [-4.0, 3.4, -19.0], USUAL_IN_DEG),
    knot([-3.5, 3.0, -32.0], [-4.0, 3.0, -12.0], USUAL_IN_DEG),
    knot([-18.0, 3.6, -32.5], [-6.0, 3.0, -6.0], USUAL_IN_DEG),
    knot([-36.0, 6.0, -22.0], [-26.0, 4.0, 2.0], USUAL_IN_DEG),
    knot([-35.0, 4.4, -8.0], [-34.0, 6.5, 12.0], USUAL_IN_DEG),
    knot([-31.0, 3.4, 5.0], [-16.0, 7.0, 8.0], USUAL_IN_DEG),
    knot([-29.5, 3.2, 15.0], [-12.0, 8.0, 10.0], NARROW_IN_DEG),
    knot([-29.5, 3.4, 28.0], [-12.0, 8.0, 20.0], NARROW_IN_DEG),
    knot([-29.0, 6.0, 46.0], [-10.0, 5.0, 36.0], USUAL_IN_DEG),
    knot([-20.0, 6.5, 72.0], [0.0, 3.5, 46.0], USUAL_IN_DEG),
    knot([-8.0, 4.4, 90.0], [0.0, 3.8, 56.0], USUAL_IN_DEG),
];

/// Position, target and field of view of the camera, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    pub(crate) eye: Vec3,
    pub(crate) target: Vec3,
    /// Vertical field of view.
    pub(crate) fov_in_rad: f32,
}

impl Pose {
    /// The camera's transform: it looks along −Z with +Y up.
    pub(crate) fn transform(&self) -> Transform {
        Transform::from_translation(self.eye).looking_at(self.target, Vec3::Y)
    }
}

/// The path of the camera, at a constant speed.
#[derive(Clone, Debug)]
pub(crate) struct CameraPath {
    /// Length of the path up to each sample.
    length_in_m: Vec<f32>,
}

impl CameraPath {
    pub(crate) fn new() -> Self {
        let mut length_in_m = vec![0.0];
        let mut last = pose_at_parameter(0.0).eye;
        for sample in 1..=SAMPLES {
            let eye = pose_at_parameter(sample as f32 / SAMPLES as f32).eye;
            length_in_m.push(length_in_m[sample - 1] + eye.distance(last));
            last = eye;
        }
        Self { length_in_m }
    }

    /// The pose after a fraction of a round. The path is closed, so values above 1 start another round.
    pub(crate) fn pose(&self, round: f32) -> Pose {
        // This length lies between the samples `after - 1` and `after`.
        let length = round.rem_euclid(1.0) * self.length_in_m[SAMPLES];
        let after = self.length_in_m.partition_point(|&l| l <= length);
        let after = after.clamp(1, SAMPLES);
        let [from, to] = [self.length_in_m[after - 1], self.length_in_m[after]];
        let between = (length - from) / (to - from);
        pose_at_parameter(((after - 1) as f32 + between) / SAMPLES as f32)
    }
}

/// The pose at a curve parameter from 0 to 1, on a Catmull-Rom spline through the knots.
fn pose_at_parameter(parameter: f32) -> Pose {
    let scaled = parameter * KNOTS.len() as f32;
    let first = scaled.floor() as usize;
    let t = scaled - scaled.floor();
    let knot = |offset: usize| &KNOTS[(first + KNOTS.len() - 1 + offset) % KNOTS.len()];
    let [a, b, c, d] = [knot(0), knot(1), knot(2), knot(3)];
    // The eye follows the ground.
    let above_ground = catmull_rom(a.eye, b.eye, c.eye, d.eye, t);
    let ground = terrain::broad_height(Vec2::new(above_ground.x, above_ground.z));
    let eye = above_ground + Vec3::Y * ground;
    // The target blends between that of the knots and that of the telescope.
    let knot_target = catmull_rom(a.target, b.target, c.target, d.target, t);
    let far_target = eye + (TELESCOPE_TARGET - eye).normalize() * FOCUS_IN_M;
    let [from, to] = [b, c].map(|knot| f32::from(u8::from(knot.is_telescope())));
    let far = f32::lerp(from, to, smoothstep(0.0, 1.0, t));
    Pose {
        eye,
        target: knot_target.lerp(far_target, far),
        fov_in_rad: zoom(b.fov_in_deg.to_radians(), c.fov_in_deg.to_radians(), t),
    }
}

/// The field of view in radians between two knots. The logarithm of the magnification changes smoothly.
fn zoom(from_in_rad: f32, to_in_rad: f32, t: f32) -> f32 {
    let [from, to] = [from_in_rad, to_in_rad].map(|fov| (fov / 2.0).tan().ln());
    2.0 * f32::lerp(from, to, smoothstep(0.0, 1.0, t)).exp().atan()
}

fn catmull_rom(a: Vec3, b: Vec3, c: Vec3, d: Vec3, t: f32) -> Vec3 {
    let (t2, t3) = (t * t, t * t * t);
    let bend = (a * 2.0 - b * 5.0 + c * 4.0 - d) * t2 + ((b - c) * 3.0 + d - a) * t3;
    0.5 * (b * 2.0 + (c - a) * t + bend)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_is_continuous_at_an_even_speed() {
        let path = CameraPath::new();
        let step = path.length_in_m[SAMPLES] / 4096.0;
        for i in 0..4096 {
            let [from, to] = [i, i + 1].map(|i| path.pose(i as f32 / 4096.0));
            let moved = from.eye.distance(to.eye);
            assert!((0.5..1.5).contains(&(moved / step)), "{i}: {moved} m");
            assert!(from.target.distance(to.target) < 0.2);
            let zoomed = from.fov_in_rad / to.fov_in_rad;
            assert!((0.97..1.03).contains(&zoomed), "{i}: {zoomed}");
        }
    }

    #[test]
    fn path_stays_above_ground_and_looks_ahead() {
        let path = CameraPath::new();
        for i in 0..1000 {
            let pose = path.pose(i as f32 / 1000.0);
            let ground = terrain::height(Vec2::new(pose.eye.x, pose.eye.z));
            assert!(
                pose.eye.y - ground > 0.8,
                "{i}: {pose:?}, ground at {ground}"
            );
            assert!(pose.eye.distance(pose.target) > 5.0, "{i}");
        }
    }
}
