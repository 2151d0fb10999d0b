//! Border edges of the coded triangles of a unit.

/// Edges that only one of the coded triangles uses.
pub(crate) struct Border {
    /// For each vertex, the end of the border edge that starts there.
    after: Vec<u16>,
    /// For each vertex, the start of the border edge that ends there.
    before: Vec<u16>,
}

impl Border {
    pub(crate) fn new(vertices: usize) -> Self {
        Self {
            after: vec![u16::MAX; vertices],
            before: vec![u16::MAX; vertices],
        }
    }

    /// The vertices that close a triangle of the edge from `x` to `y` and a second border edge.
    #[inline(always)]
    pub(crate) fn beside(&self, x: u16, y: u16) -> [u16; 2] {
        [self.after[usize::from(y)], self.before[usize::from(x)]]
    }

    /// Adds the edge of a triangle, or removes the border edge that it closes.
    #[inline(always)]
    pub(crate) fn add(&mut self, from: u16, to: u16) {
        let (begin, end) = (usize::from(from), usize::from(to));
        // A neighbour uses the edge in the other direction, so it is stored turned around.
        if self.after[begin] == to {
            (self.after[begin], self.before[end]) = (u16::MAX, u16::MAX);
        } else {
            (self.after[end], self.before[begin]) = (from, to);
        }
    }
}
