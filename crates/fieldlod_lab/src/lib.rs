//! Measures: what the level-of-detail crates claim, drawn and counted.
//!
//! - [`paper`] redraws the figures of Lin & Lee, "Camera-Sampling Field and Its Applications"
//!   (IEEE TVCG 2004) from the formulas of `camera_field`, and gives the numbers behind them.
//! - [`rivals`] are the criteria of other systems, written on our hierarchies.
//! - [`displacement`] measures how far a cut lies from its source on the screen, [`holes`] where it
//!   is open and what flickers.
//! - [`promise`] measures the guarantee with random cameras and placements.
//! - [`stability`] runs every method through the cases in which users of some saw them fail.
//!
//! Everything here is a measure or a picture of other crates' work; no other library depends on it.

mod canvas;
pub mod chart;
pub mod displacement;
mod files;
pub mod holes;
pub mod measure;
pub mod paper;
pub mod promise;
pub mod render;
pub mod rivals;
pub mod stability;

pub use files::WriteError;
