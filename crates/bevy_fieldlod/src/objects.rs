//! Mesh entities and their drawable units: which entities take part, and the entities that draw
//! their units.

use std::sync::Arc;

use bevy::camera::visibility::{NoAutoAabb, NoFrustumCulling, RenderLayers};
use bevy::ecs::lifecycle::RemovedComponents;
use bevy::light::{NotShadowCaster, NotShadowReceiver};
use bevy::mesh::morph::MeshMorphWeights;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::platform::collections::HashSet;
use bevy::prelude::*;

use crate::library::{Answer, LodLibrary, LodMesh, asset_name, request};
use crate::{AutoLod, BakedLods, LodDebug, LodStatus};

/// A mesh entity that waits for its hierarchy.
#[derive(Component)]
pub(crate) struct LodWaiting {
    baked: Option<Handle<BakedLods>>,
}

/// A mesh entity that no hierarchy can be had for.
#[derive(Component)]
pub(crate) struct LodPlain;

/// A mesh entity with a hierarchy. Its units are children of it.
#[derive(Component)]
pub(crate) struct LodObject {
    pub(crate) mesh: Arc<LodMesh>,
    /// One per unit of the hierarchy.
    pub(crate) units: Vec<Entity>,
}

/// An entity that draws one unit.
#[derive(Component)]
pub(crate) struct LodUnit {
    /// 0 is the finest.
    pub(crate) level: u32,
    pub(crate) object: Entity,
}

/// What the unit entities take over from the mesh entity.
type Inherited = (
    &'static MeshMaterial3d<StandardMaterial>,
    Option<&'static RenderLayers>,
    Has<NotShadowCaster>,
    Has<NotShadowReceiver>,
    Has<NoFrustumCulling>,
);

/// Finds mesh entities that came under an [`AutoLod`], or whose mesh was exchanged.
pub(crate) fn find_objects(
    mut commands: Commands,
    changed_meshes: Query<Entity, (Changed<Mesh3d>, Without<LodUnit>)>,
    new_roots: Query<Entity, Added<AutoLod>>,
    roots: Query<&AutoLod>,
    mesh_entities: Query<(), (With<Mesh3d>, Without<LodUnit>)>,
    parents: Query<&ChildOf>,
    children: Query<&Children>,
) {
    let below_new_roots = new_roots
        .iter()
        .flat_map(|root| std::iter::once(root).chain(children.iter_descendants(root)))
        .filter(|&entity| mesh_entities.contains(entity));
    let entities: HashSet<Entity> = changed_meshes.iter().chain(below_new_roots).collect();
    for entity in entities {
        let mut lineage = std::iter::once(entity).chain(parents.iter_ancestors(entity));
        if let Some(auto_lod) = lineage.find_map(|ancestor| roots.get(ancestor).ok()) {
            let baked = auto_lod.baked.clone();
            commands
                .entity(entity)
                .remove::<(LodObject, LodPlain)>()
                .insert(LodWaiting { baked });
        }
    }
}

