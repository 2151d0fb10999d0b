//! Updates the lists of visible entities in the render world, where the GPU culls.
//!
//! Bevy adds every entity with `NoCpuCulling` to the lists of all views on its layers. This module removes units and
//! their sources from the lists of views that do not draw them, and adds them again as cuts change. Shadow views have
//! the lists of their camera. Views that are newer than an entity, or that change their layers, get new lists: Bevy
//! adds only changed entities, and treats a view without layers as one that sees all layers.

use std::any::TypeId;

use bevy::camera::visibility::RenderLayers;
use bevy::pbr::{
    RenderGpuCulledEntities, RenderMeshInstanceFlags, RenderMeshInstances,
    collect_gpu_culled_meshes, set_mesh_motion_vector_flags,
};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::render::sync_world::{MainEntity, MainEntityHashMap, MainEntityHashSet};
use bevy::render::view::{
    ExtractedView, RenderShadowMapVisibleEntities, RenderVisibleEntities,
    RenderVisibleEntitiesClass, RetainedViewEntity,
};
use bevy::render::{Extract, ExtractSchedule, Render, RenderApp, RenderSystems};

use crate::compat::{camera_of_cascade, list_of_subview};
use crate::draw::list_changes::{ListChange, ListChanges};

/// Which views draw which entities.
#[derive(Resource, Default)]
struct ListedEntities {
    /// Units and sources of units. A view draws those that it marks, and all other entities.
    listed: MainEntityHashSet,
    marked: MainEntityHashMap<MainEntityHashSet>,
    shadow_view: Option<MainEntity>,
    /// Entities to update in every list in this frame.
    changed: Vec<MainEntity>,
    /// The layers and the camera of each list at its last full update.
    made_for: HashMap<RetainedViewEntity, (RenderLayers, Option<MainEntity>)>,
}

/// Marks lists that this module has updated, as an empty class.
struct KeptList;

/// Updates the lists, if there is a renderer.
pub(crate) fn plugin(app: &mut App) {
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .init_resource::<ListedEntities>()
        .add_systems(ExtractSchedule, extract_changes)
        .add_systems(
            Render,
            update_lists
                // Bevy adds new entities to all lists before.
                .after(collect_gpu_culled_meshes)
                .before(set_mesh_motion_vector_flags)
                .in_set(RenderSystems::PrepareMeshes),
        );
}

fn extract_changes(changes: Extract<Res<ListChanges>>, mut lists: ResMut<ListedEntities>) {
    lists.changed.clear();
    for change in changes.take() {
        lists.apply(change);
    }
}

impl ListedEntities {
    fn apply(&mut self, change: ListChange) {
        match change {
            ListChange::Add(entity) => {
                self.listed.insert(entity);
                self.changed.push(entity);
            }
            // Bevy may reuse the entity for one that all views draw.
            ListChange::Remove(entity) => {
                self.listed.remove(&entity);
                for marked in self.marked.values_mut() {
                    marked.remove(&entity);
                }
                self.changed.push(entity);
            }
            ListChange::Mark {
                view,
                entity,
                is_marked,
            } => {
                let marked = self.marked.entry(view).or_default();
                if is_marked {
                    marked.insert(entity);
                } else {
                    marked.remove(&entity);
                }
                self.changed.push(entity);
            }
            ListChange::Touch(entity) => self.changed.push(entity),
            ListChange::RemoveView(view) => {
                self.marked.remove(&view);
            }
            ListChange::ShareShadows(view) => self.shadow_view = view,
        }
    }

    /// Whether the cut of a camera draws an entity.
    fn draws(&self, camera: Option<MainEntity>, entity: &MainEntity) -> bool {
        let marked = camera.and_then(|camera| self.marked.get(&camera));
        !self.listed.contains(entity) || marked.is_some_and(|marked| marked.contains(entity))
    }
}

