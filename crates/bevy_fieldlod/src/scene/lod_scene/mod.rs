//! The plugin's picture of the world: the scene that cuts are selected from, and which entity draws what.

mod cuts;

use std::collections::VecDeque;
use std::sync::Arc;

use bevy::ecs::entity::EntityHashMap;
use bevy::math::Affine3A;
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
    /// Objects that are to be placed in the scene.
    pub(crate) new_objects: Vec<Entity>,
    /// Records of units that a view draws and that have no entity yet.
    pub(crate) units_to_spawn: Vec<u32>,
    /// How many more may be spawned in this frame.
    units_left: usize,
    /// Records of units that no view draws, each with the frame since when.
    pub(crate) idle_units: VecDeque<(u32, u32)>,
    /// Indices of instances whose whole mesh may have to change its level.
    pub(crate) whole_meshes_to_swap: Vec<u32>,
    /// Indices of instances whose shadows may have to be cast by another level.
    pub(crate) casters_to_choose: Vec<u32>,
    /// Names of meshes whose deviations were not measured, until a view asks for a guarantee.
    pub(crate) unmeasured: Vec<String>,
    /// By the index of their [`InstanceId`].
    instances: Vec<Option<LodInstance>>,
    instance_of: EntityHashMap<InstanceId>,
    /// Whether a view does not draw what is small.
    pub(crate) culls: bool,
    /// How many instances are cut into units.
    clustered_count: usize,
    /// Meshes out of use, to be freed in the frame after that in which their last instance went: until then
    /// views tell what left by them.
    retired: Vec<Arc<LodMesh>>,
    unused: Vec<Arc<LodMesh>>,
    frame: u32,
    /// Counts changes of what views may draw.
    pub(crate) revision: u64,
    /// By how much errors count for less, as memory is short; `None` if no mesh is read in parts.
    pub(crate) coarsening: Option<f32>,
}

/// The layer that entities are on unless told otherwise, as [`layer_bits`](crate::scene::view_cut::layer_bits).
pub(crate) const FIRST_LAYER: u64 = 1;

/// An entity with levels of detail.
pub(crate) struct LodInstance {
    pub(crate) id: InstanceId,
    pub(crate) entity: Entity,
    pub(crate) mesh: Arc<LodMesh>,
    /// Its draw record.
    pub(crate) record: u32,
    /// The layers that it is drawn on; none while it is hidden.
    pub(crate) layers: u64,
    /// The piece with which the entity itself draws the whole mesh: a level, or what stands in for one of cards. `None`
    /// where units draw it.
    pub(crate) piece: Option<u32>,
    /// Units with a draw record, in ascending order, each with its record. Those of a whole mesh are levels that
    /// only cast shadows.
    pub(crate) units: Vec<(u32, u32)>,
}

impl LodInstance {
    /// The draw record of a unit; a new one, with `true`, if it has none.
    fn record_of(&mut self, unit: u32, records: &mut DrawRecords) -> (u32, bool) {
        match self.find_unit(unit) {
            Ok(position) => (self.units[position].1, false),
            Err(position) => {
                let triangles = self.mesh.pieces[unit as usize].triangles;
                let record = records.add_unit(self.id.index() as u32, unit, triangles);
                self.units.insert(position, (unit, record));
                (record, true)
            }
        }
    }

    /// The position of a unit among those with a record, or where it belongs.
    fn find_unit(&self, unit: u32) -> Result<usize, usize> {
        self.units.binary_search_by_key(&unit, |&(unit, _)| unit)
    }
}

/// How much larger an instance is along the axis along which it is scaled most.
pub(crate) fn largest_scale(world_from_local: &Affine3A) -> f32 {
    let axis = |index: usize| world_from_local.matrix3.col(index).length();
    axis(0).max(axis(1)).max(axis(2))
}

impl LodScene {
    /// Frees a mesh as soon as no instance uses it.
    pub(crate) fn retire(&mut self, mesh: Arc<LodMesh>) {
        self.retired.push(mesh);
    }

