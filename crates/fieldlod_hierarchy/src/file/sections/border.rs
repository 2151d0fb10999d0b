//! The border of the triangles of a unit that were coded so far.

/// The border of the triangles so far: their edges that no other triangle uses, as that would run
/// through them.
pub(in crate::file) struct Border {
    /// For each vertex, where an edge leads that begins there.
    after: Vec<u16>,
    /// Where one comes from that ends there.
    before: Vec<u16>,
}

impl Border {
    pub(in crate::file) fn new(vertices: usize) -> Self {
        Self {
            after: vec![u16::MAX; vertices],
            before: vec![u16::MAX; vertices],
        }
    }

    /// The vertices that would close a triangle on the edge from `x` to `y` with another one.
    #[inline(always)]
    pub(in crate::file) fn beside(&self, x: u16, y: u16) -> [u16; 2] {
        [self.after[usize::from(y)], self.before[usize::from(x)]]
    }

    /// Adds the edge of a triangle, or takes away the border that it closes.
    #[inline(always)]
    pub(in crate::file) fn add(&mut self, from: u16, to: u16) {
        let (begin, end) = (usize::from(from), usize::from(to));
        if self.after[begin] == to {
            (self.after[begin], self.before[end]) = (u16::MAX, u16::MAX);
        } else {
            (self.after[end], self.before[begin]) = (from, to);
        }
    }
}
