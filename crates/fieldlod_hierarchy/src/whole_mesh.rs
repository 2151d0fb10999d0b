//! The mesh as a whole at one level: cuts that keep nothing finer than a level.

use crate::hierarchy::{Group, Hierarchy};

/// A level that keeps more than this share of the triangles of the one before is left out.
const MOST_KEPT: f32 = 0.75;

/// The whole mesh at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct WholeMeshCut {
    /// Groups below this level are refined no more.
    pub group_level: u32,
    /// Triangles as indices into [`Hierarchy::vertices`].
    pub triangles: Vec<[u32; 3]>,
}

impl Hierarchy {
    /// The levels of the mesh as a whole, finest first, each with three quarters of the triangles of
    /// the one before at most.
    #[must_use]
    pub fn whole_mesh_cuts(&self) -> Vec<WholeMeshCut> {
        let mut kept: Vec<WholeMeshCut> = Vec::new();
        for group_level in 0..self.level_count() {
            let triangles = self.triangles_from_level(group_level);
            let most = kept
                .last()
                .map(|last| last.triangles.len() as f32 * MOST_KEPT);
            if most.is_none_or(|most| triangles.len() as f32 <= most) {
                kept.push(WholeMeshCut {
                    group_level,
                    triangles,
                });
            }
        }
        kept
    }

    /// The largest of the groups that are refined no more from `group_level` on; 0 of none.
    #[must_use]
    pub fn largest_below(&self, group_level: u32, length: impl Fn(&Group) -> f32) -> f32 {
        let simplified = self.groups.iter();
        simplified
            .filter(|group| group.level < group_level && !group.is_terminal())
            .map(length)
            .fold(0.0, f32::max)
    }

    /// The cut that keeps nothing finer than `group_level`, unless there is nothing coarser.
    fn triangles_from_level(&self, group_level: u32) -> Vec<[u32; 3]> {
        let is_coarse = |group: &Group| group.level >= group_level;
        let mut refined: Vec<bool> = self.groups.iter().map(is_coarse).collect();
        self.close_refinement(&mut refined);
        let units = self.drawn_units(&refined);
        units
            .flat_map(|unit| self.triangles_of(&self.units[unit]))
            .collect()
    }
}
