//! The levels of detail of mesh assets, and what the plugin keeps on the entities that share them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use bevy::asset::AssetId;
use bevy::camera::primitives::Aabb;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
#[cfg(feature = "bake")]
use fieldlod_bake::BakeConfig;
use fieldlod_select::MeshId;

use crate::api::auto_lod::AutoLod;
use crate::api::config::LodKind;
use crate::assets::baked_lods::BakedLods;
use crate::cards::card_levels::CardLevels;

/// The levels of detail of one mesh asset.
#[derive(Debug)]
pub(crate) struct LodMesh {
    /// The mesh in the scene that cuts are selected from.
    pub(crate) id: MeshId,
    /// [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
    pub(crate) kind: LodKind,
    /// One for each unit of the hierarchy, then those that only stand in for [levels of cards](CardLevels).
    pub(crate) pieces: Vec<LodPiece>,
    /// Triangles of the source mesh.
    pub(crate) triangles_full: u32,
    /// The box around all levels of it in local space; `None` for a mesh without triangles.
    pub(crate) aabb: Option<Aabb>,
    /// Area in texture coordinates for each unit of area in local space; 0 without texture coordinates.
    pub(crate) uv_per_area: f32,
    /// The mesh of the level that was asked for, for rays and physics.
    pub(crate) simplified: Option<Handle<Mesh>>,
    /// Whether the GPU has all pieces, or those that are there from the beginning. The render world sets it.
    pub(crate) uploaded: Arc<AtomicBool>,
    /// Of a mesh that is read in parts, the meshes of units in pages that the GPU has; not those of the first
    /// page, which stays.
    pub(crate) in_pages: Mutex<HashMap<u32, Handle<Mesh>>>,
    /// The levels that are cards, if some are.
    pub(crate) cards: Option<CardLevels>,
}

/// The mesh that draws one unit, or stands in for some.
#[derive(Debug)]
pub(crate) struct LodPiece {
    /// `None` for a whole mesh at its finest level, which is the source mesh, and for what comes and goes with
    /// its page.
    pub(crate) mesh: Option<Handle<Mesh>>,
    /// The box around it in local space, once its page has been read.
    pub(crate) aabb: OnceLock<Aabb>,
    /// 0 is the finest.
    pub(crate) level: u32,
    pub(crate) triangles: u32,
    /// The group whose simplification it is; `None` for source geometry.
    pub(crate) produced_by: Option<u32>,
    /// Geometric error against the source in local units.
    pub(crate) error_in_local: f32,
}

impl LodPiece {
    /// The box around it in local space; nothing before its page was read.
    pub(crate) fn aabb(&self) -> Aabb {
        self.aabb.get().copied().unwrap_or_default()
    }
}

impl LodMesh {
    /// How many levels there are to choose from, if it is drawn as a whole mesh.
    pub(crate) fn level_count(&self) -> u32 {
        let count = self.cards.as_ref().map(|cards| cards.levels().end);
        count.unwrap_or(self.pieces.len() as u32)
    }

    /// The piece that draws a level of an entity that may be drawn as cards, or may not.
    pub(crate) fn piece_at(&self, level: u32, may_be_cards: bool) -> u32 {
        let cards = self.cards.as_ref().filter(|_| !may_be_cards);
        let stand_in = cards.and_then(|cards| cards.stand_in(level));
        stand_in.unwrap_or(level)
    }

    /// Which of its levels of cards a mesh is, if it is one.
    pub(crate) fn level_of_cards(&self, mesh: AssetId<Mesh>) -> Option<u32> {
        let mut levels = self.cards.as_ref()?.levels();
        levels.find(|&level| {
            let piece = self.pieces[level as usize].mesh.as_ref();
            piece.is_some_and(|piece| piece.id() == mesh)
        })
    }

    /// The mesh of a piece, if it is drawn as a whole mesh.
    pub(crate) fn mesh_at<'a>(&'a self, piece: u32, source: &'a LodSource) -> &'a Handle<Mesh> {
        let piece = self.pieces.get(piece as usize);
        let mesh = piece.and_then(|piece| piece.mesh.as_ref());
        mesh.unwrap_or(&source.mesh)
    }

    /// The mesh of a unit; `None` while that is not on the GPU.
    pub(crate) fn mesh_of_unit(&self, unit: u32) -> Option<Handle<Mesh>> {
        let stays = self.pieces[unit as usize].mesh.clone();
        stays.or_else(|| self.in_pages().get(&unit).cloned())
    }

    pub(crate) fn in_pages(&self) -> MutexGuard<'_, HashMap<u32, Handle<Mesh>>> {
        self.in_pages.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn is_uploaded(&self) -> bool {
        self.uploaded.load(Ordering::Acquire)
    }

