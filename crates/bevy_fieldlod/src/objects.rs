//! Mesh entities: which take part, and what becomes of them.

use std::sync::Arc;

use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::NoAutoAabb;
use bevy::ecs::lifecycle::RemovedComponents;
use bevy::ecs::system::SystemParam;
use bevy::mesh::morph::MeshMorphWeights;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::platform::collections::HashSet;
use bevy::prelude::*;

use crate::library::{Answer, Librarian, LodLibrary, LodMesh, asset_name};
use crate::units::LodUnit;
use crate::world::LodWorld;
use crate::{AutoLod, BakedLods, FieldLodConfig, FieldLodProgress, LodKind, NoLod};

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

/// Whom an entity belongs to.
#[derive(SystemParam)]
pub(crate) struct Lineage<'w, 's> {
    roots: Query<'w, 's, (Option<&'static AutoLod>, Has<NoLod>), Or<(With<AutoLod>, With<NoLod>)>>,
    parents: Query<'w, 's, &'static ChildOf>,
    config: Res<'w, FieldLodConfig>,
}

impl Lineage<'_, '_> {
    /// The nearest [`AutoLod`] above `entity` or on it, unless a [`NoLod`] is nearer.
    fn auto_lod(&self, entity: Entity) -> Option<AutoLod> {
        let mut lineage = std::iter::once(entity).chain(self.parents.iter_ancestors(entity));
        match lineage.find_map(|ancestor| self.roots.get(ancestor).ok()) {
            Some((_, true)) => None,
            Some((auto_lod, false)) => auto_lod.cloned(),
            None => self.config.whole_world.then(AutoLod::default),
        }
    }
}

/// Finds mesh entities that came under an [`AutoLod`] or from under it, or whose mesh was exchanged.
pub(crate) fn find_objects(
    mut commands: Commands,
    mut world: ResMut<LodWorld>,
    changed_meshes: Query<Entity, (Changed<Mesh3d>, Without<LodUnit>)>,
    changed_roots: Query<
        Entity,
        (
            Or<(Changed<AutoLod>, Added<NoLod>, Changed<ChildOf>)>,
            Without<LodUnit>,
        ),
    >,
    mut removed: (
        RemovedComponents<AutoLod>,
        RemovedComponents<NoLod>,
        RemovedComponents<ChildOf>,
    ),
    config: Res<FieldLodConfig>,
    all: Query<Entity, (With<Mesh3d>, Without<LodUnit>)>,
    mut meshes: Query<(&Mesh3d, Option<&mut LodObject>), Without<LodUnit>>,
    children: Query<&Children>,
    lineage: Lineage,
) {
    let of_removed = removed.0.read().chain(removed.1.read());
    let of_removed = of_removed.chain(removed.2.read());
    let roots: Vec<Entity> = changed_roots.iter().chain(of_removed).collect();
    let below = roots
        .iter()
        .flat_map(|&root| std::iter::once(root).chain(children.iter_descendants(root)));
    let mut entities: HashSet<Entity> = changed_meshes.iter().chain(below).collect();
    if config.is_changed() {
        entities.extend(&all);
    }
    for entity in entities {
        let Ok((mesh, object)) = meshes.get_mut(entity) else {
            continue;
        };
        let auto_lod = lineage.auto_lod(entity);
        if let (Some(mut object), Some(auto_lod)) = (object, &auto_lod)
            && object.dressed_in(mesh.id())
            && fits(&object, auto_lod)
        {
            keep(&mut world, entity, mesh, &mut object, auto_lod);
            continue;
        }
        let mut commands = commands.entity(entity);
        commands.remove::<(LodObject, LodPlain, LodWaiting)>();
        if let Some(AutoLod { baked, kind, bias }) = auto_lod {
            commands.insert(LodWaiting { baked, kind, bias });
        }
    }
}

/// Whether an object need not be made anew for `auto_lod`.
fn fits(object: &LodObject, auto_lod: &AutoLod) -> bool {
    [LodKind::Auto, object.mesh.kind].contains(&auto_lod.kind)
}

fn keep(
    world: &mut LodWorld,
    entity: Entity,
    mesh: &Mesh3d,
    object: &mut LodObject,
    auto_lod: &AutoLod,
) {
    if object.bias != auto_lod.bias {
        object.bias = auto_lod.bias;
        world.set_bias(entity, auto_lod.bias);
    }
    if object.mesh.kind == LodKind::Chain && mesh.id() == object.source.id() {
        world.reset_level(entity);
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
