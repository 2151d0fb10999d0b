//! Vertices as numbers: rounded, ordered, and predicted from their neighbours.
//!
//! In: the attributes of vertices. Out: small numbers to pack, and back.

pub(super) mod attributes;
pub(super) mod octahedron;
pub(super) mod planes;
pub(super) mod predict;
pub(super) mod predictor;
pub(super) mod quantize;
pub(super) mod rows;
pub(super) mod vertex_normals;
pub(super) mod vertex_order;
