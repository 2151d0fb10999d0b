//! The motion of the camera within which a cut of groups stays the same.
//!
//! The camera travels by `t` and turns by `θ`. A point at the distance `ρ` is displaced by at most `t + θ ρ` in camera
//! space. Its direction to the camera changes by at most `t / (ρ − t)`. The criterion bounds the field over a group's
//! sphere. If the displacement is added to the sphere's radius, the bound holds for every displaced group. If it is
//! subtracted, even below zero, every displaced group has an equal or larger bound. The cut holds for the whole motion
//! under two conditions. Groups that are not refined stay below the threshold by the first bound; refined groups stay
//! above it by the second.

use super::frame::{Frame, Input};
use crate::criterion::Motion;
use crate::view::stretch::largest_stretch;

/// Number of frames at the present speed for which a cut is tested. With more frames, cuts fail the test more often;
/// with fewer frames, there are more tests. In a walk among 10,000 rocks, 4 took 0.15 ms a frame, 8 took 0.17 ms and 16
/// took 0.24 ms at least.
const FRAMES_AHEAD: f32 = 4.0;

/// All motion so far, in `f64`: the sum of many small steps loses digits in `f32`.
#[derive(Debug, Default)]
pub(crate) struct Odometer {
    travel: f64,
    turn: f64,
    /// Counts frames that changed more than the camera's pose.
    epoch: u64,
    /// The motion for which cuts are tested; `None` if more than the pose has changed.
    pub(crate) ahead: Option<Motion>,
}

/// The end of the motion within which a cut holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hold {
    epoch: u64,
    travel: f64,
    turn: f64,
}

impl Odometer {
    /// Adds the motion since the previous frame.
    pub(crate) fn advance(&mut self, frame: &Frame) {
        let last = frame.last.as_ref();
        let motion = last.and_then(|last| motion_between(last, frame.input));
        self.ahead = motion.map(|Motion { travel, turn }| Motion {
            travel: travel * FRAMES_AHEAD,
            turn: turn * FRAMES_AHEAD,
        });
        match motion {
            Some(motion) => {
                self.travel += f64::from(motion.travel);
                self.turn += f64::from(motion.turn);
            }
            None => self.epoch += 1,
        }
    }

    /// The hold of a cut that passes the test for `ahead`.
    pub(crate) fn hold(&self, ahead: Motion) -> Hold {
        Hold {
            epoch: self.epoch,
            travel: self.travel + f64::from(ahead.travel),
            turn: self.turn + f64::from(ahead.turn),
        }
    }

    /// Whether a cut still holds.
    pub(crate) fn is_within(&self, hold: &Hold) -> bool {
        self.epoch == hold.epoch && self.travel <= hold.travel && self.turn <= hold.turn
    }
}

/// `None` if anything but the pose has changed, or the motion is not finite.
fn motion_between(last: &Input, now: &Input) -> Option<Motion> {
    let (last_pose, pose) = (&last.view, &now.view);
    if !now.differs_by_pose_alone(last) {
        return None;
    }
    let turn = last_pose.camera_from_world - pose.camera_from_world;
    // The factors are larger than the rounding of the differences.
    let motion = Motion {
        travel: last_pose.eye_in_world.distance(pose.eye_in_world) * 1.001,
        turn: largest_stretch(&turn) * 1.001,
    };
    (motion.travel.is_finite() && motion.turn.is_finite()).then_some(motion)
}
