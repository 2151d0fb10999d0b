//! Codes the vertex lists of units.

use crate::file::sections::numbers::{unzigzag, zigzag};

/// Converts vertex indices to small numbers, and back. The indices count vertices in the order of the file.
pub(crate) struct References {
    /// The next new vertex.
    pub(crate) next: u32,
    /// The last vertex that was coded by its difference.
    last: u32,
}

impl References {
    pub(crate) fn new(vertices: usize) -> Self {
        let next = vertices as u32;
        Self { next, last: next }
    }

    pub(crate) fn number(&mut self, vertex: u32) -> u32 {
        if vertex == self.next {
            self.next += 1;
            return 0;
        }
        let difference = vertex.wrapping_sub(self.last);
        self.last = vertex;
        // 0 is the next new vertex.
        zigzag(difference).wrapping_add(1)
    }

    /// Returns `None` if the vertex is not coded yet.
    pub(crate) fn vertex(&mut self, number: u32) -> Option<u32> {
        if number == 0 {
            self.next = self.next.checked_add(1)?;
            return Some(self.next - 1);
        }
        self.last = self.last.wrapping_add(unzigzag(number - 1));
        (self.last < self.next).then_some(self.last)
    }
}
