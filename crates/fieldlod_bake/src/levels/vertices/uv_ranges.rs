//! Texture coordinates stay within the part of the texture that their piece of surface shows: the simplifier extrapolates
//! them where vertices move, and beside a leaf or a strand of hair in an atlas lies another.

use crate::levels::vertices::attributes::AttributeLayout;
use crate::levels::vertices::{LevelVertices, Piece};
use crate::mesh::topology::first_of;

/// The ranges of texture coordinates of a group, by the pieces of surface that seams and borders leave.
pub(crate) struct UvRanges {
    /// For each own vertex, the first of its piece of surface.
    piece: Vec<u32>,
    /// For the first of each piece, the least and the greatest numbers of its rows.
    ranges: Vec<Option<[Vec<f32>; 2]>>,
}

impl UvRanges {
    /// Those of a group; `None` without texture coordinates.
    pub(crate) fn of(group: &Piece, vertices: &LevelVertices) -> Option<Self> {
        if !vertices.layout.has_uvs() {
            return None;
        }
        let count = group.vertices.len() as u32;
        let mut piece: Vec<u32> = (0..count).collect();
        for triangle in group.corners.as_chunks::<3>().0 {
            for pair in triangle.windows(2) {
                let [a, b] = [pair[0], pair[1]].map(|v| first_of(&mut piece, v));
                piece[a.max(b) as usize] = a.min(b);
            }
        }
        let mut ranges: Vec<Option<[Vec<f32>; 2]>> = vec![None; count as usize];
        for own in 0..count {
            let first = first_of(&mut piece, own);
            piece[own as usize] = first;
            let row = vertices.row(group.vertices[own as usize]);
            let range = ranges[first as usize].get_or_insert_with(|| [row.to_vec(), row.to_vec()]);
            for (number, &at) in row.iter().enumerate() {
                range[0][number] = range[0][number].min(at);
                range[1][number] = range[1][number].max(at);
            }
        }
        Some(Self { piece, ranges })
    }

    /// Brings the texture coordinates of an own vertex, in its new row, back into the range of its piece.
    pub(crate) fn clamp(&self, own: usize, row: &mut [f32], layout: &AttributeLayout) {
        if let Some([least, greatest]) = &self.ranges[self.piece[own] as usize] {
            layout.clamp_uvs(row, least, greatest);
        }
    }
}