/// Updates the list of every camera and of every shadow view.
fn update_lists(
    mut cameras: Query<(
        &ExtractedView,
        Option<&RenderLayers>,
        &mut RenderVisibleEntities,
    )>,
    mut lights: Query<(Option<&RenderLayers>, &mut RenderShadowMapVisibleEntities)>,
    culled: Res<RenderGpuCulledEntities>,
    instances: Res<RenderMeshInstances>,
    mut lists: ResMut<ListedEntities>,
) {
    let shadow_view = lists.shadow_view;
    // Bevy's CPU culling lists only shadow casters, too.
    let casts_shadow = |entity: &MainEntity| {
        let instance = instances.render_mesh_queue_data(*entity);
        instance.is_none_or(|one| one.flags().contains(RenderMeshInstanceFlags::SHADOW_CASTER))
    };
    let mut made = 0;
    for (view, layers, mut list) in &mut cameras {
        let key = view.retained_view_entity;
        let layers = layers.unwrap_or_default();
        let camera = Some(key.main_entity);
        lists.update(&culled, key, layers, camera, &mut list, |_| true);
        made += 1;
    }
    for (layers, mut subviews) in &mut lights {
        let layers = layers.unwrap_or_default();
        for (&key, list) in &mut subviews.subviews {
            // Cascades belong to a camera; all cameras share the other shadow maps.
            let camera = camera_of_cascade(&key).or(shadow_view);
            lists.update(
                &culled,
                key,
                layers,
                camera,
                list_of_subview(list),
                casts_shadow,
            );
            made += 1;
        }
    }
    // Bounds the memory for views that were removed.
    if lists.made_for.len() > 2 * made + 16 {
        lists.made_for.clear();
    }
}

impl ListedEntities {
    fn update(
        &mut self,
        culled: &RenderGpuCulledEntities,
        key: RetainedViewEntity,
        layers: &RenderLayers,
        camera: Option<MainEntity>,
        list: &mut RenderVisibleEntities,
        is_seen: impl Fn(&MainEntity) -> bool,
    ) {
        // A list that Bevy has replaced has no mark.
        let is_marked = list.classes.contains_key(&TypeId::of::<KeptList>());
        let made_for = self.made_for.get(&key);
        let is_same = made_for.is_some_and(|(on, of)| on == layers && *of == camera);
        list.classes.entry(TypeId::of::<KeptList>()).or_default();
        let list = list.classes.entry(TypeId::of::<Mesh3d>()).or_default();
        let is_wanted = |entity: &MainEntity| {
            let on_layers = culled.entities.get(entity);
            let is_on_layers = on_layers.is_some_and(|on| layers.intersects(on));
            is_on_layers && is_seen(entity) && self.draws(camera, entity)
        };
        // An up-to-date list can differ in changed entities only.
        if is_marked && is_same {
            let changed = culled.added.iter().chain(&culled.changed_layers);
            let changed = changed.chain(&self.changed);
            update_entities(list, changed, is_wanted);
        } else {
            // Listed entities that the GPU does not cull must leave the list.
            let known: Vec<MainEntity> = list.entities_gpu_culling.keys().copied().collect();
            update_entities(list, culled.entities.keys().chain(&known), is_wanted);
            self.made_for.insert(key, (layers.clone(), camera));
        }
    }
}

/// Adds wanted entities to a list and removes the others.
fn update_entities<'a>(
    list: &mut RenderVisibleEntitiesClass,
    entities: impl Iterator<Item = &'a MainEntity>,
    is_wanted: impl Fn(&MainEntity) -> bool,
) {
    let (mut any_added, mut any_removed) = (false, false);
    for &entity in entities {
        // Meshes have no entities in the render world.
        let pair = (Entity::PLACEHOLDER, entity);
        let is_listed = list.entities_gpu_culling.contains_key(&entity);
        match (is_listed, is_wanted(&entity)) {
            (false, true) => {
                list.entities_gpu_culling
                    .insert(entity, Entity::PLACEHOLDER);
                list.added_entities.push(pair);
                any_added = true;
            }
            (true, false) => {
                list.entities_gpu_culling.remove(&entity);
                list.removed_entities.push(pair);
                any_removed = true;
            }
            _ => {}
        }
    }
    // Entities that Bevy added in this frame and that were removed here are not new.
    if any_removed {
        let listed = &list.entities_gpu_culling;
        let on_cpu = &list.entities_cpu_culling;
        list.added_entities.retain(|pair| {
            listed.contains_key(&pair.1)
                || on_cpu.binary_search_by_key(&pair.1, |pair| pair.1).is_ok()
        });
    }
    if any_added {
        list.sort_added_entities();
    }
}
