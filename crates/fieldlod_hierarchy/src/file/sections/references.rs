//! The vertex lists of units.

use crate::file::sections::numbers::{unzigzag, zigzag};

/// Vertices of units, named in the order in which they are coded.
pub(in crate::file) struct References {
    pub(in crate::file) next: u32,
    before: u32,
}

impl References {
    pub(in crate::file) fn new(vertices: usize) -> Self {
        let next = vertices as u32;
        Self { next, before: next }
    }

    pub(in crate::file) fn number(&mut self, vertex: u32) -> u32 {
        if vertex == self.next {
            self.next += 1;
            return 0;
        }
        let difference = vertex.wrapping_sub(self.before);
        self.before = vertex;
        zigzag(difference).wrapping_add(1)
    }

    /// `None` for a vertex that was not coded yet.
    pub(in crate::file) fn vertex(&mut self, number: u32) -> Option<u32> {
        if number == 0 {
            self.next = self.next.checked_add(1)?;
            return Some(self.next - 1);
        }
        self.before = self.before.wrapping_add(unzigzag(number - 1));
        (self.before < self.next).then_some(self.before)
    }
}
