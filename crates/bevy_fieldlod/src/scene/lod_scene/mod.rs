//! The scene that cuts are selected from, and the entity that draws each part of the scene.

mod cuts;

use std::collections::VecDeque;
use std::sync::Arc;

use bevy::ecs::entity::EntityHashMap;
use bevy::math::{Affine3A, Vec3A};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use fieldlod_select::{InstanceId, Scene};

use crate::api::auto_lod::AutoLod;
use crate::api::config::LodKind;
use crate::scene::draw_records::{DrawKind, DrawRecords};
use crate::scene::lod_mesh::{LodMesh, LodObject};
use crate::scene::view_cut::CutVisibility;

/// All instances, and the units that some view draws.
#[derive(Resource, Default)]
pub(crate) struct LodScene {
    pub(crate) scene: Scene,
    pub(crate) records: DrawRecords,
    /// Objects to place in the scene.
    pub(crate) new_objects: Vec<Entity>,
    /// Records of units that a view draws and that have no entity yet.
    pub(crate) units_to_spawn: Vec<u32>,
    /// Records of units that no view draws, each with the frame in which the last view stopped.
    pub(crate) idle_units: VecDeque<(u32, u32)>,
    /// Indices of instances whose whole mesh may need another level.
    pub(crate) whole_meshes_to_swap: Vec<u32>,
    /// Indices of instances outside all views whose whole mesh may get a coarser level.
    pub(crate) coarser_outside: VecDeque<u32>,
    /// Indexed by [`InstanceId::index`].
    instances: Vec<Option<LodInstance>>,
    instance_of: EntityHashMap<InstanceId>,
    /// Triangles of the source meshes of all instances, by the layers of the instances.
    triangles_on_layers: HashMap<u64, u64>,
    /// Whether some source mesh is incomplete, so that views draw cuts even at full detail.
    pub(crate) has_incomplete_sources: bool,
    /// How many instances are drawn as units.
    clustered_count: usize,
    /// Meshes that no entity requests, and those of them without instances. A mesh is freed one frame after its last
    /// instance, because the changes of that frame still refer to it.
    retired: Vec<Arc<LodMesh>>,
    unused: Vec<Arc<LodMesh>>,
    /// Counts frames.
    frame: u32,
}

/// An entity with levels of detail.
pub(crate) struct LodInstance {
    pub(crate) id: InstanceId,
    pub(crate) entity: Entity,
    pub(crate) mesh: Arc<LodMesh>,
    /// The layers that it is drawn on; 0 while it is hidden or has no area.
    pub(crate) layers: u64,
    /// The layers that it is on; 0 while it is hidden.
    shown_on: u64,
    /// The level that the entity itself draws as a whole mesh; `None` if units draw it.
    pub(crate) level: Option<u32>,
    /// Whether it is in [`LodScene::coarser_outside`].
    coarsens_later: bool,
    /// Units with a draw record, in ascending order, each with its record.
    pub(crate) units: Vec<(u32, u32)>,
}

impl LodInstance {
    /// The draw record of a unit, and whether it is new.
    fn record_of(&mut self, unit: u32, records: &mut DrawRecords) -> (u32, bool) {
        match self.find_unit(unit) {
            Ok(position) => (self.units[position].1, false),
            Err(position) => {
                let record = records.add_unit(self.id.index() as u32, unit);
                self.units.insert(position, (unit, record));
                (record, true)
            }
        }
    }

    /// The position of a unit in [`LodInstance::units`], or where to insert it.
    fn find_unit(&self, unit: u32) -> Result<usize, usize> {
        self.units.binary_search_by_key(&unit, |&(unit, _)| unit)
    }
}

/// Whether a placed surface has an area and a place. Otherwise Bevy draws no pixel of it, and no error would be small
/// enough.
fn has_area(world_from_local: Affine3A) -> bool {
    let [x, y, z] = [0, 1, 2].map(|axis| world_from_local.matrix3.col(axis));
    let areas = [x.cross(y), y.cross(z), z.cross(x)];
    world_from_local.is_finite() && areas.iter().any(|area| *area != Vec3A::ZERO)
}

