//! What a selector keeps between frames.

use crate::scene::{MeshId, Scene};
use crate::validity::Validity;

/// What an instance draws.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InstanceMemory {
    pub(super) state: InstanceState,
    /// Which of the instances that had the index one after the other.
    pub(super) generation: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum InstanceState {
    /// Not selected yet, or removed: draws nothing.
    #[default]
    Empty,
    /// Only what always is refined is refined. The scene may have removed the instance since.
    Coarsest(MeshId),
    /// A cut of its own, by its key in the pool.
    Mixed(u32),
}

/// What the last visit to a node found.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeMemory {
    pub(super) validity: Validity,
    /// All instances below are empty or at their coarsest.
    pub(super) is_coarsest: bool,
}

/// An instance to be decided group by group.
#[derive(Debug)]
pub(super) struct Pending {
    pub(super) instance: u32,
    pub(super) was: InstanceState,
    /// Whether the instance has changed since it was decided last.
    pub(super) has_moved: bool,
    /// What is visible of all of it, if that was asked.
    pub(super) share: Option<u8>,
    /// The key of its cut in the pool.
    pub(super) cut: u32,
}

impl InstanceState {
    /// The units drawn without a cut of one's own, and their triangles.
    pub(super) fn coarsest(self, scene: &Scene) -> (&[u32], u64) {
        match self {
            Self::Coarsest(mesh) => {
                let table = scene.table(mesh);
                (&table.coarsest_units, table.coarsest_triangle_count)
            }
            _ => (&[], 0),
        }
    }
}

impl NodeMemory {
    pub(super) fn new(is_coarsest: bool) -> Self {
        Self {
            validity: Validity::NONE,
            is_coarsest,
        }
    }
}
