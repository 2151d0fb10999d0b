//! The camera's way through the scene: a closed, smooth curve.

use glam::{Affine3A, Vec2, Vec3};

use crate::shapes::terrain;

/// Time for one round.
pub(crate) const DURATION_IN_S: f32 = 48.0;

/// Samples of the curve by which its length is measured.
const SAMPLES: usize = 1024;

/// Where the camera passes, as (x, height above the ground, z), and the point it looks at there.
const KNOTS: [(Vec3, Vec3); 14] = [
    (Vec3::new(1.5, 2.6, 96.0), Vec3::new(0.0, 4.4, 60.0)),
    (Vec3::new(0.3, 2.1, 78.0), Vec3::new(0.0, 3.2, 30.0)),
    (Vec3::new(-0.4, 1.9, 60.0), Vec3::new(1.2, 3.0, 30.0)),
    (Vec3::new(-2.2, 1.8, 40.0), Vec3::new(3.5, 2.8, 12.0)),
    (Vec3::new(1.6, 1.8, 20.0), Vec3::new(-0.6, 4.2, -20.0)),
    (Vec3::new(1.5, 2.2, 4.0), Vec3::new(-1.5, 4.0, -20.0)),
    (Vec3::new(-7.5, 2.4, -11.0), Vec3::new(2.5, 3.8, -22.0)),
    (Vec3::new(-7.5, 2.6, -27.0), Vec3::new(4.0, 3.4, -19.0)),
    (Vec3::new(3.5, 3.0, -32.0), Vec3::new(4.0, 3.0, -12.0)),
    (Vec3::new(18.0, 3.6, -32.5), Vec3::new(2.0, 3.0, -8.0)),
    (Vec3::new(37.0, 7.0, -22.0), Vec3::new(-4.0, 2.0, 0.0)),
    (Vec3::new(48.0, 9.0, 12.0), Vec3::new(-14.0, 2.0, 6.0)),
    (Vec3::new(41.0, 8.0, 54.0), Vec3::new(-8.0, 2.0, 20.0)),
    (Vec3::new(20.0, 5.0, 88.0), Vec3::new(-6.0, 3.0, 46.0)),
];

/// Where the camera is and what it looks at, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    pub(crate) eye: Vec3,
    pub(crate) target: Vec3,
}

impl Pose {
    /// The camera's place: it looks along −Z with +Y up.
    pub(crate) fn world_from_view(&self) -> Affine3A {
        Affine3A::look_at_rh(self.eye, self.target, Vec3::Y).inverse()
    }
}

/// The curve, walked at an even speed.
#[derive(Clone, Debug)]
pub(crate) struct CameraPath {
    /// Length of the curve up to each sample.
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

    /// The pose after this fraction of a round; rounds repeat.
    pub(crate) fn pose(&self, round: f32) -> Pose {
        let length = round.rem_euclid(1.0) * self.length_in_m[SAMPLES];
        let after = self
            .length_in_m
            .partition_point(|&l| l <= length)
            .clamp(1, SAMPLES);
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
    let knot = |offset: usize| KNOTS[(first + KNOTS.len() - 1 + offset) % KNOTS.len()];
    let [a, b, c, d] = [knot(0), knot(1), knot(2), knot(3)];
    let above_ground = catmull_rom(a.0, b.0, c.0, d.0, t);
    let ground = terrain::broad_height(Vec2::new(above_ground.x, above_ground.z));
    Pose {
        eye: above_ground + Vec3::Y * ground,
        target: catmull_rom(a.1, b.1, c.1, d.1, t),
    }
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
    fn the_path_is_closed() {
        let path = CameraPath::new();
        let (start, end) = (path.pose(0.0), path.pose(0.999_999));
        assert!(start.eye.distance(end.eye) < 0.01);
        assert!(start.target.distance(end.target) < 0.01);
        assert_eq!(path.pose(1.25), path.pose(0.25));
    }

    #[test]
    fn the_path_is_continuous_and_walked_at_an_even_speed() {
        let path = CameraPath::new();
        let step = path.length_in_m[SAMPLES] / 4096.0;
        for i in 0..4096 {
            let [from, to] = [i, i + 1].map(|i| path.pose(i as f32 / 4096.0));
            let moved = from.eye.distance(to.eye);
            assert!((0.5..1.5).contains(&(moved / step)), "{i}: {moved} m");
            assert!(from.target.distance(to.target) < 0.2);
        }
    }

    #[test]
    fn the_path_stays_above_the_ground_and_looks_ahead() {
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
