//! The stability suite: every method in every case in which users of some system saw it fail, and
//! in those where geometry, precision or time is at its worst.
//!
//! All methods run on the same hierarchies at the same threshold, 1 px; see
//! [`rivals`](crate::rivals) for what is fair between them. A method fails a case, as the case asks,
//! if
//!
//! - a displacement exceeds [`PROMISE_ALLOWANCE`] times the threshold, as
//!   [measured](crate::displacement);
//! - a group changes and changes back within [`FLIP_FRAMES`] frames;
//! - it chooses more than [`THRIFT_RATIO`] times the triangles of our guaranteed cut, or of the
//!   coarsest cut where nothing can be seen: what is chosen is kept, streamed and, but for culling,
//!   drawn;
//! - a cut of a closed mesh is open.
//!
//! The allowance is there because no rival promises a greatest displacement; our guaranteed method
//! is held to the threshold itself by the tests. Ours of quality does not promise it either.
//!
//! # Out of scope
//! - Shadow views (bevy 15084): which view's cut casts the shadow is the renderer's choice; the
//!   plugin's rendering tests show it.
//! - Small triangles kept by the attribute error (meshoptimizer 987), foliage that erodes
//!   (meshoptimizer 1093), a mesh whose groups are all stuck: these are the baker's.

mod case;
mod fixtures;
mod other;
mod reported;
mod run;
mod stage;
mod table;

pub use case::{Case, Demands, Frame, Shot};
pub use fixtures::Fixture;
pub use run::{CaseResult, Fault, ObjectRun, Report, Verdict, run};
pub use table::table;

pub use crate::holes::FLIP_FRAMES;

/// The threshold that all methods are asked for, in pixels.
pub const THRESHOLD_PX: f32 = 1.0;
/// How many times the threshold a displacement may reach before a method counts as failing.
pub const PROMISE_ALLOWANCE: f64 = 1.5;
/// How many times the triangles of our guaranteed cut, or of the coarsest one, count as waste.
pub const THRIFT_RATIO: f64 = 1.25;
/// Points of a surface at which displacements are measured.
pub const SAMPLES: usize = 8_000;

/// All cases: those that users reported first.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    reported::CASES.iter().chain(other::CASES)
}
