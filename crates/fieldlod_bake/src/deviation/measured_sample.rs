//! Measured samples.

use crate::levels::clusters::Sample;
use crate::mesh::triangle_tree::NearestTriangle;

/// A sample on the source, and the nearest triangle of the simplified surface.
#[derive(Clone, Copy)]
pub(super) struct MeasuredSample {
    pub(super) sample: Sample,
    pub(super) nearest: NearestTriangle,
}