    /// Adds an entity or moves it.
    pub(crate) fn place(
        &mut self,
        entity: Entity,
        transform: &GlobalTransform,
        object: &LodObject,
        layers: u64,
    ) {
        let LodObject { mesh, auto_lod } = object;
        self.revision += 1;
        // One that is known has only moved.
        if let Some(&id) = self.instance_of.get(&entity) {
            let before = largest_scale(&self.scene.placement(id));
            let now = largest_scale(&transform.affine());
            self.scene.set_placement(id, transform.affine());
            // Turning leaves some rounding.
            if (now - before).abs() > 1e-5 * before {
                self.choose_casters_of(id);
            }
            return;
        }
        // A new entity starts at its finest level, or without any unit.
        let (kind, piece) = if mesh.kind == LodKind::WholeMesh {
            (DrawKind::WholeMesh, Some(0))
        } else {
            self.clustered_count += 1;
            (DrawKind::Source, None)
        };
        let record = self.records.add_entity(entity, kind, mesh.triangles_full);
        // Ids are of the scene; what we know of an instance lies at their index.
        let id = self
            .scene
            .add_instance(mesh.id, transform.affine(), auto_lod.bias);
        self.scene.set_layers(id, layers);
        if auto_lod.forced_level.is_some() {
            self.scene.set_forced_level(id, auto_lod.forced_level);
        }
        if self.instances.len() <= id.index() {
            self.instances.resize_with(id.index() + 1, || None);
        }
        self.instances[id.index()] = Some(LodInstance {
            id,
            entity,
            mesh: mesh.clone(),
            record,
            layers,
            piece,
            units: Vec::new(),
        });
        self.instance_of.insert(entity, id);
        self.update_numbers(id);
        self.choose_casters_of(id);
    }

    /// Lets the shadows of a whole mesh be cast by another level, if they should be.
    fn choose_casters_of(&mut self, id: InstanceId) {
        let instance = self.instance(id.index() as u32);
        if instance.is_some_and(|instance| instance.piece.is_some()) {
            self.casters_to_choose.push(id.index() as u32);
        }
    }

    /// Brings up to date what is counted of an instance without a look at it.
    fn update_numbers(&mut self, id: InstanceId) {
        let Some(Some(instance)) = self.instances.get(id.index()) else {
            return;
        };
        let mesh = &instance.mesh;
        let numbers = match instance.piece {
            _ if instance.layers == 0 => Some([0; 3]),
            Some(piece) if instance.layers == FIRST_LAYER => {
                let drawn = mesh.pieces[piece as usize].triangles;
                Some([mesh.triangles_full, drawn, 1])
            }
            _ => None,
        };
        self.scene.set_numbers(id, numbers);
    }

    /// Sets how much the errors of an entity count, and whether its level is forced.
    pub(crate) fn set_auto_lod(&mut self, entity: Entity, auto_lod: &AutoLod) {
        if let Some(&id) = self.instance_of.get(&entity) {
            self.scene.set_bias(id, auto_lod.bias);
            self.scene.set_forced_level(id, auto_lod.forced_level);
            self.choose_casters_of(id);
        }
    }

    /// Sets whether an entity may hide others.
    pub(crate) fn set_occluder(&mut self, entity: Entity, is_occluder: bool) {
        if let Some(&id) = self.instance_of.get(&entity) {
            self.scene.set_occluder(id, is_occluder);
        }
    }

    /// Sets the layers that an entity is drawn on.
    pub(crate) fn set_layers(&mut self, entity: Entity, layers: u64) {
        let Some(&id) = self.instance_of.get(&entity) else {
            return;
        };
        self.revision += 1;
        self.scene.set_layers(id, layers);
        if let Some(instance) = &mut self.instances[id.index()] {
            instance.layers = layers;
            // Views without a cut hear of it here.
            self.whole_meshes_to_swap.push(id.index() as u32);
            self.update_numbers(id);
        }
    }

    /// Removes an entity and returns the entities of its units.
    pub(crate) fn remove(&mut self, entity: Entity) -> Vec<Entity> {
        let Some(id) = self.instance_of.remove(&entity) else {
            return Vec::new();
        };
        self.revision += 1;
        self.choose_casters_of(id);
        self.scene.remove(id);
        self.records.free_entity(entity);
        // Units go with their object.
        let Some(instance) = self.instances[id.index()].take() else {
            return Vec::new();
        };
        self.clustered_count -= usize::from(instance.piece.is_none());
        let records = instance.units.iter().map(|&(_, record)| record);
        records
            .filter_map(|record| self.records.free(record))
            .collect()
    }

