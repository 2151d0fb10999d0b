//! Measures: what the level-of-detail crates claim, drawn and counted.
//!
//! - [`paper`] redraws the figures of Lin & Lee, "Camera-Sampling Field and Its Applications"
//!   (IEEE TVCG 2004) from the formulas of `camera_field`, and gives the numbers behind them.
//! - [`method`] lists the methods that are compared: ours, ours without one of its terms, and those of
//!   other systems.
//! - [`displacement`] measures how far a cut lies from its source on the screen, [`holes`] where it
//!   is open and what flickers.
//! - [`promise`] measures the guarantee with random cameras and placements.
//! - [`chart`] charts speed against accuracy, by the pictures that [`render`] draws and [`measure`]
//!   compares; clusterlod, with the levels that it builds itself, is its baseline.
//! - [`props`] draws the levels of whole meshes beside their sources, by size on screen.
//! - [`scenes`] measures what it is worth to know what hides what, in worlds of several objects.
//! - [`stability`] runs every method through the cases in which users of some saw them fail.
//!
//! The command `fieldlod-lab` runs all of it. No other library depends on this one.

mod baselines;
mod canvas;
pub mod chart;
pub mod chooser;
pub mod displacement;
pub mod eye;
mod files;
pub mod holes;
pub mod measure;
pub mod method;
pub mod object;
pub mod object_view;
mod oracle;
pub mod paper;
mod plot;
pub mod promise;
pub mod props;
pub mod render;
pub mod scenes;
pub mod stability;
pub mod terms;

pub use files::WriteError;
