//! What a selector keeps between frames.

use super::share_memory::LevelShare;
use crate::scene::{MeshId, Scene};
use crate::validity::Validity;

/// What an instance draws.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InstanceMemory {
    pub(super) state: InstanceState,
    /// Which of the instances that had the index one after the other.
    pub(super) generation: u32,
    /// What counts of it while it is drawn [at a level](InstanceState::AtLevel), if hidden things count less, or at
    /// its coarsest because of that.
    pub(super) share: Option<LevelShare>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum InstanceState {
    /// Not selected yet, or removed: draws nothing.
    #[default]
    Empty,
    /// Too small to be drawn.
    Culled,
    /// Only what always is refined is refined. The scene may have removed the instance since.
    Coarsest(MeshId),
    /// The mesh as a whole at one level, finer than the coarsest.
    AtLevel(MeshId, u8),
    /// A cut of its own, by its key in the pool.
    Mixed(u32),
}

/// What the last visit to a node, or to an instance by itself, found.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeMemory {
    pub(super) validity: Validity,
    pub(super) below: Below,
}

/// What all instances below a node have in common, but for empty ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Below {
    /// They are at their coarsest.
    Coarsest,
    /// They are too small to be drawn.
    Culled,
    /// Nothing that is known.
    Mixed,
}

impl InstanceMemory {
    /// What a visit to the instance has found, for the nodes above: where it rests on what is visible, there is
    /// another visit in each frame.
    pub(super) fn for_node(&self, found: NodeMemory) -> NodeMemory {
        match self.share {
            Some(_) => NodeMemory::new(found.below),
            None => found,
        }
    }
}

/// An instance to be decided group by group.
#[derive(Debug)]
pub(super) struct Pending {
    pub(super) instance: u32,
    /// Where it stands in the tree.
    pub(super) position: usize,
    pub(super) was: InstanceState,
    /// Whether the instance has changed since it was decided last.
    pub(super) has_moved: bool,
    /// What is visible of all of it, if that was asked.
    pub(super) share: Option<u8>,
    /// The level that it is to be drawn at, if that is forced.
    pub(super) forced_level: Option<u32>,
    /// For how long it is large enough to be drawn.
    pub(super) size_validity: Validity,
    /// The key of its cut in the pool.
    pub(super) cut: u32,
}

impl InstanceState {
    /// The units drawn without a cut of one's own, and their triangles.
    pub(super) fn drawn_whole(self, scene: &Scene) -> (&[u32], u64) {
        match self {
            Self::Coarsest(mesh) => {
                let table = scene.table(mesh);
                (&table.coarsest_units, table.coarsest_triangle_count)
            }
            Self::AtLevel(mesh, level) => scene.table(mesh).drawn_at_level(usize::from(level)),
            _ => (&[], 0),
        }
    }

    /// What a node of this instance alone says of it.
    pub(super) fn below(self) -> Below {
        match self {
            Self::Culled => Below::Culled,
            Self::Empty | Self::Coarsest(_) => Below::Coarsest,
            Self::AtLevel(..) | Self::Mixed(_) => Below::Mixed,
        }
    }

    /// Whether a view draws it.
    pub(super) fn is_drawn(self) -> bool {
        matches!(self, Self::Coarsest(_) | Self::AtLevel(..) | Self::Mixed(_))
    }
}

impl NodeMemory {
    pub(super) fn new(below: Below) -> Self {
        Self {
            validity: Validity::NONE,
            below,
        }
    }
}
