//! Clamps texture coordinates to the part of the texture that their patch uses. The simplifier extrapolates them if
//! vertices move. In an atlas, they would then reach the texels of another leaf or strand of hair.

use crate::levels::vertices::attributes::AttributeLayout;
use crate::levels::vertices::{LevelVertices, Piece};
use crate::mesh::topology::find_first;

/// Ranges of texture coordinates in a group. Patches end at seams and borders.
pub(crate) struct UvRanges {
    /// For each own vertex, the first vertex of its patch.
    piece: Vec<u32>,
    /// For the first vertex of each patch, the minimum and maximum of its rows.
    ranges: Vec<Option<[Vec<f32>; 2]>>,
}

impl UvRanges {
    /// Ranges of a group; `None` without texture coordinates.
    pub(crate) fn of(group: &Piece, vertices: &LevelVertices) -> Option<Self> {
        if !vertices.layout.has_uvs() {
            return None;
        }
        let count = group.vertices.len() as u32;
        let mut piece: Vec<u32> = (0..count).collect();
        for triangle in group.corners.as_chunks::<3>().0 {
            for pair in triangle.windows(2) {
                let [a, b] = [pair[0], pair[1]].map(|v| find_first(&mut piece, v));
                piece[a.max(b) as usize] = a.min(b);
            }
        }
        let mut ranges: Vec<Option<[Vec<f32>; 2]>> = vec![None; count as usize];
        for own in 0..count {
            let first = find_first(&mut piece, own);
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

    /// Clamps the texture coordinates in `row` to the range of the own vertex's patch.
    pub(crate) fn clamp(&self, own: usize, row: &mut [f32], layout: &AttributeLayout) {
        if let Some([least, greatest]) = &self.ranges[self.piece[own] as usize] {
            layout.clamp_uvs(row, least, greatest);
        }
    }
}
