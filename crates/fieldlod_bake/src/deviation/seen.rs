//! Measured places.

use crate::levels::clusters::Place;
use crate::mesh::triangle_tree::NearestTriangle;

/// A place, and what of the simplified surface is nearest to it.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    pub(super) place: Place,
    pub(super) nearest: NearestTriangle,
}
