//! The input of selection: meshes and their placements.

pub(crate) mod columns;
mod journal;
mod order;
pub(crate) mod table;

use fieldlod_hierarchy::{Hierarchy, Sphere};
use glam::{Affine3A, Mat3};

use crate::criterion::error_bounds::placed_sphere;
use crate::view::stretch::{largest_stretch, least_stretch};
use columns::{Columns, Row};
use journal::Journal;
use order::sort_along_curve;
use table::GroupTable;

/// A mesh of a [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MeshId(u32);

impl MeshId {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// An instance of a [`Scene`]. Ids are never given twice; the index of a removed one is used again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct InstanceId {
    pub(crate) index: u32,
    pub(crate) generation: u32,
}

impl InstanceId {
    /// Among the instances that a scene holds, each has an index of its own; indices are small, since
    /// those of removed instances are used again.
    #[must_use]
    pub fn index(self) -> usize {
        self.index as usize
    }
}

/// An instance as it was placed.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    pub(crate) world_from_local: Affine3A,
    pub(crate) bias: f32,
    /// Around all of its groups, in the world.
    pub(crate) sphere: Sphere,
    /// By how much lengths grow at least and at most.
    stretch: [f32; 2],
}

/// Which instance has an index now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceEntry {
    /// `None` once removed.
    pub(crate) mesh: Option<MeshId>,
    pub(crate) generation: u32,
    /// Its place in the columns; `None` until the next [`Scene::update`], and once removed.
    pub(crate) slot: Option<u32>,
    /// Counts changes of anything but its place and bias, from 1 on.
    pub(crate) version: u32,
    /// The layers that it is on.
    pub(crate) layers: u64,
    /// The level at which all views draw it.
    pub(crate) forced_level: Option<u32>,
    /// Whether it may hide others.
    pub(crate) is_occluder: bool,
}

impl InstanceEntry {
    /// The mesh that hides others in a view of `layers`.
    pub(crate) fn occluder_mesh(&self, layers: u64) -> Option<MeshId> {
        self.seen_mesh(layers).filter(|_| self.is_occluder)
    }

    /// The mesh that a view of `layers` sees; `None` also once removed.
    pub(crate) fn seen_mesh(&self, layers: u64) -> Option<MeshId> {
        self.mesh.filter(|_| self.layers & layers != 0)
    }
}

#[derive(Clone, Debug)]
struct Mesh {
    table: GroupTable,
    instance_count: usize,
    is_removed: bool,
}

/// Meshes and instances. Any number of [`Selector`](crate::Selector)s, one for each view and on any
/// threads, select from it, each with settings of its own.
///
/// Instances come, move and go at any time: call [`Scene::update`] after changes and before
/// selection. A change costs the same in a scene of any size. Instances that are added between two updates are ordered
/// by their places, because views skip 64 neighbours at once; later moves do not change the order.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    meshes: Vec<Mesh>,
    /// Meshes that were removed.
    free_meshes: Vec<u32>,
    pub(crate) instances: Vec<Instance>,
    /// Apart from the instances: all that is read of one at its coarsest.
    pub(crate) entries: Vec<InstanceEntry>,
    free: Vec<u32>,
    /// Instances to which the next update gives slots.
    unplaced: Vec<u32>,
    pub(crate) columns: Columns,
    pub(crate) journal: Journal,
    /// Counts changes of what is drawn or hides others.
    pub(crate) revision: u64,
    /// Counts changes of what is at hand.
    pub(crate) available_revision: u64,
}

impl Scene {
    /// Adds a mesh, which must be [valid](Hierarchy::validate).
    pub fn add_mesh(&mut self, hierarchy: &Hierarchy) -> MeshId {
        self.add_table(GroupTable::new(hierarchy))
    }

    /// Adds a mesh whose table was laid out before, perhaps on another thread.
    pub fn add_table(&mut self, table: GroupTable) -> MeshId {
        let mesh = Mesh {
            table,
            instance_count: 0,
            is_removed: false,
        };
        if let Some(index) = self.free_meshes.pop() {
            self.meshes[index as usize] = mesh;
            return MeshId(index);
        }
        self.meshes.push(mesh);
        MeshId(self.meshes.len() as u32 - 1)
    }

