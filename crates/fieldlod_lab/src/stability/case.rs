//! What a case is: a sequence of views of an instance, and what is asked of a method in it.

use serde::Serialize;

use super::Fixture;
use crate::rivals::{Eye, Instance, LodObject};

/// A scene in which methods may fail.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// A short name.
    pub name: &'static str,
    /// What is seen or was reported.
    pub story: &'static str,
    /// Where users reported it, as "project number".
    pub reported: &'static [&'static str],
    /// The object, unless one is given.
    pub fixture: Fixture,
    /// What is asked of every method.
    pub demands: Demands,
    /// The frames, for an object.
    pub shots: fn(&LodObject) -> Vec<Shot>,
}

/// What a case asks of every method. That no hole opens is asked in all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Demands {
    /// Displacements keep to [`PROMISE_ALLOWANCE`](super::PROMISE_ALLOWANCE) times the threshold.
    pub promise: bool,
    /// No group changes and changes back within five frames.
    pub calm: bool,
    /// At most [`THRIFT_RATIO`](super::THRIFT_RATIO) times the triangles of our guaranteed cut.
    pub thrift: bool,
    /// At most [`THRIFT_RATIO`](super::THRIFT_RATIO) times the triangles of the coarsest cut.
    pub idle: bool,
    /// Surfaces that face away are seen, too.
    pub two_sided: bool,
}

impl Demands {
    pub(super) const NONE: Self = Self {
        promise: false,
        calm: false,
        thrift: false,
        idle: false,
        two_sided: false,
    };
    pub(super) const PROMISE: Self = Self {
        promise: true,
        ..Self::NONE
    };
    pub(super) const CALM: Self = Self {
        calm: true,
        ..Self::NONE
    };
    pub(super) const PROMISE_CALM: Self = Self {
        calm: true,
        ..Self::PROMISE
    };
    pub(super) const PROMISE_THRIFT: Self = Self {
        thrift: true,
        ..Self::PROMISE
    };
}

/// Frames that follow each other; a method starts each shot without memory.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The frames.
    pub frames: Vec<Frame>,
    /// Displacements and holes are measured in every such frame.
    pub measure_every: usize,
}

/// One frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Who looks.
    pub eye: Eye,
    /// At what.
    pub instance: Instance,
}

impl Shot {
    /// A single frame of the instance at the origin.
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

    /// `count` frames by a parameter that runs from 0 to 1, about `measured` of which are measured.
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
