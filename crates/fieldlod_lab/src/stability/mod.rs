//! The stability suite: all methods in cases in which users of some system reported failures, and in cases with
//! difficult geometry, precision or motion.
//!
//! All methods run on the same hierarchies at the same threshold, 1 px; see [`method`](crate::method) for what makes
//! the comparison fair. A method fails a case that checks for the fault, if
//!
//! - a displacement exceeds [`PROMISE_ALLOWANCE`] times the threshold, as [measured](crate::displacement);
//! - a group changes and changes back within [`FLIP_FRAMES`](crate::holes::FLIP_FRAMES) frames;
//! - it chooses more than [`THRIFT_RATIO`] times the triangles of the guaranteed cut, or of the coarsest cut if
//!   nothing is visible: chosen units are stored, streamed and, unless culled, drawn;
//! - a cut of a closed mesh has open edges.
//!
//! The allowance exists because other systems promise no greatest displacement. The tests hold the guaranteed method
//! to the threshold itself. The quality method does not promise a greatest displacement.
//!
//! # Reports and cases
//! | users reported | where | case |
//! |---|---|---|
//! | levels jump when the camera only turns | godot 81995, 76436 | `rotate only` |
//! | the camera is inside the object's box | godot 88273, 79590 | `inside the box`, and `inside the object` |
//! | a cull margin forces the worst level | godot 67890 | `cull margin` |
//! | orthographic cameras get the worst level | godot 57404 | `orthographic` |
//! | bones or nodes scale a mesh | godot 57895, 59147 | `scaled bones`, `scaled mesh`, `scales` |
//! | zoom is ignored | three.js 18557 | `zoom ignored`, `dolly zoom` |
//! | flicker at a threshold | three.js 14565 | `flicker`, `head-bob`, `taa jitter` |
//! | the window's size decides | cesium 4043 | `window size`, `window resize` |
//! | a narrow field of view refines at random | cesium-native 1138 | `narrow fov` |
//! | one view's level is used in another | bevy 15084 | `shadow view`, `split screen` |
//! | bounds that do not nest drop parts | the rule's documentation | `non-nested` |

mod cameras;
mod case;
mod fixtures;
mod other;
mod reported;
mod run;
mod table;

pub use case::{Case, Fault, Frame, Shot};
pub use fixtures::Fixture;
pub use run::{CaseResult, ObjectRun, Report, Verdict, run};
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
/// The multiple of the threshold that a displacement may reach without a fault.
pub const PROMISE_ALLOWANCE: f64 = 1.5;
/// The multiple of the triangles of the guaranteed cut, or of the coarsest cut, above which they are wasted.
pub const THRIFT_RATIO: f64 = 1.25;
/// Points of a surface at which displacements are measured.
pub const SAMPLES: usize = 8_000;

/// All cases; those that users reported come first.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    reported::CASES.iter().chain(other::CASES)
}
