//! The levels of detail of mesh assets, and the components of the entities that share them.

use std::any::Any;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use bevy::asset::AssetId;
use bevy::camera::primitives::Aabb;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{InstanceId, MeshId};

use crate::api::auto_lod::AutoLod;
use crate::api::config::LodKind;
use crate::lock;
use crate::scene::rig::Rig;
use crate::scene::unit_mesh::UnitMeshes;

/// What an opt-in feature keeps of the levels of every mesh. The feature inserts it before meshes are prepared.
#[derive(Resource, Clone, Copy)]
pub(crate) struct KeepOfLevels(pub(crate) fn(&Hierarchy) -> Kept);

pub(crate) type Kept = Arc<dyn Any + Send + Sync>;

/// The levels of detail of one mesh asset.
#[derive(Debug)]
pub(crate) struct LodMesh {
    /// The mesh in the scene that cuts are selected from.
    pub(crate) id: MeshId,
    /// [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
    pub(crate) kind: LodKind,
    /// `None` unless joints or morph targets move the vertices.
    pub(crate) rig: Option<Rig>,
    /// One per unit of the hierarchy.
    pub(crate) pieces: Vec<LodPiece>,
    /// The meshes of resident units. Units of pages are uploaded and evicted at run time. It lacks the finest level of a
    /// whole mesh, which is the source mesh, and units whose meshes are made when views draw them.
    pub(crate) meshes: Mutex<HashMap<u32, Handle<Mesh>>>,
    /// Makes the meshes of units; `None` for whole meshes and for `.fieldpages` files.
    pub(crate) units: Option<UnitMeshes>,
    /// Whether a cache or a file has the levels, so that they can be loaded again.
    pub(crate) is_stored: bool,
    /// Triangles of the source mesh.
    pub(crate) triangles_full: u32,
    /// Whether its bake measured deviations.
    pub(crate) is_measured: bool,
    /// By [`KeepOfLevels`].
    pub(crate) kept: Option<Kept>,
    /// Whether the GPU has the [`meshes`](Self::meshes) that preparation made. The render world sets it.
    pub(crate) uploaded: Arc<AtomicBool>,
}

/// Properties of one unit.
#[derive(Debug)]
pub(crate) struct LodPiece {
    /// The box around it in local space, once it is known.
    pub(crate) aabb: OnceLock<Aabb>,
    /// 0 is the finest.
    pub(crate) level: u32,
    /// Geometric error against the source in local units. Debug views paint it.
    #[cfg(feature = "debug")]
    pub(crate) error_in_local: f32,
}

impl LodPiece {
    /// The box around it in local space; empty while it is not known.
    pub(crate) fn aabb(&self) -> Aabb {
        self.aabb.get().copied().unwrap_or_default()
    }
}

impl LodMesh {
    /// The mesh of a level of a whole mesh; `None` if it is the source.
    pub(crate) fn mesh_at(&self, level: u32) -> Option<AssetId<Mesh>> {
        lock(&self.meshes).get(&level).map(Handle::id)
    }

    /// The mesh of a unit; `None` if it is not made, or not resident.
    pub(crate) fn mesh_of_unit(&self, unit: u32) -> Option<Handle<Mesh>> {
        lock(&self.meshes).get(&unit).cloned()
    }

    pub(crate) fn is_uploaded(&self) -> bool {
        self.uploaded.load(Ordering::Acquire)
    }
}

/// The state of a mesh entity under an [`AutoLod`](crate::AutoLod). The plugin keeps it up to date.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn fade_in(statues: Query<(&LodState, &mut Visibility), Changed<LodState>>) {
///     for (state, mut visibility) in statues {
///         *visibility = match state {
///             LodState::Waiting => Visibility::Hidden,
///             _ => Visibility::Inherited,
///         };
///     }
/// }
/// # bevy::ecs::system::assert_is_system(fade_in);
/// ```
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, PartialEq)]
pub enum LodState {
    /// Its mesh is being loaded, baked or uploaded. The source mesh is drawn.
    Waiting,
    /// The source mesh is drawn: it is small, changes often, or its [`AutoLod::kind`] is [`LodKind::Plain`].
    Plain,
    /// The source mesh is drawn: it cannot have levels of detail. [`LodFailed`](crate::LodFailed) tells the reason.
    Failed,
    /// It has levels of detail: [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
    Ready(LodKind),
}

/// A mesh entity that waits for its levels of detail.
#[derive(Component)]
pub(crate) struct LodWaiting {
    /// The settings that apply to it.
    pub(crate) auto_lod: AutoLod,
}

/// A mesh entity with levels of detail.
#[derive(Component)]
#[require(LodPlacement)]
pub(crate) struct LodObject {
    pub(crate) mesh: Arc<LodMesh>,
    /// The [`Mesh3d`] that the levels were made from.
    pub(crate) source: AssetId<Mesh>,
    /// The settings that apply to it.
    pub(crate) auto_lod: AutoLod,
}

/// The instance of a [`LodObject`] in the scene; `None` until it is placed. It is a component of its own, so that
/// updating moved objects reads little memory. Clones of the entity do not copy it.
#[derive(Component, Default)]
pub(crate) struct LodPlacement(pub(crate) Option<InstanceId>);

impl LodObject {
    /// Whether it is drawn as units.
    pub(crate) fn has_units(&self) -> bool {
        self.mesh.kind == LodKind::Clusters
    }
}
