//! Encodes and decodes vertices: rounds, orders and predicts them.
//!
//! Input: vertex attributes. Output: small numbers for the entropy coder.

pub(super) mod attributes;
pub(super) mod octahedron;
pub(super) mod planes;
pub(super) mod predict;
pub(super) mod predictor;
pub(super) mod quantize;
pub(super) mod rows;
pub(super) mod vertex_normals;
pub(super) mod vertex_order;
