//! Open edges: edges that triangles use more often in one direction than in the other.
//!
//! The edges opposite to a vertex form closed loops unless one of its own edges is open. Each opposite edge adds the
//! hash of its start and subtracts the hash of its end. The sum is zero for closed loops.

/// For each vertex, the sum over its opposite edges: 0 if none of its own edges is open.
pub(crate) struct Links(Vec<u64>);

impl Links {
    pub(crate) fn of(vertex_count: usize) -> Self {
        Self(vec![0; vertex_count])
    }

    /// Adds triangles.
    pub(crate) fn add(&mut self, corners: impl Iterator<Item = u32>) {
        self.pass(corners, u64::wrapping_add);
    }

    /// Removes triangles.
    pub(crate) fn remove(&mut self, corners: impl Iterator<Item = u32>) {
        self.pass(corners, u64::wrapping_sub);
    }

    fn pass(&mut self, mut corners: impl Iterator<Item = u32>, change: impl Fn(u64, u64) -> u64) {
        while let (Some(a), Some(b), Some(c)) = (corners.next(), corners.next(), corners.next()) {
            // Skip degenerate triangles: they use each edge in both directions.
            if a == b || b == c || c == a {
                continue;
            }
            let [at_a, at_b, at_c] = [a, b, c].map(hash_of);
            for (vertex, link) in [
                (a, at_b.wrapping_sub(at_c)),
                (b, at_c.wrapping_sub(at_a)),
                (c, at_a.wrapping_sub(at_b)),
            ] {
                let sum = &mut self.0[vertex as usize];
                *sum = change(*sum, link);
            }
        }
    }

    /// Whether an edge of this vertex is open.
    pub(crate) fn is_open(&self, vertex: u32) -> bool {
        self.0[vertex as usize] != 0
    }
}

/// An edge of a triangle: both ends, the smaller first; whether it runs from the smaller end; the third corner.
pub(crate) type Edge = (u32, u32, bool, u32);

/// The edges of all triangles, sorted. Edges between equal vertices are left out.
pub(crate) fn sorted_edges(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<Edge> {
    let edges = triangles.flat_map(|[a, b, c]| [(a, b, c), (b, c, a), (c, a, b)]);
    let edges = edges.filter(|(from, to, _)| from != to);
    let edges = edges.map(|(from, to, third)| (from.min(to), from.max(to), from < to, third));
    let mut edges: Vec<Edge> = edges.collect();
    edges.sort_unstable();
    edges
}

/// Whether triangles use an edge more often in one direction than in the other. `same` are all edges with its ends.
pub(crate) fn is_unbalanced(same: &&[Edge]) -> bool {
    2 * same.iter().filter(|edge| edge.2).count() != same.len()
}

/// A hash whose sums practically never collide (SplitMix64 by S. Vigna).
pub(crate) fn hash_of(vertex: u32) -> u64 {
    let mut mixed = u64::from(vertex).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_of_open_edges_are_open() {
        let two = [0, 1, 2, 2, 1, 3];
        let tetrahedron = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3];
        for (corners, expected) in [
            (&two[..], [true; 4]),
            (&tetrahedron[..], [false; 4]),
            (&tetrahedron[3..], [true, true, true, false]),
            // A degenerate triangle on an edge.
            (&[tetrahedron.as_slice(), &[0, 1, 1]].concat(), [false; 4]),
        ] {
            let mut links = Links::of(4);
            links.add(corners.iter().copied());
            assert_eq!(
                [0, 1, 2, 3].map(|v| links.is_open(v)),
                expected,
                "{corners:?}"
            );
            links.remove(corners.iter().copied());
            assert_eq!([0, 1, 2, 3].map(|v| links.is_open(v)), [false; 4]);
        }
    }
}
