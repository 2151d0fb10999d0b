//! Clamps texture coordinates to the part of the texture that their patch uses. The simplifier extrapolates them if
//! vertices move. Without the clamp, they would reach texels of another leaf or strand of hair in an atlas.

use crate::levels::vertices::attributes::AttributeLayout;
use crate::levels::vertices::{LevelVertices, Piece};
use crate::mesh::components::connected;

/// Ranges of texture coordinates in a group. Patches end at seams and borders.
pub(crate) struct UvRanges {
    /// For each own vertex, the first vertex of its patch.
    patch: Vec<u32>,
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
        // Corners of one triangle have continuous texture coordinates: seams have two vertices at one position.
        let patch = connected((0..count).collect(), group.corners.as_chunks().0);
        let mut ranges: Vec<Option<[Vec<f32>; 2]>> = vec![None; count as usize];
        for own in 0..count {
            let row = vertices.row(group.vertices[own as usize]);
            let first = patch[own as usize] as usize;
            let range = ranges[first].get_or_insert_with(|| [row.to_vec(), row.to_vec()]);
            for (number, &at) in row.iter().enumerate() {
                range[0][number] = range[0][number].min(at);
                range[1][number] = range[1][number].max(at);
            }
        }
        Some(Self { patch, ranges })
    }

    /// Clamps the texture coordinates in `row` to the range of the own vertex's patch.
    pub(crate) fn clamp(&self, own: usize, row: &mut [f32], layout: &AttributeLayout) {
        if let Some([least, greatest]) = &self.ranges[self.patch[own] as usize] {
            layout.clamp_uvs(row, least, greatest);
        }
    }
}
