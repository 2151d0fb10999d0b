//! Tracks mesh entities: which come under an [`AutoLod`], which leave it, and which change their mesh.

use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::{NoAutoAabb, NoCpuCulling};
use bevy::ecs::lifecycle::RemovedComponents;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;

use crate::api::auto_lod::{AutoLod, NoLod};
use crate::api::config::{FieldLodConfig, LodKind};
use crate::api::systems::FieldLodSystems;
use crate::cards::LodCards;
use crate::draw::released_sources::ReleasedSources;
use crate::draw::units::LodUnit;
use crate::prepare::LodMeshes;
use crate::scene::changed::ChangedOn;
use crate::scene::lod_mesh::{
    LodClusters, LodObject, LodPlain, LodSimplified, LodSource, LodState, LodWaiting,
};
use crate::scene::lod_scene::LodScene;

/// Tracks mesh entities in each frame.
pub(crate) fn plugin(app: &mut App) {
    app.add_observer(note_new_object)
        .add_observer(restore_source)
        .add_observer(forget_meshless)
        .add_systems(
            PostUpdate,
            track_objects
                .after(crate::prepare::restart::restart_objects)
                .in_set(FieldLodSystems::Track),
        );
}

/// Finds the [`AutoLod`] that an entity stands under.
#[derive(SystemParam)]
pub(crate) struct AutoLodLookup<'w, 's> {
    roots: Query<'w, 's, (Option<&'static AutoLod>, Has<NoLod>), Or<(With<AutoLod>, With<NoLod>)>>,
    parents: Query<'w, 's, &'static ChildOf>,
    config: Res<'w, FieldLodConfig>,
}

impl AutoLodLookup<'_, '_> {
    /// The nearest [`AutoLod`] above `entity` or on it, unless a [`NoLod`] is nearer.
    pub(crate) fn find(&self, entity: Entity) -> Option<AutoLod> {
        let mut lineage = std::iter::once(entity).chain(self.parents.iter_ancestors(entity));
        match lineage.find_map(|ancestor| self.roots.get(ancestor).ok()) {
            Some((_, true)) => None,
            Some((auto_lod, false)) => auto_lod.cloned(),
            None => self.config.whole_world.then(AutoLod::default),
        }
    }
}

/// Changes that may bring a mesh entity under an [`AutoLod`] or from under it.
#[derive(SystemParam)]
struct ChangedEntities<'w, 's> {
    meshes: ChangedOn<'w, 's, Mesh3d, Without<LodUnit>>,
    auto_lod: ChangedOn<'w, 's, AutoLod>,
    no_lod: Query<'w, 's, Entity, Added<NoLod>>,
    child_of: ChangedOn<'w, 's, ChildOf, Without<LodUnit>>,
    removed_auto_lod: RemovedComponents<'w, 's, AutoLod>,
    removed_no_lod: RemovedComponents<'w, 's, NoLod>,
    removed_child_of: RemovedComponents<'w, 's, ChildOf>,
    all: Query<'w, 's, Entity, (With<Mesh3d>, Without<LodUnit>)>,
    children: Query<'w, 's, &'static Children>,
}

impl ChangedEntities<'_, '_> {
    /// The entities to look at again, each once; with `all`, all mesh entities.
    ///
    /// They are in order, so that entities which come together go on lying together in memory: Bevy
    /// goes through them in every frame.
    fn take(&mut self, all: bool) -> Vec<Entity> {
        // A mark that comes or goes, or a new parent, concerns all descendants.
        let mut roots: Vec<Entity> = self.no_lod.iter().collect();
        self.auto_lod.add_to(&mut roots);
        self.child_of.add_to(&mut roots);
        roots.extend(self.removed_auto_lod.read());
        roots.extend(self.removed_no_lod.read());
        roots.extend(self.removed_child_of.read());
        let mut changed = self.meshes.entities();
        for root in roots {
            changed.push(root);
            changed.extend(self.children.iter_descendants(root));
        }
        if all {
            changed.extend(&self.all);
        }
        changed.sort_unstable();
        changed.dedup();
        changed
    }
}

/// Finds mesh entities that came under an [`AutoLod`], left it, or whose mesh changed.
fn track_objects(
    mut commands: Commands,
    mut scene: ResMut<LodScene>,
    mut changed: ChangedEntities,
    mut objects: Query<(&Mesh3d, Option<&mut LodObject>, Option<&LodSource>), Without<LodUnit>>,
    auto_lods: AutoLodLookup,
    known: Res<LodMeshes>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut sources: ResMut<ReleasedSources>,
) {
    for entity in changed.take(auto_lods.config.is_changed()) {
        let Ok((mesh, object, source)) = objects.get_mut(entity) else {
            continue;
        };
        let auto_lod = auto_lods.find(entity);
        // An object whose mesh and kind are still the right ones stays what it is.
        if let (Some(mut object), Some(source), Some(auto_lod)) = (object, source, &auto_lod)
            && (mesh.0 == source.mesh || object.mesh.has_piece(mesh.id()))
            && object.fits(auto_lod)
        {
            if object.auto_lod != *auto_lod {
                object.auto_lod = auto_lod.clone();
                scene.set_auto_lod(entity, auto_lod);
            }
            if object.mesh.kind == LodKind::WholeMesh && mesh.0 == source.mesh {
                // Perhaps someone else put it back.
                scene.reset_level(entity);
            }
            continue;
        }
        // Any other starts anew.
        sources.note(mesh.id());
        let mut commands = commands.entity(entity);
        commands.try_remove::<(LodObject, LodPlain, LodWaiting)>();
        if let Some(source) = source {
            remove_source(&mut commands, source);
        }
        // What was copied from a prop gets the source of the level that it came with.
        if let Some(source) = known.source_of_level(mesh.id(), &mut meshes) {
            commands.try_insert(Mesh3d(source));
        }
        if let Some(auto_lod) = auto_lod {
            commands.try_insert((LodWaiting { auto_lod }, LodState::Waiting));
        } else {
            commands.try_remove::<LodState>();
        }
    }
}

/// Notes an entity that has become an object.
fn note_new_object(added: On<Add, LodObject>, mut scene: ResMut<LodScene>) {
    scene.new_objects.push(added.entity);
}

/// Gives an entity that is an object no longer its source mesh back.
fn restore_source(
    removal: On<Remove, LodObject>,
    objects: Query<(&LodObject, &LodSource, &Mesh3d)>,
    mut scene: ResMut<LodScene>,
    mut commands: Commands,
) {
    // Units are despawned, and the entity gets back what it had.
    for unit in scene.remove(removal.entity) {
        commands.entity(unit).try_despawn();
    }
    let Ok((object, source, mesh)) = objects.get(removal.entity) else {
        return;
    };
    let mut commands = commands.entity(removal.entity);
    if object.mesh.has_piece(mesh.id()) {
        commands.try_insert(Mesh3d(source.mesh.clone()));
    }
    remove_source(&mut commands, source);
}

/// Notes an entity whose mesh was taken off: there is nothing to draw any more.
fn forget_meshless(
    removal: On<Remove, Mesh3d>,
    objects: Query<Option<&LodSource>, (With<LodState>, Without<LodUnit>)>,
    mut commands: Commands,
) {
    let Ok(source) = objects.get(removal.entity) else {
        return;
    };
    let mut commands = commands.entity(removal.entity);
    commands.try_remove::<(LodObject, LodPlain, LodWaiting, LodState)>();
    if let Some(source) = source {
        remove_source(&mut commands, source);
    }
}

/// Takes off what came with levels of detail, or with the clone of an entity that has them.
fn remove_source(commands: &mut EntityCommands, source: &LodSource) {
    commands.try_remove::<(
        LodSource,
        LodCards,
        LodClusters,
        LodSimplified,
        NoCpuCulling,
    )>();
    if source.keeps_aabb {
        // Bevy puts a box around the source again.
        commands.try_remove::<(NoAutoAabb, Aabb)>();
    }
}
