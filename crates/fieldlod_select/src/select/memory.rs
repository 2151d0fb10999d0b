//! The state of an instance in a view, and the limits within which it stays.

use crate::criterion::limits::{ErrorUnits, Limits};
use crate::hidden::held_shares::LevelShare;
use crate::scene::{InstanceId, MeshId, Scene};

/// How an instance is drawn.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct InstanceMemory {
    pub(crate) state: InstanceState,
    /// The instance in the slot.
    pub(crate) instance: Option<InstanceId>,
    /// Version of the instance at the last decision.
    pub(crate) version: u32,
    /// Visible share of a mesh that is drawn as a whole.
    pub(crate) share: LevelShare,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum InstanceState {
    /// Not selected yet, removed, or on other layers: draws nothing.
    #[default]
    Empty,
    /// Only terminal groups are refined. The scene may have removed the instance since.
    Coarsest(MeshId),
    /// The mesh as a whole at one level, finer than the coarsest.
    AtLevel(MeshId, u8),
    /// A cut of its own, by its key in the pool.
    Mixed(u32),
}

impl InstanceState {
    /// The units drawn without a cut of its own, and their triangles.
    pub(crate) fn drawn_whole(self, scene: &Scene) -> (&[u32], u64) {
        match self {
            Self::Coarsest(mesh) => {
                let table = scene.table(mesh);
                (&table.coarsest_units, table.coarsest_triangle_count)
            }
            Self::AtLevel(mesh, level) => scene.table(mesh).drawn_at_level(usize::from(level)),
            _ => (&[], 0),
        }
    }

    /// The limits of an instance that is not forced to a level. With visible flux, finer levels are decided in each
    /// frame.
    pub(crate) fn limits(
        self,
        scene: &Scene,
        slot: usize,
        units: &ErrorUnits,
        hides: bool,
    ) -> Limits {
        let (mesh, level) = match self {
            Self::Empty => return Limits::EMPTY,
            Self::Mixed(_) => return Limits::UNKNOWN,
            Self::AtLevel(..) if hides => return Limits::UNKNOWN,
            Self::Coarsest(mesh) => (mesh, None),
            Self::AtLevel(mesh, level) => (mesh, Some(usize::from(level))),
        };
        let errors = &scene.table(mesh).level_errors;
        let level = level.unwrap_or(errors.coarsest());
        errors
            .limits(level, units, 1.0)
            .scaled(scene.columns.error_scales[slot])
    }
}
