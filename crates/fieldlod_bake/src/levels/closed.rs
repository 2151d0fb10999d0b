//! Rejects simplifications that open a closed surface.

use rustc_hash::FxHashMap;

use crate::levels::simplify::{Simplified, Task};
use crate::mesh::edges::Links;

impl Task<'_> {
    /// Whether open edges change only on borders of the source, and not on borders that other groups share.
    pub(crate) fn opens_no_edge(&self, simplified: &Simplified) -> bool {
        let welded = |&own: &u32| self.same_position[own as usize];
        let is_border = |own: u32| {
            let vertex = self.piece.vertices[own as usize];
            self.vertices.is_border[vertex as usize]
        };
        let mut links = Links::of(self.piece.vertices.len());
        links.add(self.piece.corners.iter().map(welded));
        links.remove(simplified.corners.iter().map(welded));
        // The difference of both sums is zero where the open edges at a vertex stay the same.
        let firsts = self.same_position.iter().copied();
        let mut changed = firsts.filter(|&own| links.is_open(own));
        changed.all(is_border) && self.keeps_shared_borders(simplified, is_border)
    }

    /// Whether edges between shared vertices on a border of the source stay as they are. Other groups may use these
    /// edges.
    fn keeps_shared_borders(
        &self,
        simplified: &Simplified,
        is_border: impl Fn(u32) -> bool,
    ) -> bool {
        let is_shared = |own: u32| self.is_locked[own as usize] && is_border(own);
        let mut balance: FxHashMap<(u32, u32), i32> = FxHashMap::default();
        for (list, sign) in [(&self.piece.corners, 1), (&simplified.corners, -1)] {
            let (triangles, _) = list.as_chunks::<3>();
            for triangle in triangles {
                let [a, b, c] = triangle.map(|own| self.same_position[own as usize]);
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    if from != to && is_shared(from) && is_shared(to) {
                        let sign = if from < to { sign } else { -sign };
                        *balance.entry((from.min(to), from.max(to))).or_default() += sign;
                    }
                }
            }
        }
        balance.values().all(|&balance| balance == 0)
    }
}
