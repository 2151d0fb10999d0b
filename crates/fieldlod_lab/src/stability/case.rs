//! A case: a sequence of views of an instance, and the faults that it checks for.

use serde::Serialize;

use super::fixtures::Fixture;
use crate::eye::{Eye, Instance};
use crate::object::LodObject;

/// A case in which methods may fail.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// A short name.
    pub name: &'static str,
    /// A description.
    pub story: &'static str,
    /// The reports of users, as "project issue".
    pub reported: &'static [&'static str],
    /// The object of the case.
    pub fixture: Fixture,
    /// The faults to check for, in addition to holes.
    pub checks: &'static [Fault],
    /// Whether back faces are visible.
    pub is_two_sided: bool,
    /// Makes the frames for an object.
    pub shots: fn(&LodObject) -> Vec<Shot>,
}

impl Case {
    /// Makes back faces visible.
    pub(super) const fn two_sided(self) -> Self {
        Self {
            is_two_sided: true,
            ..self
        }
    }
}

/// Declares `CASES`, in the order of the table. Each case has a name, a story, a fixture, the faults that it checks for,
/// and a function that makes its shots. Reports of users and `two_sided` are optional.
macro_rules! cases {
    ($($name:literal: $story:literal, $fixture:ident, [$($fault:ident),*], $shots:ident
        $(, reported as [$($report:literal),+])? $(=> $sides:ident)?;)+) => {
        pub(super) const CASES: &[$crate::stability::Case] = &[$($crate::stability::Case {
            name: $name,
            story: $story,
            reported: &[$($($report),+)?],
            fixture: $crate::stability::Fixture::$fixture,
            checks: &[$($crate::stability::Fault::$fault),*],
            is_two_sided: false,
            shots: $shots,
        }$(.$sides())?),+];
    };
}
pub(super) use cases;

/// A way to fail a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// The cut has open edges.
    Holes,
    /// Displacements exceed the allowance.
    Displaced,
    /// Groups flip between frames.
    Flips,
    /// The method chooses more triangles than the guaranteed cut needs.
    Wastes,
    /// The method chooses detail outside of the view.
    Idles,
}

/// Successive frames. Methods start each shot without state.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The frames.
    pub frames: Vec<Frame>,
    /// Displacements and holes are measured in every n-th frame.
    pub measure_every: usize,
}

/// One frame of a shot.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The eye.
    pub eye: Eye,
    /// The instance.
    pub instance: Instance,
}

impl Shot {
    /// A single frame with the instance at the origin.
    pub(super) fn still(eye: Eye) -> Self {
        Self::of_instance(eye, Instance::default())
    }

    /// A single frame.
    pub(super) fn of_instance(eye: Eye, instance: Instance) -> Self {
        Self {
            frames: vec![Frame { eye, instance }],
            measure_every: 1,
        }
    }

    /// `count` frames along a path. `eye` gets a parameter from 0 to 1. About `measured` frames are measured.
    pub(super) fn path(count: usize, measured: usize, eye: impl Fn(f32) -> Eye) -> Self {
        let share = |frame: usize| frame as f32 / (count - 1).max(1) as f32;
        let frame = |frame: usize| Frame {
            eye: eye(share(frame)),
            instance: Instance::default(),
        };
        Self {
            frames: (0..count).map(frame).collect(),
            measure_every: (count / measured).max(1),
        }
    }
}
