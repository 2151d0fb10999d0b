//! What the plugin tells.

use bevy::asset::AssetId;
use bevy::prelude::*;

use crate::{LodError, LodKind};

/// Where a hierarchy came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Reflect)]
#[reflect(Clone, PartialEq)]
pub enum LodOrigin {
    /// [`AutoLod::baked`](crate::AutoLod::baked).
    File,
    /// A `.fieldlod` file beside the asset, or what the asset processor put into it.
    BesideAsset,
    /// [`FieldLodConfig::cache_folder`](crate::FieldLodConfig::cache_folder).
    Cache,
    /// Baked in a background task.
    Baked,
}

/// Written once for each mesh that was prepared or could not be: read it with a
/// [`MessageReader`]. Faults are logged too.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn count_faults(mut events: MessageReader<FieldLodEvent>, mut faults: Local<u32>) {
///     for event in events.read() {
///         if let FieldLodEvent::Failed { path, fault, .. } = event {
///             *faults += 1;
///             println!("{path:?}: {fault}");
///         }
///     }
/// }
/// # bevy::ecs::system::assert_is_system(count_faults);
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
        /// How it is drawn: [`LodKind::Chain`] or [`LodKind::Clusters`].
        kind: LodKind,
        /// Where its hierarchy came from.
        origin: LodOrigin,
    },
    /// A mesh is drawn as it is for good.
    Failed {
        /// The mesh.
        mesh: AssetId<Mesh>,
        /// Its path, if it was loaded from one.
        path: Option<String>,
        /// Why.
        fault: LodError,
    },
}
