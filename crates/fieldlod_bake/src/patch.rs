//! Pieces of the source surface, as they are followed from group to group.

use std::collections::{BTreeMap, HashMap};

/// Neighbouring source triangles that lie under one group. Small, so that the work on a group
/// divides into parts that do not depend on the number of threads.
#[derive(Default)]
pub(crate) struct Patch {
    /// Source vertices, each once.
    pub(crate) vertices: Vec<u32>,
    /// Into `vertices`.
    pub(crate) triangles: Vec<[u16; 3]>,
}

impl Patch {
    /// Of a cluster: a triangle list of source vertices.
    pub(crate) fn of(cluster: &[u32]) -> Self {
        let (vertices, corners) = meshopt::clod_local_indices(cluster);
        let (triangles, _) = corners.as_chunks::<3>();
        let triangles = triangles.iter().map(|corners| corners.map(u16::from));
        Self {
            vertices,
            triangles: triangles.collect(),
        }
    }

    /// Divides the triangles by `part_of`, which is given the index of each.
    pub(crate) fn split(self, part_of: impl Fn(usize) -> u32) -> BTreeMap<u32, Self> {
        let parts: Vec<u32> = (0..self.triangles.len()).map(part_of).collect();
        if let Some(&first) = parts.first()
            && parts.iter().all(|&part| part == first)
        {
            return BTreeMap::from([(first, self)]);
        }
        let mut split: BTreeMap<u32, (Self, HashMap<u16, u16>)> = BTreeMap::new();
        for (triangle, part) in self.triangles.iter().zip(parts) {
            let (patch, slots) = split.entry(part).or_default();
            let corners = triangle.map(|old| {
                *slots.entry(old).or_insert_with(|| {
                    patch.vertices.push(self.vertices[usize::from(old)]);
                    patch.vertices.len() as u16 - 1
                })
            });
            patch.triangles.push(corners);
        }
        let patches = split.into_iter();
        patches.map(|(part, (patch, _))| (part, patch)).collect()
    }
}
