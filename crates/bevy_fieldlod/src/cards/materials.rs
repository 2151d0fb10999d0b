//! The materials of cards, each beside one of a program.

use std::sync::{Arc, Weak};
use std::{mem, ptr};

use bevy::asset::AssetId;
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;

use super::material::card_material;
use super::warm_up::WarmUps;
use super::{LodCards, MaterialOf};
use crate::scene::lod_mesh::LodMesh;

/// The materials of cards.
#[derive(Resource, Default)]
pub(super) struct CardMaterials {
    /// By the material that they stand beside, those of each mesh.
    known: HashMap<AssetId<StandardMaterial>, Vec<CardMaterial>>,
    /// Entities that may have to get another one.
    pub(super) to_dress: Vec<Entity>,
    /// Whether meshes may be gone that have some.
    pub(super) may_have_lost_meshes: bool,
    /// Whether something waits for pipelines.
    is_waiting: bool,
}

struct CardMaterial {
    mesh: Weak<LodMesh>,
    /// `None` if cards cannot stand for it.
    handle: Option<Handle<StandardMaterial>>,
    /// Lets pipelines be made, until they are.
    warm_up: Option<Entity>,
    /// Entities that wait for it.
    waiting: Vec<Entity>,
}

impl CardMaterials {
    /// Takes the entities to dress, and sees which pipelines are there.
    pub(super) fn take_entities(&mut self, warm_ups: &WarmUps) -> Vec<Entity> {
        if mem::take(&mut self.may_have_lost_meshes) {
            self.known.retain(|_, all| {
                all.retain(|one| one.mesh.strong_count() > 0);
                !all.is_empty()
            });
        }
        if mem::take(&mut self.is_waiting) {
            for one in self.known.values_mut().flatten() {
                one.warm_up = one.warm_up.filter(|&entity| warm_ups.is_there(entity));
                match one.warm_up {
                    Some(_) => self.is_waiting = true,
                    None => self.to_dress.append(&mut one.waiting),
                }
            }
        }
        let mut entities = mem::take(&mut self.to_dress);
        entities.sort_unstable();
        entities.dedup();
        entities
    }

    /// The material of the cards of a mesh beside `source`, for `entity`; `None` if cards cannot stand for it, or not
    /// yet. The first time, `warm_up` lets the renderer make its pipelines, and whatever asked is to be dressed again when
    /// they are there.
    pub(super) fn find(
        &mut self,
        entity: Entity,
        mesh: &Arc<LodMesh>,
        source: AssetId<StandardMaterial>,
        materials: &mut ResMut<Assets<StandardMaterial>>,
        warm_up: impl FnOnce(&Handle<StandardMaterial>) -> Option<Entity>,
    ) -> Option<Handle<StandardMaterial>> {
        let all = self.known.entry(source).or_default();
        let is_known = |one: &CardMaterial| ptr::eq(one.mesh.as_ptr(), &**mesh);
        let index = all.iter().position(is_known).unwrap_or_else(|| {
            let wanted = wanted_material(mesh, source, materials);
            let handle = wanted.map(|wanted| materials.add(wanted));
            all.push(CardMaterial {
                mesh: Arc::downgrade(mesh),
                warm_up: handle.as_ref().and_then(warm_up),
                handle,
                waiting: Vec::new(),
            });
            all.len() - 1
        });
        let known = &mut all[index];
        if known.warm_up.is_some() {
            known.waiting.push(entity);
            self.is_waiting = true;
            return None;
        }
        known.handle.clone()
    }

    /// Follows a change of the material `source`, and returns whether anything stands beside it. What changes in that
    /// pictures can stand for it, or no longer, is forgotten.
    fn follow(
        &mut self,
        source: AssetId<StandardMaterial>,
        materials: &mut Assets<StandardMaterial>,
    ) -> bool {
        let Some(all) = self.known.get_mut(&source) else {
            return false;
        };
        all.retain(|one| {
            let Some(mesh) = one.mesh.upgrade() else {
                return false;
            };
            let wanted = wanted_material(&mesh, source, materials);
            match (&one.handle, wanted) {
                (Some(handle), Some(wanted)) => materials.insert(handle, wanted).is_ok(),
                (None, None) => true,
                _ => false,
            }
        });
        true
    }
}

fn wanted_material(
    mesh: &LodMesh,
    source: AssetId<StandardMaterial>,
    materials: &Assets<StandardMaterial>,
) -> Option<StandardMaterial> {
    card_material(materials.get(source)?, mesh.cards.as_ref()?)
}

/// Follows materials that a program has changed.
pub(super) fn follow_changes(
    mut events: MessageReader<AssetEvent<StandardMaterial>>,
    mut cards: ResMut<CardMaterials>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut entities: Query<(Entity, &MaterialOf, &mut LodCards)>,
) {
    let mut changed = HashSet::new();
    for event in events.read() {
        match *event {
            AssetEvent::Modified { id } | AssetEvent::Added { id } => {
                if cards.follow(id, &mut materials) {
                    changed.insert(id);
                }
            }
            AssetEvent::Unused { id } => {
                cards.known.remove(&id);
            }
            // What a program has taken out may come back.
            AssetEvent::Removed { .. } | AssetEvent::LoadedWithDependencies { .. } => {}
        }
    }
    if changed.is_empty() {
        return;
    }
    for (entity, material, mut own) in &mut entities {
        if changed.contains(&material.id()) {
            own.set_changed();
            cards.to_dress.push(entity);
        }
    }
}