    /// Whether any entity has units, or is to have some.
    pub(crate) fn has_units(&self) -> bool {
        self.clustered_count > 0 || self.records.has_units()
    }

    /// Whether views draw less than what is visible: anything has units, or is culled by its size.
    pub(crate) fn is_filtered(&self) -> bool {
        self.has_units() || self.culls
    }

    pub(crate) fn instance(&self, index: u32) -> Option<&LodInstance> {
        self.instances.get(index as usize)?.as_ref()
    }

    pub(crate) fn instance_of(&self, entity: Entity) -> Option<&LodInstance> {
        self.instance(self.instance_of.get(&entity)?.index() as u32)
    }

    /// The entities that are cut into units.
    pub(crate) fn sources(&self) -> impl Iterator<Item = Entity> {
        let instances = self.instances.iter().flatten();
        let sources = instances.filter(|one| one.piece.is_none());
        sources.map(|instance| instance.entity)
    }

    #[cfg(feature = "debug")]
    pub(crate) fn instances(&self) -> impl Iterator<Item = &LodInstance> {
        self.instances.iter().flatten()
    }

    /// Whether an instance is there.
    pub(crate) fn has(&self, id: InstanceId) -> bool {
        let instance = self.instance(id.index() as u32);
        instance.is_some_and(|instance| instance.id == id)
    }

    /// The indices that instances may have.
    pub(crate) fn indices(&self) -> std::ops::Range<u32> {
        0..self.instances.len() as u32
    }

    /// Notes that a whole mesh is drawn with another piece.
    pub(crate) fn set_piece(&mut self, index: u32, piece: u32) {
        let Some(instance) = &mut self.instances[index as usize] else {
            return;
        };
        self.revision += 1;
        instance.piece = Some(piece);
        let triangles = instance.mesh.pieces[piece as usize].triangles;
        self.records.set_triangles(instance.entity, triangles);
        let id = instance.id;
        self.update_numbers(id);
        self.choose_casters_of(id);
    }

    /// Notes that someone else gave a whole mesh its finest level.
    pub(crate) fn reset_level(&mut self, entity: Entity) {
        self.set_piece_of(entity, 0);
        self.choose_again(entity);
    }

    /// Notes that a whole mesh was given another piece.
    pub(crate) fn set_piece_of(&mut self, entity: Entity, piece: u32) {
        if let Some(&id) = self.instance_of.get(&entity) {
            self.set_piece(id.index() as u32, piece);
        }
    }

    /// Lets a whole mesh choose its level anew.
    pub(crate) fn choose_again(&mut self, entity: Entity) {
        if let Some(&id) = self.instance_of.get(&entity) {
            self.whole_meshes_to_swap.push(id.index() as u32);
            self.casters_to_choose.push(id.index() as u32);
        }
    }

    /// Lets all whole meshes choose their level anew.
    pub(crate) fn swap_all_whole_meshes(&mut self) {
        let instances = self.instances.iter().flatten();
        let whole_meshes = instances.filter(|instance| instance.piece.is_some());
        let indices = whole_meshes.map(|instance| instance.id.index() as u32);
        self.whole_meshes_to_swap.extend(indices);
    }

    /// Frees meshes and records that are out of use, before the cuts of a frame are selected.
    pub(crate) fn begin_frame<'a>(
        &mut self,
        views: impl Iterator<Item = &'a mut CutVisibility>,
        units_per_frame: Option<usize>,
    ) {
        self.frame = self.frame.wrapping_add(1);
        // Units that are to be spawned again come first.
        let most = units_per_frame.map_or(usize::MAX, |most| most.max(1));
        self.units_left = most.saturating_sub(self.units_to_spawn.len());
        // A mesh goes with its last instance, once all views know.
        for mesh in self.unused.drain(..) {
            self.scene.remove_mesh(mesh.id);
        }
        let is_unused = |mesh: &mut Arc<LodMesh>| Arc::strong_count(mesh) == 1;
        self.unused.extend(self.retired.extract_if(.., is_unused));
        // A record goes once no view counts it as visible.
        if !self.records.freed().is_empty() {
            views.for_each(|view| view.remove(self.records.freed()));
            self.records.recycle();
        }
        self.scene.update();
    }
}
