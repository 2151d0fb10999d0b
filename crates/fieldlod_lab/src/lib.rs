//! Measures: what the level-of-detail crates claim, drawn and counted.
//!
//! - [`paper`] redraws the figures of Lin & Lee, "Camera-Sampling Field and Its Applications"
//!   (IEEE TVCG 2004) from the formulas of `camera_field`, and gives the numbers behind them.
//!
//! Everything here is a measure or a picture of other crates' work; no other library depends on it.

pub mod paper;