    /// The meshes of its pieces, but for that which is the source.
    pub(crate) fn piece_meshes(&self) -> impl Iterator<Item = AssetId<Mesh>> {
        let meshes = self.pieces.iter().filter_map(|piece| piece.mesh.as_ref());
        meshes.map(Handle::id)
    }

    /// Whether `mesh` is one of its pieces.
    pub(crate) fn has_piece(&self, mesh: AssetId<Mesh>) -> bool {
        self.piece_meshes().any(|piece| piece == mesh)
    }
}

/// How far a mesh entity under an [`AutoLod`](crate::AutoLod) has come; the plugin keeps it up to date.
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
    /// Its mesh is being loaded, baked or sent to the GPU, and it is drawn in full meanwhile.
    Waiting,
    /// It is drawn as it is: its mesh is small, changes, or cannot have levels of detail.
    Plain,
    /// It has levels of detail: [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
    Ready(LodKind),
}

/// A mesh entity that waits for its levels of detail.
#[derive(Component)]
pub(crate) struct LodWaiting {
    /// What it stands under.
    pub(crate) auto_lod: AutoLod,
}

/// A mesh entity that is drawn as it is.
#[derive(Component)]
pub(crate) struct LodPlain;

/// A mesh entity with levels of detail.
#[derive(Component)]
pub(crate) struct LodObject {
    pub(crate) mesh: Arc<LodMesh>,
    /// What it stands under.
    pub(crate) auto_lod: AutoLod,
}

impl LodObject {
    /// Whether its levels are what `auto_lod` asks for.
    pub(crate) fn fits(&self, auto_lod: &AutoLod) -> bool {
        let is_kind = [LodKind::Auto, self.mesh.kind].contains(&auto_lod.kind);
        is_kind && LodRequest::of(&self.auto_lod).equals_but_for_kind(&LodRequest::of(auto_lod))
    }
}

/// What of an [`AutoLod`] a mesh is prepared by: entities that ask for the same share its levels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LodRequest {
    pub(crate) kind: LodKind,
    pub(crate) baked: Option<Handle<BakedLods>>,
    pub(crate) simplified_level: Option<u32>,
    /// Whether what asks may be drawn as cards: what may not has levels of triangles where others have cards.
    pub(crate) may_be_cards: bool,
    #[cfg(feature = "bake")]
    pub(crate) bake: Option<BakeConfig>,
}

impl LodRequest {
    pub(crate) fn of(auto_lod: &AutoLod) -> Self {
        Self {
            kind: auto_lod.kind,
            baked: auto_lod.baked.clone(),
            simplified_level: auto_lod.simplified_level,
            may_be_cards: true,
            #[cfg(feature = "bake")]
            bake: auto_lod.bake.clone(),
        }
    }

    fn equals_but_for_kind(&self, other: &Self) -> bool {
        let kind = self.kind;
        *self
            == Self {
                kind,
                ..other.clone()
            }
    }
}

/// An object that is cut into units.
#[derive(Component)]
pub(crate) struct LodClusters;

/// The mesh that an entity with levels of detail had before it got them, for whoever needs all of it:
/// physics, for one. The [`Mesh3d`] of a prop is that of the level that is drawn.
///
/// The plugin puts it on and takes it off. Clones and saved scenes have it too, and so get back their
/// source.
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(Component, Clone)]
pub struct LodSource {
    /// The source mesh.
    pub mesh: Handle<Mesh>,
    /// Whether the plugin has put [`NoAutoAabb`](bevy::camera::visibility::NoAutoAabb) on the entity,
    /// and a box around all levels.
    pub(crate) keeps_aabb: bool,
}

/// The mesh of the level that [`AutoLod::simplified_level`](crate::AutoLod::simplified_level) names, with
/// positions and triangles only, in main memory and not on the GPU. The plugin puts it on each mesh entity as
/// its levels are ready, and takes it off.
///
/// ```
/// # use bevy::picking::mesh_picking::ray_cast::SimplifiedMesh;
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::LodSimplified;
/// // Bevy's picking by meshes casts its rays at it. A physics engine makes its collider of the same.
/// fn pick_by_level(ready: On<Insert, LodSimplified>, meshes: Query<&LodSimplified>, mut commands: Commands) {
///     if let Ok(simplified) = meshes.get(ready.entity) {
///         commands.entity(ready.entity).insert(SimplifiedMesh(simplified.mesh.clone()));
///     }
/// }
/// # App::new().add_observer(pick_by_level);
/// ```
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(Component, Clone)]
pub struct LodSimplified {
    /// The mesh.
    pub mesh: Handle<Mesh>,
}
