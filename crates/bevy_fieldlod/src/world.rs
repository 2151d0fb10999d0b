//! The plugin's own picture of the world: the scene that is selected from, and who draws what.

use std::collections::VecDeque;
use std::sync::Arc;

use bevy::ecs::entity::EntityHashMap;
use bevy::prelude::*;
use fieldlod_select::{Change, GroupTable, InstanceId, MeshId, Scene};

use crate::LodKind;
use crate::library::LodMesh;
use crate::marks::ViewMarks;
use crate::slots::{SlotKind, Slots};
use crate::views::ViewCuts;

/// All instances, and the units that some view draws.
#[derive(Resource, Default)]
pub(crate) struct LodWorld {
    pub(crate) scene: Scene,
    pub(crate) slots: Slots,
    /// New objects, to be placed.
    pub(crate) came: Vec<Entity>,
    /// By the index of their [`InstanceId`].
    instances: Vec<Option<Instance>>,
    instance_of: EntityHashMap<InstanceId>,
    /// Instances cut into units.
    cluster_count: usize,
    /// Meshes that the library forgot; freed with their last instance.
    retired: Vec<Arc<LodMesh>>,
    /// Slots of units that a view wants and no entity draws yet.
    pub(crate) wanted: Vec<u32>,
    /// Slots of units that no view draws, and when that began.
    idle: VecDeque<(u32, u32)>,
    /// Chains that may have to change their level, as indices of instances.
    pub(crate) restless: Vec<u32>,
    frame: u32,
}

/// An entity with levels of detail.
pub(crate) struct Instance {
    pub(crate) id: InstanceId,
    pub(crate) entity: Entity,
    pub(crate) mesh: Arc<LodMesh>,
    pub(crate) drawn: Drawn,
}

pub(crate) enum Drawn {
    /// The entity wears the mesh of this level.
    Chain { level: u32 },
    /// The units that have a slot, ascending, each with it.
    Units(Vec<(u32, u32)>),
}

/// Where `unit` is in a list of units, or belongs.
fn place_of(units: &[(u32, u32)], unit: u32) -> Result<usize, usize> {
    units.binary_search_by_key(&unit, |&(unit, _)| unit)
}

impl LodWorld {
    pub(crate) fn add_mesh(&mut self, table: GroupTable) -> MeshId {
        self.scene.add_table(table)
    }

    /// Frees a mesh as soon as no instance has it.
    pub(crate) fn retire(&mut self, mesh: Arc<LodMesh>) {
        self.retired.push(mesh);
    }

    /// Adds an entity or moves it.
    pub(crate) fn place(
        &mut self,
        entity: Entity,
        transform: &GlobalTransform,
        mesh: &Arc<LodMesh>,
        bias: f32,
    ) {
        if let Some(&id) = self.instance_of.get(&entity) {
            self.scene.set_placement(id, transform.affine());
            return;
        }
        let id = self.scene.add_instance(mesh.id, transform.affine(), bias);
        let is_chain = mesh.kind == LodKind::Chain;
        let (kind, drawn) = if is_chain {
            (SlotKind::Whole, Drawn::Chain { level: 0 })
        } else {
            self.cluster_count += 1;
            (SlotKind::Source, Drawn::Units(Vec::new()))
        };
        self.slots.add_entity(entity, kind, mesh.triangles_full);
        let instance = Instance {
            id,
            entity,
            mesh: mesh.clone(),
            drawn,
        };
        if self.instances.len() <= id.index() {
            self.instances.resize_with(id.index() + 1, || None);
        }
        self.instances[id.index()] = Some(instance);
        self.instance_of.insert(entity, id);
    }

    pub(crate) fn set_bias(&mut self, entity: Entity, bias: f32) {
        if let Some(&id) = self.instance_of.get(&entity) {
            self.scene.set_bias(id, bias);
        }
    }

    /// Takes an entity out and hands out the entities of its units.
    pub(crate) fn remove(&mut self, entity: Entity) -> Vec<Entity> {
        let Some(id) = self.instance_of.remove(&entity) else {
            return Vec::new();
        };
        self.scene.remove(id);
        let Some(instance) = self.instances[id.index()].take() else {
            return Vec::new();
        };
        self.slots.free_entity(entity);
        let Drawn::Units(units) = instance.drawn else {
            return Vec::new();
        };
        self.cluster_count -= 1;
        let slots = &mut self.slots;
        units
            .iter()
            .filter_map(|&(_, slot)| slots.free(slot))
            .collect()
    }

    /// Whether any entity is cut into units.
    pub(crate) fn has_clusters(&self) -> bool {
        self.cluster_count > 0
    }

    pub(crate) fn instance(&self, index: u32) -> Option<&Instance> {
        self.instances.get(index as usize)?.as_ref()
    }

    pub(crate) fn instance_of(&self, entity: Entity) -> Option<&Instance> {
        self.instance(self.instance_of.get(&entity)?.index() as u32)
    }

    #[cfg(feature = "debug")]
    pub(crate) fn instances(&self) -> impl Iterator<Item = &Instance> {
        self.instances.iter().flatten()
    }

