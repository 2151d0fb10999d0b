//! Measurements of level of detail, which check the claims of this project's crates.
//!
//! - [`chart`] compares methods by triangles at equal image error. The baseline is clusterlod on its own
//!   levels.
//! - [`stability`] runs methods in cases in which users of other systems reported failures.
//! - [`promise`] measures the guarantee from random cameras under random placements.
//! - [`characters`] measures the levels of skinned meshes in held-out animations.
//! - [`props`] compares the levels of whole meshes with their sources, by size on screen.
//!
//! Shared modules: [`method`] (the compared methods), [`displacement`] and [`holes`] (geometric errors of a
//! cut), [`render`] (a reference renderer) and [`measure`] (image errors).
//!
//! The command `fieldlod-lab` runs all of them. No other library depends on this crate.

mod baselines;
pub mod characters;
pub mod chart;
pub mod chooser;
pub mod displacement;
pub mod eye;
pub mod holes;
pub mod measure;
pub mod method;
pub mod object;
pub mod object_view;
pub mod promise;
pub mod props;
pub mod render;
pub mod stability;