/// Leaves skinned and morphed meshes, and materials other than the standard one, as they are.
pub(crate) fn refuse_unsupported(
    mut commands: Commands,
    waiting: Query<
        (
            Entity,
            &Mesh3d,
            Has<SkinnedMesh>,
            Has<MeshMorphWeights>,
            Has<MeshMaterial3d<StandardMaterial>>,
        ),
        Added<LodWaiting>,
    >,
    mut told: Local<HashSet<AssetId<Mesh>>>,
    assets: Res<AssetServer>,
) {
    for (entity, mesh, skinned, morphed, standard) in &waiting {
        let reason = match (skinned, morphed, standard) {
            (true, _, _) => "it is skinned",
            (_, true, _) => "it has morph targets",
            (_, _, false) => "its material is not a StandardMaterial",
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

/// Asks the library for the hierarchies of waiting entities, and spawns the units of those that have
/// one.
pub(crate) fn advance_waiting(
    mut commands: Commands,
    waiting: Query<(Entity, &Mesh3d, &LodWaiting, Option<Inherited>)>,
    mut library: ResMut<LodLibrary>,
    meshes: Res<Assets<Mesh>>,
    files: Res<Assets<BakedLods>>,
    assets: Res<AssetServer>,
) {
    for (entity, mesh, state, inherited) in &waiting {
        let baked = state.baked.as_ref();
        request(&mut library, mesh.id(), baked, &meshes, &files, &assets);
        match (library.answer(mesh.id()), inherited) {
            (Answer::Waiting, _) => {}
            (Answer::Failed, _) | (_, None) => {
                commands
                    .entity(entity)
                    .remove::<LodWaiting>()
                    .insert(LodPlain);
            }
            (Answer::Ready(mesh), Some(inherited)) => {
                let units = spawn_units(&mut commands, entity, &mesh, inherited);
                commands
                    .entity(entity)
                    .remove::<LodWaiting>()
                    .insert(LodObject { mesh, units });
            }
        }
    }
}

fn spawn_units(
    commands: &mut Commands,
    object: Entity,
    mesh: &LodMesh,
    (material, layers, no_caster, no_receiver, no_culling): (
        &MeshMaterial3d<StandardMaterial>,
        Option<&RenderLayers>,
        bool,
        bool,
        bool,
    ),
) -> Vec<Entity> {
    let spawn_unit = |(index, unit): (usize, &fieldlod_hierarchy::Unit)| {
        let mut entity = commands.spawn((
            Mesh3d(mesh.unit_meshes[index].clone()),
            material.clone(),
            Transform::IDENTITY,
            mesh.aabb_of(index),
            NoAutoAabb,
            ChildOf(object),
            LodUnit {
                level: mesh.hierarchy.level_of(unit),
                object,
            },
        ));
        if let Some(layers) = layers {
            entity.insert(layers.clone());
        }
        if no_caster {
            entity.insert(NotShadowCaster);
        }
        if no_receiver {
            entity.insert(NotShadowReceiver);
        }
        if no_culling {
            entity.insert(NoFrustumCulling);
        }
        entity.id()
    };
    mesh.hierarchy
        .units
        .iter()
        .enumerate()
        .map(spawn_unit)
        .collect()
}

/// Despawns the units of an object that is an object no longer.
pub(crate) fn despawn_units(
    removal: On<Remove, LodObject>,
    objects: Query<&LodObject>,
    mut commands: Commands,
) {
    let Ok(object) = objects.get(removal.entity) else {
        return;
    };
    for &unit in &object.units {
        commands.entity(unit).try_despawn();
    }
}

/// Starts anew with meshes that were changed, and forgets those that are gone.
pub(crate) fn follow_mesh_changes(
    mut commands: Commands,
    mut events: MessageReader<AssetEvent<Mesh>>,
    mut library: ResMut<LodLibrary>,
    mut objects: Query<(Entity, &mut Mesh3d), Or<(With<LodObject>, With<LodPlain>)>>,
) {
    for event in events.read() {
        let (id, changed) = match event {
            AssetEvent::Modified { id } => (*id, true),
            AssetEvent::Removed { id } => (*id, false),
            _ => continue,
        };
        if !library.forget(id) || !changed {
            continue;
        }
        for (entity, mut mesh) in objects.iter_mut().filter(|(_, mesh)| mesh.id() == id) {
            commands.entity(entity).remove::<(LodObject, LodPlain)>();
            // `find_objects` looks at changed meshes.
            mesh.set_changed();
        }
    }
}

/// Units wear the material of their object, unless they show their level.
pub(crate) fn follow_material_changes(
    debug: Res<LodDebug>,
    objects: Query<
        (&LodObject, &MeshMaterial3d<StandardMaterial>),
        (Changed<MeshMaterial3d<StandardMaterial>>, Without<LodUnit>),
    >,
    mut units: Query<&mut MeshMaterial3d<StandardMaterial>, With<LodUnit>>,
) {
    if debug.color_levels {
        return;
    }
    for (object, material) in &objects {
        for &unit in &object.units {
            if let Ok(mut unit_material) = units.get_mut(unit) {
                *unit_material = material.clone();
            }
        }
    }
}

/// Counts.
pub(crate) fn update_status(
    waiting: Query<(), With<LodWaiting>>,
    objects: Query<&LodObject>,
    plain: Query<(), With<LodPlain>>,
    mut status: ResMut<LodStatus>,
) {
    let ready = objects.iter().filter(|o| o.mesh.is_uploaded()).count() as u32;
    let uploading = objects.iter().len() as u32 - ready;
    status.set_if_neq(LodStatus {
        waiting: waiting.iter().len() as u32 + uploading,
        ready,
        plain: plain.iter().len() as u32,
    });
}

/// Whether objects came or went since this was last asked.
pub(crate) fn objects_changed(
    added: Query<(), Added<LodObject>>,
    mut removed: RemovedComponents<LodObject>,
) -> bool {
    removed.read().count() > 0 || !added.is_empty()
}