    /// Notes that a chain wears another level.
    pub(crate) fn set_level(&mut self, index: u32, level: u32) {
        let Some(instance) = &mut self.instances[index as usize] else {
            return;
        };
        instance.drawn = Drawn::Chain { level };
        let triangles = instance.mesh.pieces[level as usize].triangles;
        self.slots.set_triangles(instance.entity, triangles);
    }

    /// Notes that a chain was given the mesh of its finest level by someone else.
    pub(crate) fn reset_level(&mut self, entity: Entity) {
        if let Some(&id) = self.instance_of.get(&entity) {
            self.set_level(id.index() as u32, 0);
            self.restless.push(id.index() as u32);
        }
    }

    /// Makes all chains look for their level anew.
    pub(crate) fn stir_chains(&mut self) {
        let chains = self.instances.iter().flatten();
        let chains = chains.filter(|instance| matches!(instance.drawn, Drawn::Chain { .. }));
        self.restless
            .extend(chains.map(|chain| chain.id.index() as u32));
    }

    /// Before selection: frees meshes and slots that are out of use.
    pub(crate) fn begin_frame<'a>(&mut self, views: impl Iterator<Item = &'a mut ViewCuts>) {
        self.frame = self.frame.wrapping_add(1);
        let scene = &mut self.scene;
        self.retired.retain(|mesh| {
            let in_use = Arc::strong_count(mesh) > 1;
            if !in_use {
                scene.remove_mesh(mesh.id);
            }
            in_use
        });
        if self.slots.has_freed() {
            for view in views {
                view.marks.forget_slots(self.slots.freed());
            }
            self.slots.recycle();
        }
        self.scene.update();
    }

    /// Takes over what changed in a view's cuts.
    pub(crate) fn apply(&mut self, change: &Change, view: &mut ViewMarks) {
        let index = change.instance.index();
        let instance = self.instances.get_mut(index).and_then(Option::as_mut);
        // Another id: the cut of a former instance with the same index.
        let Some(instance) = instance.filter(|there| there.id == change.instance) else {
            return;
        };
        let Drawn::Units(units) = &mut instance.drawn else {
            if let Some(&level) = change.entered.first() {
                view.set_level(index, level);
                self.restless.push(index as u32);
            }
            return;
        };
        let slots = &mut self.slots;
        for &unit in change.left {
            if let Ok(place) = place_of(units, unit) {
                let slot = units[place].1;
                view.set_drawn(slot, false);
                if slots.leave(slot, self.frame) {
                    self.idle.push_back((slot, self.frame));
                }
            }
        }
        for &unit in change.entered {
            let slot = match place_of(units, unit) {
                Ok(place) => units[place].1,
                Err(place) => {
                    let triangles = instance.mesh.pieces[unit as usize].triangles;
                    let slot = slots.add_unit(index as u32, unit, triangles);
                    units.insert(place, (unit, slot));
                    self.wanted.push(slot);
                    slot
                }
            };
            view.set_drawn(slot, true);
            slots.enter(slot);
        }
    }

    /// Takes back all that a view drew.
    pub(crate) fn drop_view(&mut self, view: &mut ViewMarks) {
        for slot in view.take_drawn() {
            if self.slots.leave(slot, self.frame) {
                self.idle.push_back((slot, self.frame));
            }
        }
        if view.take_levels() {
            self.stir_chains();
        }
    }

    /// Units that no view has drawn for `idle_frames`, at most `most` of them: their entities, which
    /// are to be despawned.
    pub(crate) fn take_idle(&mut self, idle_frames: u32, most: usize) -> Vec<Entity> {
        let mut gone = Vec::new();
        while gone.len() < most
            && let Some(&(slot, since)) = self.idle.front()
            && self.frame.wrapping_sub(since) > idle_frames
        {
            self.idle.pop_front();
            if self.slots.is_idle_since(slot, since) {
                gone.extend(self.remove_unit(slot));
            }
        }
        gone
    }

    /// Someone else despawned the entity of a unit.
    pub(crate) fn lose_unit(&mut self, entity: Entity) {
        self.wanted.extend(self.slots.lose_entity(entity));
    }

    fn remove_unit(&mut self, slot: u32) -> Option<Entity> {
        let (instance, unit) = self.slots.unit(slot)?;
        if let Some(Some(instance)) = self.instances.get_mut(instance as usize)
            && let Drawn::Units(units) = &mut instance.drawn
            && let Ok(place) = place_of(units, unit)
        {
            units.remove(place);
        }
        self.slots.free(slot)
    }
}

/// Whether any entity is cut into units.
pub(crate) fn has_clusters(world: Res<LodWorld>) -> bool {
    world.has_clusters()
}

/// Whether any chain may have to change its level.
pub(crate) fn has_restless(world: Res<LodWorld>) -> bool {
    !world.restless.is_empty()
}

/// Whether any unit is drawn by no view.
pub(crate) fn has_idle(world: Res<LodWorld>) -> bool {
    !world.idle.is_empty()
}
