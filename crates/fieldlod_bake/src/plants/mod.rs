//! Plants and other aggregates of many loose elements keep their covered area.
//!
//! In: groups of leaves, blades or gravel to simplify, and finished levels. Out: simplified groups, and errors of
//! levels that are measured on pictures.

pub(crate) mod aggregate;
pub(crate) mod appearance;
pub(crate) mod coverage;
mod curve;
mod cut_out;
pub(crate) mod elements;
pub(crate) mod kits;
pub(crate) mod picture;
pub(crate) mod plant;
pub(crate) mod together;
