//! Encodes and decodes vertices.
//!
//! Input: vertex attributes. Output: columns of numbers for the entropy coder.

pub(super) mod attribute_columns;
pub(super) mod attributes;
pub(super) mod octahedron;
pub(super) mod planes;
pub(super) mod quantize;
