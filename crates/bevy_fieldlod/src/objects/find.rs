//! Which mesh entities take part.

use bevy::ecs::lifecycle::RemovedComponents;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;

use super::{LodObject, LodPlain, LodWaiting};
use crate::units::LodUnit;
use crate::world::LodWorld;
use crate::{AutoLod, FieldLodConfig, LodKind, NoLod};

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

/// What may have brought a mesh entity under an [`AutoLod`] or from under it.
#[derive(SystemParam)]
pub(crate) struct Suspects<'w, 's> {
    meshes: Query<'w, 's, Entity, (Changed<Mesh3d>, Without<LodUnit>)>,
    // One by one: a filter of all three would be asked for every entity that has any of them.
    auto: Query<'w, 's, Entity, Changed<AutoLod>>,
    no: Query<'w, 's, Entity, Added<NoLod>>,
    child_of: Query<'w, 's, Entity, (Changed<ChildOf>, Without<LodUnit>)>,
    removed_auto: RemovedComponents<'w, 's, AutoLod>,
    removed_no: RemovedComponents<'w, 's, NoLod>,
    removed_child_of: RemovedComponents<'w, 's, ChildOf>,
    all: Query<'w, 's, Entity, (With<Mesh3d>, Without<LodUnit>)>,
    children: Query<'w, 's, &'static Children>,
}

impl Suspects<'_, '_> {
    /// The entities to look at again, each once; `all` of them if asked.
    ///
    /// They are in order, so that entities which come together go on lying together in memory: Bevy
    /// goes through them in every frame.
    fn take(&mut self, all: bool) -> Vec<Entity> {
        let removed = self.removed_auto.read().chain(self.removed_no.read());
        let removed = removed.chain(self.removed_child_of.read());
        let children = &self.children;
        let roots = self.auto.iter().chain(&self.no).chain(&self.child_of);
        let below = roots
            .chain(removed)
            .flat_map(|root| std::iter::once(root).chain(children.iter_descendants(root)));
        let mut suspects: Vec<Entity> = self.meshes.iter().chain(below).collect();
        if all {
            suspects.extend(&self.all);
        }
        suspects.sort_unstable();
        suspects.dedup();
        suspects
    }
}

/// Finds mesh entities that came under an [`AutoLod`] or from under it, or whose mesh was exchanged.
pub(crate) fn find_objects(
    mut commands: Commands,
    mut world: ResMut<LodWorld>,
    mut suspects: Suspects,
    mut meshes: Query<(&Mesh3d, Option<&mut LodObject>), Without<LodUnit>>,
    lineage: Lineage,
) {
    for entity in suspects.take(lineage.config.is_changed()) {
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
