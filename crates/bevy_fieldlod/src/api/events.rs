//! Messages and events: which meshes and entities have levels of detail, and why others have none.

use bevy::asset::AssetId;
use bevy::mesh::{MeshAccessError, PrimitiveTopology};
use bevy::prelude::*;
use fieldlod_hierarchy::FileError;
use thiserror::Error;

use crate::api::config::LodKind;

/// The source of the levels of detail of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Reflect)]
#[reflect(Clone, PartialEq)]
pub enum LodOrigin {
    /// The file that [`AutoLod::baked`](crate::AutoLod::baked) or a [`LodMesh3d`](crate::LodMesh3d) names.
    File,
    /// A `.fieldlod` file beside the asset, or a chunk that the asset processor added to the asset.
    BesideAsset,
    /// An entry in [`FieldLodAppConfig::cache_folder`](crate::FieldLodAppConfig::cache_folder).
    Cache,
    /// A bake in a background task.
    Baked,
}

/// The result of the preparation of a mesh. Read it with a [`MessageReader`]. Failures are also logged.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn count_failures(mut events: MessageReader<FieldLodEvent>, mut failures: Local<u32>) {
///     for event in events.read() {
///         if let FieldLodEvent::Failed { path, error, .. } = event {
///             *failures += 1;
///             println!("{path:?}: {error}");
///         }
///     }
/// }
/// # bevy::ecs::system::assert_is_system(count_failures);
/// ```
#[derive(Message, Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FieldLodEvent {
    /// The mesh has levels of detail. They are drawn once they are uploaded.
    Ready {
        /// The mesh.
        mesh: AssetId<Mesh>,
        /// Its asset path, if it was loaded from a file.
        path: Option<String>,
        /// [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
        kind: LodKind,
        /// The source of its levels.
        origin: LodOrigin,
    },
    /// The mesh could not be prepared. Its source is drawn.
    Failed {
        /// The mesh.
        mesh: AssetId<Mesh>,
        /// Its asset path, if it was loaded from a file.
        path: Option<String>,
        /// Why it has no levels of detail.
        error: LodError,
    },
}

/// An entity got levels of detail.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let statue = assets.load(GltfAssetLabel::Scene(0).from_asset("statue.glb"));
///     // The event is triggered on each mesh entity, and propagates to its parents.
///     commands
///         .spawn((WorldAssetRoot(statue), AutoLod::default()))
///         .observe(|ready: On<LodReady>| println!("{:?}", ready.original_event_target()))
///         .observe(|failed: On<LodFailed>| println!("{}", failed.error));
/// }
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(EntityEvent, Clone, Debug, PartialEq)]
#[entity_event(propagate, auto_propagate)]
pub struct LodReady {
    /// The mesh entity, or the ancestor that the event has propagated to.
    pub entity: Entity,
    /// [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
    pub kind: LodKind,
}

/// The mesh of an entity could not be prepared. See [`LodReady`].
#[derive(EntityEvent, Clone, Debug, PartialEq)]
#[entity_event(propagate, auto_propagate)]
pub struct LodFailed {
    /// The mesh entity, or the ancestor that the event has propagated to.
    pub entity: Entity,
    /// The cause.
    pub error: LodError,
}

/// Why a mesh has no levels of detail.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LodError {
    /// The vertices are on the GPU only.
    #[error("its data is not in main memory; load it with `RenderAssetUsages::MAIN_WORLD`")]
    NotInMainWorld,
    /// The mesh consists of points, lines or strips.
    #[error("its topology is {0:?}, not a triangle list")]
    Topology(PrimitiveTopology),
    /// The mesh is skinned or has morph targets, and has no glTF file or differs from it.
    #[error("it is skinned or has morph targets, and differs from its glTF file or has none")]
    Rigged,
    /// There are no positions, or they are not three floats each.
    #[error("it has no positions of three 32-bit floats")]
    NoPositions,
    /// An attribute does not have one value per position.
    #[error("its attribute {attribute} does not have one value per vertex position")]
    AttributeCount {
        /// The name of the attribute.
        attribute: &'static str,
    },
    /// The file contains other meshes, or another version of this mesh.
    #[error("{file} has no hierarchy for it; the file is stale, bake it again")]
    Stale {
        /// The `.fieldlod` file.
        file: String,
    },
    /// The mesh has vertex attributes that the baked mesh did not have.
    #[error("{file} lacks some of its vertex attributes; the file is stale, bake it again")]
    MissingAttributes {
        /// The `.fieldlod` file.
        file: String,
    },
    /// The file could not be loaded. The log has the cause.
    #[error("{file} could not be loaded")]
    FileNotLoaded {
        /// The `.fieldlod`, `.fieldpages` or glTF file.
        file: String,
    },
    /// The glTF file, which the bake of a character reads, is invalid.
    #[error("could not read {file}: {fault}")]
    InvalidGltf {
        /// The glTF file.
        file: String,
        /// The cause.
        fault: String,
    },
    /// The file does not contain the primitive.
    #[error("{file} has no primitive {primitive} of a mesh {mesh}")]
    NoPrimitive {
        /// The `.fieldlod` or `.fieldpages` file.
        file: String,
        /// Index of the mesh.
        mesh: u32,
        /// Index of the primitive in the mesh.
        primitive: u32,
    },
    /// A `.fieldpages` file needs a [`LodMesh3d`](crate::LodMesh3d) and
    /// [`FieldLodPagesPlugin`](crate::FieldLodPagesPlugin).
    #[error("{file} is a .fieldpages file, which needs LodMesh3d and FieldLodPagesPlugin")]
    InPages {
        /// The `.fieldpages` file.
        file: String,
    },
    /// The coarsest level of the mesh could not be read.
    #[error("could not read the coarsest level from {file}: {fault}")]
    Unreadable {
        /// The `.fieldpages` file.
        file: String,
        /// The cause.
        fault: FileError,
    },
    /// The mesh cannot be baked.
    #[cfg(feature = "bake")]
    #[error(transparent)]
    Bake(#[from] fieldlod_bake::MeshError),
    /// No matching file was found, and
    /// [`FieldLodAppConfig::bake_at_run_time`](crate::FieldLodAppConfig::bake_at_run_time) or the `bake` feature is
    /// disabled.
    #[error("no matching .fieldlod file was found, and meshes are not baked at run time")]
    BakeDisabled,
}

impl From<MeshAccessError> for LodError {
    fn from(_: MeshAccessError) -> Self {
        Self::NotInMainWorld
    }
}

impl LodError {
    /// Whether the mesh is valid, but of a kind that cannot have levels of detail.
    pub(crate) fn is_unsupported(&self) -> bool {
        matches!(
            self,
            Self::NotInMainWorld | Self::Topology(_) | Self::Rigged
        )
    }
}

impl FieldLodEvent {
    /// The event of a failure. `FailureLog` logs it, with the name of an entity.
    pub(crate) fn failed(assets: &AssetServer, mesh: AssetId<Mesh>, error: LodError) -> Self {
        let path = asset_path(assets, mesh);
        Self::Failed { mesh, path, error }
    }
}

/// The asset path of a mesh, if it was loaded from a file.
pub(crate) fn asset_path(assets: &AssetServer, mesh: AssetId<Mesh>) -> Option<String> {
    assets.get_path(mesh).map(|path| path.to_string())
}

/// The path of an asset, or its id if it was created at run time.
pub(crate) fn asset_name<A: Asset>(assets: &AssetServer, id: AssetId<A>) -> String {
    match assets.get_path(id) {
        Some(path) => path.to_string(),
        None => id.to_string(),
    }
}
