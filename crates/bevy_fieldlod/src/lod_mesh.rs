//! The levels of detail of mesh assets, and what the plugin keeps on the entities that share them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bevy::asset::AssetId;
use bevy::camera::primitives::Aabb;
use bevy::prelude::*;
use fieldlod_select::MeshId;

use crate::baked_lods::BakedLods;
use crate::config::LodKind;

/// The levels of detail of one mesh asset.
#[derive(Debug)]
pub(crate) struct LodMesh {
    /// The mesh in the scene that cuts are selected from.
    pub(crate) id: MeshId,
    /// [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
    pub(crate) kind: LodKind,
    /// One for each unit of the hierarchy.
    pub(crate) pieces: Vec<LodPiece>,
    /// Triangles of the source mesh.
    pub(crate) triangles_full: u32,
    /// The box around all of it in local space; `None` for a mesh without triangles.
    pub(crate) aabb: Option<Aabb>,
    /// Area in texture coordinates for each unit of area in local space; 0 without texture coordinates.
    pub(crate) uv_per_area: f32,
    /// Whether the GPU has all pieces. The render world sets it.
    pub(crate) uploaded: AtomicBool,
}

/// The mesh that draws one unit.
#[derive(Debug)]
pub(crate) struct LodPiece {
    /// `None` for a whole mesh at its finest level, which is the source mesh.
    pub(crate) mesh: Option<Handle<Mesh>>,
    /// The box around it in local space.
    pub(crate) aabb: Aabb,
    /// 0 is the finest.
    pub(crate) level: u32,
    pub(crate) triangles: u32,
    /// Geometric error against the source in local units.
    #[cfg_attr(
        not(feature = "debug"),
        expect(dead_code, reason = "heat-maps show it")
    )]
    pub(crate) error_in_local: f32,
}

impl LodMesh {
    pub(crate) fn is_uploaded(&self) -> bool {
        self.uploaded.load(Ordering::Acquire)
    }

    /// Whether `mesh` is one of its pieces.
    pub(crate) fn has_piece(&self, mesh: AssetId<Mesh>) -> bool {
        let mut meshes = self.pieces.iter().filter_map(|piece| piece.mesh.as_ref());
        meshes.any(|piece| piece.id() == mesh)
    }
}

/// A mesh entity that waits for its levels of detail.
#[derive(Component)]
pub(crate) struct LodWaiting {
    pub(crate) baked: Option<Handle<BakedLods>>,
    pub(crate) kind: LodKind,
    pub(crate) bias: f32,
}

/// A mesh entity that is drawn as it is.
#[derive(Component)]
pub(crate) struct LodPlain;

/// A mesh entity with levels of detail.
#[derive(Component)]
pub(crate) struct LodObject {
    pub(crate) mesh: Arc<LodMesh>,
    /// The mesh that it had before; a whole mesh may be drawn at another level now.
    pub(crate) source: Handle<Mesh>,
    pub(crate) bias: f32,
    /// Whether the plugin has put [`NoAutoAabb`](bevy::camera::visibility::NoAutoAabb) on the entity.
    pub(crate) keeps_aabb: bool,
}

impl LodObject {
    /// The mesh of a level, if it is drawn as a whole mesh.
    pub(crate) fn mesh_at(&self, level: u32) -> &Handle<Mesh> {
        let piece = self.mesh.pieces.get(level as usize);
        let mesh = piece.and_then(|piece| piece.mesh.as_ref());
        mesh.unwrap_or(&self.source)
    }

    /// Whether `mesh` is the source or one of its levels.
    pub(crate) fn is_lod_mesh(&self, mesh: AssetId<Mesh>) -> bool {
        mesh == self.source.id() || self.mesh.has_piece(mesh)
    }
}
