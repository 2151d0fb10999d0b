//! Measured samples.

use crate::levels::clusters::Place;
use crate::mesh::triangle_tree::NearestTriangle;

/// A sample on the source, and the nearest triangle of the simplified surface.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    pub(super) place: Place,
    pub(super) nearest: NearestTriangle,
}