impl LodScene {
    /// Frees a mesh as soon as no instance uses it.
    pub(crate) fn retire(&mut self, mesh: Arc<LodMesh>) {
        self.retired.push(mesh);
    }

    /// Adds an entity, unless it was added.
    pub(crate) fn add(
        &mut self,
        entity: Entity,
        world_from_local: Affine3A,
        object: &LodObject,
        layers: u64,
    ) -> InstanceId {
        if let Some(&id) = self.instance_of.get(&entity) {
            return id;
        }
        let LodObject { mesh, auto_lod, .. } = object;
        // Bevy draws the source of a new entity: the finest level, or a source of units that no cut has replaced yet.
        let (kind, level) = if mesh.kind == LodKind::WholeMesh {
            (DrawKind::WholeMesh, Some(0))
        } else {
            self.clustered_count += 1;
            (DrawKind::Source, None)
        };
        self.records.add_entity(entity, kind);
        let id = self
            .scene
            .add_instance(mesh.id, world_from_local, auto_lod.bias);
        let shown_on = layers;
        let layers = if has_area(world_from_local) {
            layers
        } else {
            0
        };
        self.scene.set_layers(id, layers);
        if self.instances.len() <= id.index() {
            self.instances.resize_with(id.index() + 1, || None);
        }
        self.instances[id.index()] = Some(LodInstance {
            id,
            entity,
            mesh: mesh.clone(),
            layers,
            shown_on,
            level,
            coarsens_later: false,
            units: Vec::new(),
        });
        self.instance_of.insert(entity, id);
        *self.triangles_on(layers) += u64::from(mesh.triangles_full);
        id
    }

    fn triangles_on(&mut self, layers: u64) -> &mut u64 {
        self.triangles_on_layers.entry(layers).or_default()
    }

    /// Triangles of the source meshes of all instances on any of `layers`.
    pub(crate) fn full_triangles(&self, layers: u64) -> u64 {
        let sums = self.triangles_on_layers.iter();
        let seen = sums.filter(|(on, _)| **on & layers != 0);
        seen.map(|(_, triangles)| triangles).sum()
    }

    /// Sets the weight of an entity's errors.
    pub(crate) fn set_auto_lod(&mut self, entity: Entity, auto_lod: &AutoLod) {
        if let Some(&id) = self.instance_of.get(&entity) {
            self.scene.set_bias(id, auto_lod.bias);
        }
    }

    /// Moves an instance.
    pub(crate) fn set_placement(&mut self, id: InstanceId, world_from_local: Affine3A) {
        let had_area = self.scene.placement(id).is_some_and(has_area);
        self.scene.set_placement(id, world_from_local);
        if had_area != has_area(world_from_local) {
            self.update_layers(id);
        }
    }

    /// Sets the layers that an entity is on; 0 if it is hidden.
    pub(crate) fn set_layers(&mut self, entity: Entity, layers: u64) {
        let Some(&id) = self.instance_of.get(&entity) else {
            return;
        };
        if let Some(instance) = &mut self.instances[id.index()] {
            instance.shown_on = layers;
            self.update_layers(id);
        }
    }

    fn update_layers(&mut self, id: InstanceId) {
        let has_area = self.scene.placement(id).is_some_and(has_area);
        let instance = self.instances[id.index()].as_mut();
        let Some(instance) = instance.filter(|instance| instance.id == id) else {
            return;
        };
        let layers = if has_area { instance.shown_on } else { 0 };
        if instance.layers != layers {
            self.scene.set_layers(id, layers);
            let before = std::mem::replace(&mut instance.layers, layers);
            let triangles = u64::from(instance.mesh.triangles_full);
            *self.triangles_on(before) -= triangles;
            *self.triangles_on(layers) += triangles;
            // Selectors report the change to views with a cut. Other views draw the object or not by its layers alone.
            self.whole_meshes_to_swap.push(id.index() as u32);
        }
    }

