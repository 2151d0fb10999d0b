//! Pieces of the source surface, as they are followed from group to group.

use std::ops::Range;

/// A source vertex that simplification has removed, and a corner near it of the surface that
/// stands for it.
#[derive(Clone, Copy)]
pub(crate) struct Rider {
    pub(crate) vertex: u32,
    pub(crate) on: u32,
}

/// The part of the source that lies under one group.
#[derive(Default)]
pub(crate) struct Patch {
    pub(crate) riders: Vec<Rider>,
    /// Source triangles of which all corners lie under the group.
    pub(crate) inside: Vec<u32>,
    /// Source triangles that lie partly under other groups.
    pub(crate) across: Vec<u32>,
}

impl Patch {
    /// Of `patches` and of some source triangles that no group has simplified yet.
    pub(crate) fn merge(patches: Vec<Self>, fresh: Range<u32>) -> Self {
        let mut patches = patches.into_iter();
        let mut merged = patches.next().unwrap_or_default();
        for patch in patches {
            merged.riders.extend(patch.riders);
            merged.inside.extend(patch.inside);
            merged.across.extend(patch.across);
        }
        // What lay across two groups may come from both.
        merged.across.sort_unstable();
        merged.across.dedup();
        merged.inside.extend(fresh);
        merged
    }

    pub(crate) fn triangles(&self) -> impl Iterator<Item = u32> + '_ {
        self.inside.iter().chain(&self.across).copied()
    }
}
