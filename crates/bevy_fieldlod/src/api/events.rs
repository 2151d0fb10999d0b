//! Messages about meshes: which have levels of detail, and why others have none.

use std::time::Duration;

use bevy::asset::{AssetId, UntypedAssetId};
use bevy::mesh::{MeshAccessError, PrimitiveTopology};
use bevy::prelude::*;
use fieldlod_hierarchy::FileError;
use thiserror::Error;

use crate::api::config::LodKind;

/// Where the levels of detail of a mesh came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Reflect)]
#[reflect(Clone, PartialEq)]
pub enum LodOrigin {
    /// The file that [`AutoLod::baked`](crate::AutoLod::baked) names.
    File,
    /// A `.fieldlod` file beside the asset, or what the asset processor put into the asset.
    BesideAsset,
    /// An entry in [`FieldLodConfig::cache_folder`](crate::FieldLodConfig::cache_folder).
    Cache,
    /// A bake in a background task.
    Baked,
}

/// Written once for each mesh that was prepared or could not be: read it with a
/// [`MessageReader`]. Failures are logged too.
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
    /// A mesh has levels of detail. They are drawn as soon as the GPU has them.
    Ready {
        /// The mesh.
        mesh: AssetId<Mesh>,
        /// Its path, if it was loaded from one.
        path: Option<String>,
        /// How it is drawn: [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
        kind: LodKind,
        /// Where its levels came from.
        origin: LodOrigin,
    },
    /// A mesh is drawn as it is for good.
    Failed {
        /// The mesh.
        mesh: AssetId<Mesh>,
        /// Its path, if it was loaded from one.
        path: Option<String>,
        /// Why it has no levels of detail.
        error: LodError,
    },
}

/// An entity has got levels of detail.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let statue = assets.load(GltfAssetLabel::Scene(0).from_asset("statue.glb"));
///     // Each mesh of the scene tells of itself, and events go up to its parents.
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
    /// The mesh entity, or one above it that the event has come up to.
    pub entity: Entity,
    /// How it is drawn: [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
    pub kind: LodKind,
}

/// An entity is drawn as it is, though it should have levels of detail. See [`LodReady`].
#[derive(EntityEvent, Clone, Debug, PartialEq)]
#[entity_event(propagate, auto_propagate)]
pub struct LodFailed {
    /// The mesh entity, or one above it that the event has come up to.
    pub entity: Entity,
    /// Why it has none.
    pub error: LodError,
}

/// A camera draws all that it wants of `.fieldpages` files, after some of it was missing. Cameras that draw the cut of
/// another are not told.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn setup(mut commands: Commands) {
///     commands.spawn(Camera3d::default()).observe(|sharp: On<FieldLodSharp>| {
///         println!("sharp after {:.1} s", sharp.missing_for.as_secs_f32());
///     });
/// }
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq)]
pub struct FieldLodSharp {
    /// The camera.
    pub entity: Entity,
    /// For how long something was missing.
    pub missing_for: Duration,
    /// The error that it draws with, in pixels: more than it asked for where memory is short.
    pub error_px: f32,
}

/// Why a mesh has no levels of detail.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LodError {
    /// The vertices live on the GPU only.
    #[error("its data is not in main memory: load it with `RenderAssetUsages::MAIN_WORLD`")]
    NotInMainWorld,
    /// The mesh consists of points, lines or strips.
    #[error("it is not a triangle list but a {0:?}")]
    Topology(PrimitiveTopology),
    /// Morph targets move vertices at run time.
    #[error("it has morph targets")]
    Morphed,
    /// There are no positions, or they are not three floats each.
    #[error("it has no positions of three 32-bit floats")]
    NoPositions,
    /// Some vertices lack an attribute that others have.
    #[error("its attribute {attribute} has more or fewer values than its positions")]
    AttributeCount {
        /// The name of the attribute.
        attribute: &'static str,
    },
    /// The file holds other meshes, or an older version of this one.
    #[error("{file} holds no hierarchy that fits it: the file is stale, bake it again")]
    Stale {
        /// The `.fieldlod` file.
        file: String,
    },
    /// The mesh has vertex attributes that were not there when the file was baked.
    #[error(
        "{file} does not tell all its vertex attributes at coarser levels: the file is stale, bake it again"
    )]
    MissingAttributes {
        /// The `.fieldlod` file.
        file: String,
    },
    /// The file could not be loaded; the asset server has logged why.
    #[error("{file} could not be loaded")]
    FileNotLoaded {
        /// The `.fieldlod` file.
        file: String,
    },
    /// The file has no such primitive.
    #[error("{file} has no primitive {primitive} of a mesh {mesh}")]
    NoPrimitive {
        /// The `.fieldlod` file.
        file: String,
        /// Index of the mesh.
        mesh: u32,
        /// Index of the primitive in it.
        primitive: u32,
    },
    /// The file cannot be drawn by itself.
    #[error(
        "{file} leaves out the vertices, which are in its source: bake it without --beside-source"
    )]
    VerticesLeftOut {
        /// The `.fieldlod` file.
        file: String,
    },
    /// A `.fieldpages` file is drawn by itself, with [`LodMesh3d`](crate::LodMesh3d).
    #[error("{file} is read in parts, which only LodMesh3d does")]
    InPages {
        /// The `.fieldpages` file.
        file: String,
    },
    /// What the coarsest levels of a mesh draw cannot be read.
    #[error("{file} cannot be drawn: {fault}")]
    Unreadable {
        /// The `.fieldpages` file.
        file: String,
        /// What is wrong with it.
        fault: FileError,
    },
    /// The mesh cannot be baked.
    #[cfg(feature = "bake")]
    #[error(transparent)]
    Bake(#[from] fieldlod_bake::MeshError),
    /// No file that fits was found, and
    /// [`FieldLodConfig::bake_at_run_time`](crate::FieldLodConfig::bake_at_run_time) or the `bake` feature is
    /// off.
    #[error("no .fieldlod file that fits was found, and meshes are not baked at run time")]
    BakeDisabled,
}

impl From<MeshAccessError> for LodError {
    fn from(_: MeshAccessError) -> Self {
        Self::NotInMainWorld
    }
}

impl FieldLodEvent {
    /// Tells that a mesh has none, and logs it.
    pub(crate) fn failed(assets: &AssetServer, mesh: AssetId<Mesh>, error: LodError) -> Self {
        let name = asset_name(assets, mesh.untyped());
        match error {
            LodError::Morphed => info!("{name} is drawn as it is: {error}"),
            _ => error!("{name} is drawn without levels of detail: {error}"),
        }
        let path = asset_path(assets, mesh);
        Self::Failed { mesh, path, error }
    }
}

/// The path of a mesh, if it was loaded from one.
pub(crate) fn asset_path(assets: &AssetServer, mesh: AssetId<Mesh>) -> Option<String> {
    assets.get_path(mesh).map(|path| path.to_string())
}

/// The path of an asset, or its id if it was made at run time.
pub(crate) fn asset_name(assets: &AssetServer, id: UntypedAssetId) -> String {
    match assets.get_path(id) {
        Some(path) => path.to_string(),
        None => format!("the mesh {id:?}"),
    }
}
