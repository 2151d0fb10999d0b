//! Mesh entities: which take part, and what becomes of them.

mod find;

use std::sync::Arc;

use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::NoAutoAabb;
use bevy::mesh::morph::MeshMorphWeights;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::platform::collections::HashSet;
use bevy::prelude::*;

use crate::library::{Answer, Librarian, LodLibrary, LodMesh, asset_name};
use crate::world::LodWorld;
use crate::{BakedLods, FieldLodProgress, LodKind};
pub(crate) use find::find_objects;

/// A mesh entity that waits for its levels of detail.
#[derive(Component)]
pub(crate) struct LodWaiting {
    baked: Option<Handle<BakedLods>>,
    kind: LodKind,
    bias: f32,
}

/// A mesh entity that is drawn as it is.
#[derive(Component)]
pub(crate) struct LodPlain;

/// A mesh entity with levels of detail.
#[derive(Component)]
pub(crate) struct LodObject {
    pub(crate) mesh: Arc<LodMesh>,
    /// What it wore before; a chain may wear another level now.
    pub(crate) source: Handle<Mesh>,
    pub(crate) bias: f32,
    /// Whether [`NoAutoAabb`] is ours.
    keeps_aabb: bool,
}

impl LodObject {
    /// The mesh of a chain's level.
    pub(crate) fn piece(&self, level: u32) -> &Handle<Mesh> {
        let piece = self.mesh.pieces.get(level as usize);
        let mesh = piece.and_then(|piece| piece.mesh.as_ref());
        mesh.unwrap_or(&self.source)
    }

    /// Whether an entity with this object wears `mesh` because the plugin put it there.
    fn dressed_in(&self, mesh: AssetId<Mesh>) -> bool {
        mesh == self.source.id() || self.mesh.has_piece(mesh)
    }
}

/// Leaves skinned and morphed meshes as they are.
pub(crate) fn refuse_unsupported(
    mut commands: Commands,
    waiting: Query<(Entity, &Mesh3d, Has<SkinnedMesh>, Has<MeshMorphWeights>), Added<LodWaiting>>,
    mut told: Local<HashSet<AssetId<Mesh>>>,
    assets: Res<AssetServer>,
) {
    for (entity, mesh, skinned, morphed) in &waiting {
        let reason = match (skinned, morphed) {
            (true, _) => "it is skinned",
            (_, true) => "it has morph targets",
            _ => continue,
        };
        // Its other instances, and a scene that is spawned again, need no second line.
        if told.insert(mesh.id()) {
            let name = asset_name(&assets, mesh.id().untyped());
            info!("{name} is drawn as it is: {reason}");
        }
        commands
            .entity(entity)
            .remove::<LodWaiting>()
            .insert(LodPlain);
    }
}

/// Asks the library for the levels of detail of waiting entities, and makes objects of those whose
/// levels the GPU has.
pub(crate) fn advance_waiting(
    mut commands: Commands,
    waiting: Query<(Entity, &Mesh3d, &LodWaiting, Has<Aabb>, Has<NoAutoAabb>)>,
    mut librarian: Librarian,
) {
    for (entity, mesh, state, has_aabb, keeps_aabb) in &waiting {
        let mut commands = match librarian.ask(mesh.id(), state.baked.as_ref(), state.kind) {
            Answer::Waiting => continue,
            Answer::Ready(lod) if !lod.is_uploaded() => continue,
            Answer::Ready(lod) => {
                let mut commands = commands.entity(entity);
                // Bevy would shrink the box with each coarser level, and read meshes that only the
                // GPU has.
                let own_box = lod.kind == LodKind::Chain && !keeps_aabb;
                if own_box {
                    commands.insert(NoAutoAabb);
                }
                if own_box && !has_aabb {
                    commands.insert(lod.pieces[0].aabb);
                }
                commands.insert(LodObject {
                    mesh: lod,
                    source: mesh.0.clone(),
                    bias: state.bias,
                    keeps_aabb: own_box,
                });
                commands
            }
            Answer::Plain => {
                let mut commands = commands.entity(entity);
                commands.insert(LodPlain);
                commands
            }
        };
        commands.remove::<LodWaiting>();
    }
}

/// Notes an entity that has become an object.
pub(crate) fn note_new(added: On<Add, LodObject>, mut world: ResMut<LodWorld>) {
    world.came.push(added.entity);
}

/// Whether any mesh entity waits for its levels of detail.
pub(crate) fn any_waiting(waiting: Query<(), With<LodWaiting>>) -> bool {
    !waiting.is_empty()
}

/// Puts an entity that is an object no longer back to what it was.
pub(crate) fn undress(
    removal: On<Remove, LodObject>,
    objects: Query<(&LodObject, &Mesh3d)>,
    mut world: ResMut<LodWorld>,
    mut commands: Commands,
) {
    for unit in world.remove(removal.entity) {
        commands.entity(unit).try_despawn();
    }
    let Ok((object, mesh)) = objects.get(removal.entity) else {
        return;
    };
    let mut commands = commands.entity(removal.entity);
    if object.mesh.has_piece(mesh.id()) {
        commands.try_insert(Mesh3d(object.source.clone()));
    }
    if object.keeps_aabb {
        commands.try_remove::<NoAutoAabb>();
    }
}

/// Starts anew with meshes that were changed, and forgets those that are gone.
pub(crate) fn follow_mesh_changes(
    mut commands: Commands,
    mut events: MessageReader<AssetEvent<Mesh>>,
    mut library: ResMut<LodLibrary>,
    mut world: ResMut<LodWorld>,
    objects: Query<(Entity, &LodObject)>,
    mut plain: Query<(Entity, &mut Mesh3d), With<LodPlain>>,
) {
    for event in events.read() {
        let (id, changed) = match event {
            AssetEvent::Modified { id } => (*id, true),
            AssetEvent::Removed { id } => (*id, false),
            _ => continue,
        };
        for mesh in library.forget(id) {
            world.retire(mesh);
        }
        if !changed {
            continue;
        }
        for (entity, object) in objects.iter().filter(|(_, o)| o.source.id() == id) {
            // `find_objects` looks at meshes that were put on.
            let mut commands = commands.entity(entity);
            commands.remove::<LodObject>();
            commands.insert(Mesh3d(object.source.clone()));
        }
        for (entity, mut mesh) in plain.iter_mut().filter(|(_, mesh)| mesh.id() == id) {
            commands.entity(entity).remove::<LodPlain>();
            mesh.set_changed();
        }
    }
}

/// Counts.
pub(crate) fn update_progress(
    waiting: Query<(), With<LodWaiting>>,
    objects: Query<(), With<LodObject>>,
    plain: Query<(), With<LodPlain>>,
    library: Res<LodLibrary>,
    mut progress: ResMut<FieldLodProgress>,
) {
    progress.set_if_neq(FieldLodProgress {
        waiting: waiting.iter().len() as u32,
        baking: library.preparing() as u32,
        ready: objects.iter().len() as u32,
        plain: plain.iter().len() as u32,
    });
}