    /// Removes an entity and returns the entities of its units.
    pub(crate) fn remove(&mut self, entity: Entity) -> Vec<Entity> {
        let Some(id) = self.instance_of.remove(&entity) else {
            return Vec::new();
        };
        self.scene.remove(id);
        self.records.free_entity(entity);
        let Some(instance) = self.instances[id.index()].take() else {
            return Vec::new();
        };
        *self.triangles_on(instance.layers) -= u64::from(instance.mesh.triangles_full);
        self.clustered_count -= usize::from(instance.level.is_none());
        let records = instance.units.iter().map(|&(_, record)| record);
        records
            .filter_map(|record| self.records.free(record))
            .collect()
    }

    /// Whether any entity has units, or will have some.
    pub(crate) fn has_units(&self) -> bool {
        self.clustered_count > 0
    }

    pub(crate) fn instance(&self, index: u32) -> Option<&LodInstance> {
        self.instances.get(index as usize)?.as_ref()
    }

    pub(crate) fn instance_of(&self, entity: Entity) -> Option<&LodInstance> {
        self.instance(self.instance_of.get(&entity)?.index() as u32)
    }

    /// The entities that draw the units of an instance, each with its unit.
    pub(crate) fn units_of(&self, instance: &LodInstance) -> impl Iterator<Item = (Entity, u32)> {
        let units = instance.units.iter();
        units.filter_map(|&(unit, record)| Some((self.records.entity(record)?, unit)))
    }

    /// The entities that are drawn as units.
    pub(crate) fn sources(&self) -> impl Iterator<Item = Entity> {
        let instances = self.instances.iter().flatten();
        let sources = instances.filter(|one| one.level.is_none());
        sources.map(|instance| instance.entity)
    }

    #[cfg(feature = "debug")]
    pub(crate) fn instances(&self) -> impl Iterator<Item = &LodInstance> {
        self.instances.iter().flatten()
    }

    /// Whether a whole mesh is drawn at a finer level than `wanted`. New instances are drawn at the finest level, which
    /// no view may have wanted: it does not count.
    pub(crate) fn is_finer_than(&self, index: u32, wanted: Option<u32>) -> bool {
        let level = self.instance(index).and_then(|one| one.level);
        level > Some(0) && level < wanted
    }

    /// Queues a whole mesh outside all views for a coarser level.
    pub(crate) fn coarsen_later(&mut self, index: u32) {
        if let Some(instance) = &mut self.instances[index as usize]
            && !std::mem::replace(&mut instance.coarsens_later, true)
        {
            self.coarser_outside.push_back(index);
        }
    }

    /// The next whole meshes of the queue.
    pub(crate) fn take_coarser(&mut self, most: usize) -> Vec<u32> {
        let most = most.min(self.coarser_outside.len());
        let next: Vec<u32> = self.coarser_outside.drain(..most).collect();
        for &index in &next {
            if let Some(instance) = &mut self.instances[index as usize] {
                instance.coarsens_later = false;
            }
        }
        next
    }

    /// Records the level that a whole mesh is drawn at.
    pub(crate) fn set_level(&mut self, index: u32, level: u32) {
        if let Some(instance) = &mut self.instances[index as usize] {
            instance.level = Some(level);
        }
    }

    /// Queues all whole meshes for an update of their level.
    pub(crate) fn swap_all_whole_meshes(&mut self) {
        let instances = self.instances.iter().flatten();
        let whole_meshes = instances.filter(|instance| instance.level.is_some());
        let indices = whole_meshes.map(|instance| instance.id.index() as u32);
        self.whole_meshes_to_swap.extend(indices);
    }

    /// Frees unused meshes and records, before the cuts of a frame are selected.
    pub(crate) fn begin_frame<'a>(&mut self, views: impl Iterator<Item = &'a mut CutVisibility>) {
        self.frame = self.frame.wrapping_add(1);
        // Meshes that became unused in the last frame. Each view has selected without their instances since.
        for mesh in self.unused.drain(..) {
            self.scene.remove_mesh(mesh.id);
        }
        let is_unused = |mesh: &mut Arc<LodMesh>| Arc::strong_count(mesh) == 1;
        self.unused.extend(self.retired.extract_if(.., is_unused));
        // A record is reused only after every view has cleared its bit: otherwise a new unit would be in the cut of an
        // old one.
        if !self.records.freed().is_empty() {
            views.for_each(|view| view.remove(self.records.freed()));
            self.records.recycle();
        }
        self.scene.update();
    }
}
