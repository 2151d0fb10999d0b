//! The state of an instance in a view, and the limits within which it stays.

use super::frame::Frame;
use crate::criterion::limits::Limits;
use crate::scene::{InstanceId, MeshId, Scene};

/// The instance in a slot and how it is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceMemory {
    pub(crate) instance: InstanceId,
    pub(crate) state: InstanceState,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum InstanceState {
    /// The instance was not selected yet, was removed, or is on other layers: nothing is drawn.
    Empty,
    /// Only terminal groups are refined. The scene may have removed the instance since.
    Coarsest(MeshId),
    /// The mesh is drawn as a whole at one level, finer than the coarsest.
    AtLevel(MeshId, u8),
    /// The instance has a cut in the pool, with this key.
    Mixed(u32),
}

impl InstanceState {
    /// The mesh of `Coarsest` and `AtLevel`.
    pub(crate) fn mesh(self) -> Option<MeshId> {
        match self {
            Self::Coarsest(mesh) | Self::AtLevel(mesh, _) => Some(mesh),
            Self::Empty | Self::Mixed(_) => None,
        }
    }

    /// The units of `Coarsest` and `AtLevel`, and the number of their triangles.
    pub(crate) fn drawn_whole(self, scene: &Scene) -> (&[u32], u64) {
        match self {
            Self::Coarsest(mesh) => {
                let table = scene.table(mesh);
                (&table.coarsest_units, table.coarsest_triangle_count)
            }
            Self::AtLevel(mesh, level) => scene.table(mesh).drawn_at_level(usize::from(level)),
            Self::Empty | Self::Mixed(_) => (&[], 0),
        }
    }

    /// The limits within which an instance keeps the state just decided.
    pub(crate) fn limits(self, frame: &Frame, slot: usize) -> Limits {
        match self {
            Self::Empty => Limits::EMPTY,
            // No error changes a forced level, but groups may become available.
            Self::Mixed(_) if frame.scene.is_in_parts(slot) => Limits::UNKNOWN,
            _ if frame.settings.forced_level.is_some() => Limits::FIXED,
            _ => self
                .limits_in_local(frame)
                .scaled(frame.scene.columns.error_scales[slot]),
        }
    }

    /// The limits in local units, without a forced level. With weights, finer levels are decided in each frame.
    pub(super) fn limits_in_local(self, frame: &Frame) -> Limits {
        let (mesh, level) = match self {
            Self::Empty => return Limits::EMPTY,
            Self::Coarsest(mesh) => (mesh, None),
            Self::AtLevel(mesh, level)
                if !frame.is_weighed() && frame.scene.table(mesh).is_chain() =>
            {
                (mesh, Some(usize::from(level)))
            }
            Self::Mixed(_) | Self::AtLevel(..) => return Limits::UNKNOWN,
        };
        let errors = &frame.scene.table(mesh).level_errors;
        errors.limits(level.unwrap_or(errors.coarsest()), &frame.units)
    }
}
