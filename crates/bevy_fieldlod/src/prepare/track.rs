//! Tracks mesh entities: which are under an [`AutoLod`], and which change their mesh.

use bevy::camera::visibility::NoCpuCulling;
use bevy::ecs::lifecycle::RemovedComponents;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;

use crate::api::auto_lod::{AutoLod, NoLod};
use crate::api::config::FieldLodAppConfig;
use crate::api::systems::FieldLodSystems;
use crate::compat::{OnAdd, OnRemove};
use crate::draw::drawn_meshes::DrawnMeshes;
use crate::draw::released_sources::ReleasedSources;
use crate::draw::units::LodUnit;
use crate::prepare::restart::RestartObjects;
use crate::scene::changed::ChangedOn;
use crate::scene::lod_mesh::{LodObject, LodPlacement, LodState, LodWaiting};
use crate::scene::lod_scene::LodScene;

/// Tracks mesh entities in each frame.
pub(crate) fn plugin(app: &mut App) {
    app.add_observer(note_new_object)
        .add_observer(remove_object)
        .add_observer(untrack_entities_without_mesh)
        .add_systems(
            PostUpdate,
            track_objects
                // A restart marks the `Mesh3d` as changed, which this system reads in the same frame.
                .after(RestartObjects)
                .in_set(FieldLodSystems::Track),
        );
}

/// Finds the [`AutoLod`] that applies to an entity.
#[derive(SystemParam)]
pub(crate) struct AutoLodLookup<'w, 's> {
    roots: Query<'w, 's, (Option<&'static AutoLod>, Has<NoLod>), Or<(With<AutoLod>, With<NoLod>)>>,
    parents: Query<'w, 's, &'static ChildOf>,
    config: Res<'w, FieldLodAppConfig>,
}

impl AutoLodLookup<'_, '_> {
    /// The nearest [`AutoLod`] above `entity` or on it, unless a [`NoLod`] is as near or nearer. If there is
    /// neither, the default with `whole_world`.
    pub(crate) fn find(&self, entity: Entity) -> Option<AutoLod> {
        let mut lineage = std::iter::once(entity).chain(self.parents.iter_ancestors(entity));
        match lineage.find_map(|ancestor| self.roots.get(ancestor).ok()) {
            Some((_, true)) => None,
            Some((auto_lod, false)) => auto_lod.cloned(),
            None => self.config.whole_world.then(AutoLod::default),
        }
    }
}

/// Changes that may put a mesh entity under an [`AutoLod`] or remove it from there.
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
    /// The entities that may be affected, each once and sorted; with `all`, all mesh entities.
    ///
    /// The order keeps entities that were spawned together adjacent in their tables, which Bevy iterates in every
    /// frame.
    fn take(&mut self, all: bool) -> Vec<Entity> {
        // A mark or a new parent affects all descendants.
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

/// The components of a mesh entity that tracking reads.
type Tracked = (
    Ref<'static, Mesh3d>,
    Option<&'static mut LodObject>,
    Option<&'static LodState>,
    Option<&'static mut ViewVisibility>,
);

/// Updates mesh entities that entered or left the subtree of an [`AutoLod`], or whose mesh changed.
fn track_objects(
    mut commands: Commands,
    mut scene: ResMut<LodScene>,
    mut changed: ChangedEntities,
    mut objects: Query<Tracked, Without<LodUnit>>,
    auto_lods: AutoLodLookup,
    mut sources: ResMut<ReleasedSources>,
) {
    for entity in changed.take(auto_lods.config.is_changed()) {
        let Ok((mesh, object, state, visibility)) = objects.get_mut(entity) else {
            continue;
        };
        let auto_lod = auto_lods.find(entity);
        // Bevy 0.19.1 drops the material of an entity that loses its `Mesh3d`, and extracts it again only after a change
        // of the visibility. Where the GPU culls, no movement of a camera changes that.
        if let Some(mut visibility) = visibility.filter(|_| mesh.is_added() && auto_lod.is_some()) {
            visibility.set_changed();
        }
        // The levels of the object match the mesh and the settings.
        if let (Some(mut object), Some(auto_lod)) = (object, &auto_lod)
            && object.source == mesh.id()
            && object.auto_lod.is_same_request(auto_lod)
        {
            if object.auto_lod != *auto_lod {
                object.auto_lod = auto_lod.clone();
                scene.set_auto_lod(entity, auto_lod);
            }
            continue;
        }
        // The levels are removed, and requested again. Until then, the entity draws its source, which may not be on the
        // GPU.
        sources.note_user(mesh.id());
        let mut commands = commands.entity(entity);
        commands.try_remove::<(LodObject, LodWaiting)>();
        // A clone has copies of `LodState` and `NoCpuCulling`, but no `LodObject` whose removal would remove them.
        if let Some(LodState::Ready(_)) = state {
            commands.try_remove::<NoCpuCulling>();
        }
        if let Some(auto_lod) = auto_lod {
            commands.try_insert((LodWaiting { auto_lod }, LodState::Waiting));
        } else {
            commands.try_remove::<LodState>();
        }
    }
}

/// Records a new object.
fn note_new_object(added: OnAdd<LodObject>, mut scene: ResMut<LodScene>) {
    scene.new_objects.push(added.entity);
}

/// Draws the source of an entity that loses its levels, and despawns its units.
fn remove_object(
    removal: OnRemove<LodObject>,
    drawn: Res<DrawnMeshes>,
    mut scene: ResMut<LodScene>,
    mut commands: Commands,
) {
    for unit in scene.remove(removal.entity) {
        commands.entity(unit).try_despawn();
    }
    // The render world would go on drawing the last level.
    drawn.set(removal.entity, None);
    let mut commands = commands.entity(removal.entity);
    commands.try_remove::<(LodPlacement, NoCpuCulling)>();
}

/// Removes the components of the plugin from an entity whose [`Mesh3d`] was removed.
fn untrack_entities_without_mesh(
    removal: OnRemove<Mesh3d>,
    objects: Query<(), (With<LodState>, Without<LodUnit>)>,
    mut commands: Commands,
) {
    // A despawned entity passes here too, so that removals may find no entity.
    if objects.contains(removal.entity) {
        let mut commands = commands.entity(removal.entity);
        commands.try_remove::<(LodObject, LodWaiting, LodState)>();
    }
}