    /// Frees what a mesh holds; nothing if it was removed. Its id is given to the next mesh that is added.
    /// Until then the list of its coarsest units remains, from which selectors tell what left: each of
    /// them has to select, or to be cleared, between the removal of its last instance and that.
    ///
    /// # Panics
    /// If an instance of it has not been removed.
    pub fn remove_mesh(&mut self, mesh: MeshId) {
        let index = mesh.0;
        let mesh = &mut self.meshes[index as usize];
        assert_eq!(mesh.instance_count, 0, "the mesh still has instances");
        if !mesh.is_removed {
            mesh.is_removed = true;
            mesh.table.retain_coarsest();
            self.free_meshes.push(index);
        }
    }

    /// Restricts refinement to groups of a mesh whose units are `at_hand`, by group index: for meshes that are loaded
    /// in parts. Missing groups are drawn at the finest loaded level ([`Selector::demand`](crate::Selector::demand)
    /// lists them). Terminal groups
    /// always count as at hand, and none does without all coarser groups that simplify what it produces.
    pub fn set_available(&mut self, mesh: MeshId, at_hand: impl Fn(u32) -> bool) {
        self.meshes[mesh.index()].table.set_available(at_hand);
        self.available_revision += 1;
    }

    /// Adds an instance, placed by any affine map. Its errors count `bias` times: more than 1 draws
    /// it finer.
    pub fn add_instance(
        &mut self,
        mesh: MeshId,
        world_from_local: Affine3A,
        bias: f32,
    ) -> InstanceId {
        self.meshes[mesh.0 as usize].instance_count += 1;
        // The index of an instance that was removed is used again, under a new generation.
        let mut entry = InstanceEntry {
            mesh: Some(mesh),
            generation: 0,
            slot: None,
            version: 1,
            layers: u64::MAX,
            forced_level: None,
            is_occluder: true,
        };
        let instance = self.instance(mesh, world_from_local, bias);
        let index = if let Some(index) = self.free.pop() {
            let last = &self.entries[index as usize];
            (entry.generation, entry.version) = (last.generation + 1, last.version + 1);
            self.entries[index as usize] = entry;
            self.instances[index as usize] = instance;
            index
        } else {
            self.instances.push(instance);
            self.entries.push(entry);
            self.instances.len() as u32 - 1
        };
        self.unplaced.push(index);
        self.revision += 1;
        InstanceId {
            index,
            generation: entry.generation,
        }
    }

    /// Moves an instance; nothing if it was removed.
    pub fn set_placement(&mut self, instance: InstanceId, world_from_local: Affine3A) {
        let bias = self.instances[instance.index()].bias;
        self.place(instance, world_from_local, bias);
    }

    /// Changes an instance's bias; nothing if it was removed.
    pub fn set_bias(&mut self, instance: InstanceId, bias: f32) {
        let world_from_local = self.instances[instance.index()].world_from_local;
        self.place(instance, world_from_local, bias);
    }

    /// Draws an instance at this level of its mesh in all views, 0 being the finest, or lets each view choose
    /// again; the coarsest where the mesh has fewer. Nothing if it was removed.
    pub fn set_forced_level(&mut self, instance: InstanceId, forced_level: Option<u32>) {
        if self.mesh_of(instance).is_some() {
            self.entries[instance.index()].forced_level = forced_level;
            self.entries[instance.index()].version += 1;
            self.note_changed(instance.index);
        }
    }

    /// Puts an instance on layers, each a bit: views that share none of them draw nothing of it and do not
    /// count it. It is on all of them to begin with; on none, it is hidden. Nothing if it was removed.
    pub fn set_layers(&mut self, instance: InstanceId, layers: u64) {
        if self.mesh_of(instance).is_some() && self.entries[instance.index()].layers != layers {
            self.entries[instance.index()].layers = layers;
            self.entries[instance.index()].version += 1;
            self.note_changed(instance.index);
        }
    }

    /// Sets whether an instance may hide others ([`LodSettings::visible_flux`]), as it does unless told
    /// otherwise: not what one sees through. Nothing if it was removed.
    ///
    /// [`LodSettings::visible_flux`]: crate::LodSettings::visible_flux
    pub fn set_occluder(&mut self, instance: InstanceId, is_occluder: bool) {
        let entry = self
            .mesh_of(instance)
            .map(|_| &mut self.entries[instance.index()]);
        if let Some(entry) = entry.filter(|entry| entry.is_occluder != is_occluder) {
            entry.is_occluder = is_occluder;
            self.revision += 1;
        }
    }

