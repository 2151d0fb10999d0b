//! Open edges of cuts, and groups that flip between frames.

use std::collections::HashMap;

use fieldlod_hierarchy::Hierarchy;
use glam::Vec3;

use crate::chooser::Choice;

/// A flip is a change of a group, followed by the opposite change within this many frames: 83 ms at 60 Hz.
pub const FLIP_FRAMES: usize = 5;

/// The number of edges of the drawn triangles without a neighbour of opposite direction. Vertices with equal
/// positions count as one. It is 0 for a cut that covers a closed mesh exactly once.
#[must_use]
pub fn open_edges(hierarchy: &Hierarchy, units: &[u32]) -> u64 {
    let edges = unpaired_edges(hierarchy, units);
    edges.values().map(|edges| edges.unsigned_abs()).sum()
}

/// Edges without a neighbour, by the bits of both ends, and their triangles in one direction minus those in the other.
fn unpaired_edges(hierarchy: &Hierarchy, units: &[u32]) -> HashMap<[[u32; 3]; 2], i64> {
    let positions = &hierarchy.vertices.positions;
    let mut balance: HashMap<[[u32; 3]; 2], i64> = HashMap::new();
    for &unit in units {
        for triangle in hierarchy.triangles_of(&hierarchy.units[unit as usize]) {
            let [a, b, c] = triangle.map(|vertex| position_key(positions[vertex as usize]));
            for (from, to) in [(a, b), (b, c), (c, a)] {
                match from.cmp(&to) {
                    std::cmp::Ordering::Less => *balance.entry([from, to]).or_default() += 1,
                    std::cmp::Ordering::Greater => *balance.entry([to, from]).or_default() -= 1,
                    // The edge of a degenerate triangle has no length and no direction.
                    std::cmp::Ordering::Equal => (),
                }
            }
        }
    }
    balance.retain(|_, edges| *edges != 0);
    balance
}

/// The bits of a position. Adding 0 turns −0 into 0, which is the same position.
fn position_key(position: Vec3) -> [u32; 3] {
    (position + 0.0).to_array().map(f32::to_bits)
}

/// Counts flips of groups.
#[derive(Clone, Debug, Default)]
pub struct FlipCounter {
    last: Vec<bool>,
    /// The frame of each group's last change, and whether the group was in view.
    changed_at: Vec<Option<(usize, bool)>>,
    frames: usize,
    seen: u64,
}

impl FlipCounter {
    /// Adds the next frame. `in_view` returns whether a group touches the picture.
    pub fn add(&mut self, choice: &Choice, in_view: impl Fn(usize) -> bool) {
        // The first frame has no earlier frame to differ from.
        if self.frames == 0 {
            self.changed_at = vec![None; choice.refined.len()];
        } else {
            for (group, &after) in choice.refined.iter().enumerate() {
                if self.last[group] != after {
                    self.change(group, in_view(group));
                }
            }
        }
        self.last.clone_from(&choice.refined);
        self.frames += 1;
    }

    fn change(&mut self, group: usize, in_view: bool) {
        if let Some((at, was_in_view)) = self.changed_at[group]
            && self.frames - at <= FLIP_FRAMES
        {
            self.seen += u64::from(in_view && was_in_view);
        }
        self.changed_at[group] = Some((self.frames, in_view));
    }

    /// The number of flips with the group in the picture at both changes: visible flicker.
    #[must_use]
    pub fn seen(&self) -> u64 {
        self.seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};

    fn frame(refined: bool) -> Choice {
        Choice {
            refined: vec![refined, true],
            units: Vec::new(),
        }
    }

    #[test]
    fn change_back_within_five_frames_is_a_flip() {
        let mut counter = FlipCounter::default();
        let frames = [
            true, false, false, true, true, true, true, true, true, false,
        ];
        for refined in frames {
            counter.add(&frame(refined), |_| true);
        }
        assert_eq!(counter.seen(), 1);
    }

    #[test]
    fn change_back_out_of_view_is_not_seen() {
        let mut counter = FlipCounter::default();
        for (refined, in_view) in [(false, true), (true, true), (false, false)] {
            counter.add(&frame(refined), |_| in_view);
        }
        assert_eq!(counter.seen(), 0);
    }

    #[test]
    fn missing_unit_opens_edges() {
        let hierarchy = bake_mesh(&fixtures::rock(4, 1), &BakeConfig::fine_grained()).unwrap();
        let units = hierarchy.units.iter().enumerate();
        let source = units.filter(|(_, unit)| unit.producer().is_none());
        let mut source: Vec<u32> = source.map(|(index, _)| index as u32).collect();
        assert_eq!(open_edges(&hierarchy, &source), 0);
        source.pop();
        assert!(open_edges(&hierarchy, &source) > 0);
    }
}
