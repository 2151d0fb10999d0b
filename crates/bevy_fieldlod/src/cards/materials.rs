//! The materials of cards, each beside one of a program.

use std::ptr;
use std::sync::{Arc, Weak};

use bevy::asset::AssetId;
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;

use super::material::card_material;
use super::warm_up::WarmUps;
use super::{LodCards, MaterialOf};
use crate::lod_mesh::LodMesh;

/// The materials of cards.
#[derive(Resource, Default)]
pub(super) struct CardMaterials {
    /// By the material that they stand beside, those of each mesh.
    known: HashMap<AssetId<StandardMaterial>, Vec<CardMaterial>>,
    /// Entities that may have to get another one, or that wait for theirs.
    pub(super) to_dress: Vec<Entity>,
}

struct CardMaterial {
    mesh: Weak<LodMesh>,
    /// `None` if cards cannot stand for it.
    handle: Option<Handle<StandardMaterial>>,
    /// Lets pipelines be made, until they are.
    warm_up: Option<Entity>,
}

/// What there is to draw cards with.
pub(super) enum Dress {
    /// Pipelines are being made.
    NotYet,
    /// Cards cannot stand for it.
    Nothing,
    Ready(Handle<StandardMaterial>),
}

impl CardMaterials {
    /// Takes the entities to dress, and sees which pipelines are there.
    pub(super) fn take_entities(&mut self, warm_ups: &WarmUps) -> Vec<Entity> {
        if self.to_dress.is_empty() {
            return Vec::new();
        }
        self.known.retain(|_, all| {
            all.retain(|one| one.mesh.strong_count() > 0);
            !all.is_empty()
        });
        for one in self.known.values_mut().flatten() {
            one.warm_up = one.warm_up.filter(|&entity| warm_ups.is_there(entity));
        }
        let mut entities = std::mem::take(&mut self.to_dress);
        entities.sort_unstable();
        entities.dedup();
        entities
    }

    /// The material of the cards of a mesh beside `source`. The first time, `warm_up` lets the renderer make its
    /// pipelines.
    pub(super) fn find(
        &mut self,
        mesh: &Arc<LodMesh>,
        source: AssetId<StandardMaterial>,
        materials: &mut Assets<StandardMaterial>,
        warm_up: impl FnOnce(&Handle<StandardMaterial>) -> Option<Entity>,
    ) -> Dress {
        let all = self.known.entry(source).or_default();
        let known = all.iter().find(|one| ptr::eq(one.mesh.as_ptr(), &**mesh));
        if let Some(known) = known {
            return match (&known.handle, known.warm_up) {
                (None, _) => Dress::Nothing,
                (Some(_), Some(_)) => Dress::NotYet,
                (Some(handle), None) => Dress::Ready(handle.clone()),
            };
        }
        let wanted = wanted_material(mesh, source, materials);
        let handle = wanted.map(|wanted| materials.add(wanted));
        let warm_up = handle.as_ref().and_then(warm_up);
        let found = match (&handle, warm_up) {
            (None, _) => Dress::Nothing,
            (Some(_), Some(_)) => Dress::NotYet,
            (Some(handle), None) => Dress::Ready(handle.clone()),
        };
        all.push(CardMaterial {
            mesh: Arc::downgrade(mesh),
            handle,
            warm_up,
        });
        found
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
            AssetEvent::Removed { id } | AssetEvent::Unused { id } => {
                cards.known.remove(&id);
            }
            AssetEvent::LoadedWithDependencies { .. } => {}
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