    fn place(&mut self, instance: InstanceId, world_from_local: Affine3A, bias: f32) {
        let Some(mesh) = self.mesh_of(instance) else {
            return;
        };
        self.instances[instance.index()] = self.instance(mesh, world_from_local, bias);
        self.note_changed(instance.index);
    }

    /// Removes an instance: its cut is empty from now on. Nothing if it was removed before.
    pub fn remove(&mut self, instance: InstanceId) {
        let Some(mesh) = self.mesh_of(instance) else {
            return;
        };
        self.meshes[mesh.0 as usize].instance_count -= 1;
        self.free.push(instance.index);
        self.revision += 1;
        let entry = &mut self.entries[instance.index()];
        (entry.mesh, entry.version) = (None, entry.version + 1);
        if let Some(slot) = entry.slot.take() {
            self.columns.free(slot);
            self.journal.push(slot);
        }
    }

    /// Updates the columns of an instance, and notes the change for selectors.
    fn note_changed(&mut self, index: u32) {
        self.revision += 1;
        let Some(slot) = self.entries[index as usize].slot else {
            return;
        };
        self.journal.push(slot);
        let instance = &self.instances[index as usize];
        let error_scale = instance.stretch.map(|stretch| stretch * instance.bias);
        let mut occluder_radius = 0.0;
        if let Some(mesh) = self.entries[index as usize].mesh {
            let table = &self.meshes[mesh.0 as usize].table;
            if !table.occluders.is_empty() {
                occluder_radius = instance.sphere.radius;
            }
        }
        let row = Row {
            occupant: index,
            sphere: instance.sphere,
            error_scale,
            occluder_radius,
        };
        self.columns.set(slot as usize, &row);
    }

    /// The mesh of an instance; `None` if that was removed.
    #[must_use]
    pub fn mesh_of(&self, instance: InstanceId) -> Option<MeshId> {
        let entry = self.entries.get(instance.index())?;
        (entry.generation == instance.generation)
            .then_some(entry.mesh)
            .flatten()
    }

    /// Placement of an instance, or its last one if it was removed.
    #[must_use]
    pub fn placement(&self, instance: InstanceId) -> Affine3A {
        self.instances[instance.index()].world_from_local
    }

    /// Brings the bounds of the scene up to date.
    pub fn update(&mut self) {
        let mut unplaced = std::mem::take(&mut self.unplaced);
        unplaced.retain(|&index| self.entries[index as usize].mesh.is_some());
        sort_along_curve(&mut unplaced, |index| {
            self.instances[index as usize].sphere.center
        });
        // An index may have passed to another instance in the meantime.
        unplaced.dedup();
        for &index in &unplaced {
            self.entries[index as usize].slot = Some(self.columns.free_slot());
            self.note_changed(index);
        }
        self.columns.refit();
        self.journal.trim(self.instances.len());
    }

    /// Whether [`Scene::update`] has been called since the last change.
    pub(crate) fn is_up_to_date(&self) -> bool {
        self.unplaced.is_empty() && self.columns.is_up_to_date()
    }

    /// How many instances there are.
    #[must_use]
    pub fn instance_count(&self) -> usize {
        self.instances.len() - self.free.len()
    }

    /// The instance in a slot.
    pub(crate) fn occupant(&self, slot: usize) -> Option<InstanceId> {
        let index = self.columns.occupants[slot];
        let entry = self.entries.get(index as usize)?;
        let generation = entry.generation;
        Some(InstanceId { index, generation })
    }

    /// The slot of an instance; `None` before the next update, and once removed.
    pub(crate) fn slot_of(&self, instance: InstanceId) -> Option<usize> {
        let entry = self.entries.get(instance.index())?;
        let slot = entry
            .slot
            .filter(|_| entry.generation == instance.generation);
        slot.map(|slot| slot as usize)
    }

    pub(crate) fn table(&self, mesh: MeshId) -> &GroupTable {
        &self.meshes[mesh.0 as usize].table
    }

    fn instance(&self, mesh: MeshId, world_from_local: Affine3A, bias: f32) -> Instance {
        let table = self.table(mesh);
        let linear = Mat3::from(world_from_local.matrix3);
        let largest = largest_stretch(&linear);
        let least = least_stretch(&linear, largest);
        Instance {
            world_from_local,
            bias,
            sphere: placed_sphere(&table.bounds, &world_from_local, largest, bias),
            // Beyond what rounding moves it by.
            stretch: [least * 0.999, largest],
        }
    }
}
