//! The whole crate in `f64`, on glam's `DVec3`.
//!
//! The same source files are compiled with other type aliases, so both versions have the same
//! formulas. The tests use this version, to separate errors of formulas from errors of rounding.
#![expect(
    clippy::duplicate_mod,
    reason = "each formula has one source file, compiled for f32 and f64"
)]

mod scalar {
    pub(super) type Real = f64;
    pub(super) use glam::{DMat3 as Mat3, DMat4 as Mat4, DVec2 as Vec2, DVec3 as Vec3};
}

#[path = "formulas/mod.rs"]
mod formulas;

pub use formulas::*;
