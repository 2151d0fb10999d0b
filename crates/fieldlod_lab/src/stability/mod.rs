//! The stability suite runs all methods in difficult cases. Users of other systems reported failures in some of them;
//! the others have difficult geometry, precision or motion.
//!
//! All methods run on the same hierarchies at the same threshold, 1 px; [`method`](crate::method) explains why the
//! comparison is fair. Each case checks for some of these faults:
//!
//! - A [displacement](crate::displacement) exceeds [`PROMISE_ALLOWANCE`] times the threshold.
//! - A group changes and changes back within [`FLIP_FRAMES`](crate::holes::FLIP_FRAMES) frames.
//! - The method chooses more than [`THRIFT_RATIO`] times the triangles of the guaranteed cut, or of the coarsest cut
//!   if nothing is visible. Chosen units are stored and streamed even if they are culled.
//! - A cut of a closed mesh has open edges.
//!
//! The allowance exists because other systems do not limit displacements. The tests require that the guaranteed
//! method stays within the threshold itself. The quality method does not limit displacements.
//!
//! [`Case::reported`] names the reports of users.

mod cameras;
mod case;
mod fixtures;
mod other;
mod reported;
mod run;
mod table;

pub use case::{Case, Fault, Frame, Shot};
pub use fixtures::Fixture;
pub use run::{CaseResult, Verdict, run};
pub use table::table;

use crate::method::Method;

/// The methods of the suite: all that run on this project's hierarchies.
pub const METHODS: [Method; 5] = [
    Method::Quality,
    Method::Guaranteed,
    Method::ClusterlodOnOurLevels,
    Method::Godot,
    Method::VisibilityRange,
];

/// The threshold of all methods, in pixels.
pub const THRESHOLD_PX: f32 = 1.0;
/// A displacement of more than this multiple of the threshold is a fault. Other systems do not limit displacements, so
/// a small excess does not count as a fault. A large excess is a visible jump.
pub const PROMISE_ALLOWANCE: f64 = 1.5;
/// More triangles than this multiple of those of the guaranteed cut, or of the coarsest cut, are a fault. With a
/// smaller ratio, small differences between criteria would be faults.
pub const THRIFT_RATIO: f64 = 1.25;
/// The number of points of a surface at which displacements are measured. Fewer points miss the largest displacement; more
/// take longer.
pub const SAMPLES: usize = 8_000;

/// All cases. The cases that users reported come first.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    reported::CASES.iter().chain(other::CASES)
}
