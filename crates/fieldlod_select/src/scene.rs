//! The input of selection: meshes and their placements.

pub(crate) mod columns;
mod journal;
mod order;
pub(crate) mod table;

use std::collections::BTreeSet;

use fieldlod_hierarchy::{Hierarchy, Sphere};
use glam::{Affine3A, Mat3};

use crate::criterion::error_bounds::placed_sphere;
use crate::view::stretch::{largest_stretch, least_stretch};
use columns::{Columns, Occupant, truncate};
use journal::Journal;
use order::sort_along_curve;
use table::GroupTable;

/// A mesh of a [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MeshId(u32);

impl MeshId {
    /// Index of the mesh, unique among the present meshes of a scene, and small.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// An instance of a [`Scene`]. Ids are unique; the index of a removed instance is reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct InstanceId {
    pub(crate) index: u32,
    pub(crate) generation: u32,
}

impl InstanceId {
    /// The id of a slot without an instance.
    pub(crate) const NONE: Self = Self {
        index: u32::MAX,
        generation: 0,
    };

    /// Index of the instance, unique among the present instances of a scene. Indices are small, because the indices of
    /// removed instances are reused.
    #[must_use]
    pub fn index(self) -> usize {
        self.index as usize
    }
}

/// An instance. A removed instance keeps its index until another instance takes it.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    /// `None` once removed.
    pub(crate) mesh: Option<MeshId>,
    pub(crate) generation: u32,
    /// The slot of the instance in the columns; `None` until its first [`Scene::update`], and once removed.
    pub(crate) slot: Option<u32>,
    /// The layers of the instance, one bit each.
    layers: u64,
    pub(crate) world_from_local: Affine3A,
    pub(crate) bias: f32,
    /// The sphere around all groups of the instance, in the world.
    pub(crate) sphere: Sphere,
    /// The least and the largest factor of lengths.
    stretch: [f32; 2],
}

/// An instance of a [`Scene`] as it is placed.
#[derive(Clone, Copy, Debug)]
pub struct PlacedInstance {
    /// Its id.
    pub id: InstanceId,
    /// Its mesh.
    pub mesh: MeshId,
    /// Its layers, one bit each.
    pub layers: u64,
    /// A sphere around it, in the world.
    pub sphere: Sphere,
}

impl Instance {
    fn place(&mut self, table: &GroupTable, world_from_local: Affine3A, bias: f32) {
        // Most instances move without turning. A new instance has no stretch yet.
        if self.stretch[1] == 0.0 || self.world_from_local.matrix3 != world_from_local.matrix3 {
            let linear = Mat3::from(world_from_local.matrix3);
            let largest = largest_stretch(&linear);
            // Below the exact value in spite of rounding.
            self.stretch = [least_stretch(&linear, largest) * 0.999, largest];
        }
        (self.world_from_local, self.bias) = (world_from_local, bias);
        self.sphere = placed_sphere(&table.bounds, &world_from_local, self.stretch[1], bias);
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
/// Call [`Scene::update`] after changes and before selection. A change of an instance costs the same in a scene of any
/// size. Instances that are added between two updates are ordered by their places, because views skip 64 neighbours at
/// once. Later moves do not change the order.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    meshes: Vec<Mesh>,
    /// Meshes that were removed.
    free_meshes: Vec<u32>,
    pub(crate) instances: Vec<Instance>,
    /// Indices of removed instances.
    free: BTreeSet<u32>,
    /// The generation of an instance with a new index: later than those of dropped indices.
    first_generation: u32,
    /// Instances to which the next update gives slots.
    unplaced: Vec<u32>,
    pub(crate) columns: Columns,
    pub(crate) journal: Journal,
    /// Counts changes of instances and of available groups.
    pub(crate) revision: u64,
}

impl Scene {
    /// Adds a mesh, which must be [valid](Hierarchy::validate).
    pub fn add_mesh(&mut self, hierarchy: &Hierarchy) -> MeshId {
        self.add_table(GroupTable::new(hierarchy))
    }

    /// Adds a mesh by its table, which may be made on another thread.
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

    /// Replaces the table of a mesh by one with other deviations, which a bake may measure later than it makes levels.
    /// Instances keep their cuts until the next selection. Returns `false`, and changes nothing, unless the levels are
    /// the same.
    pub fn replace_table(&mut self, mesh: MeshId, table: GroupTable) -> bool {
        let replaced = &mut self.meshes[mesh.index()].table;
        if !replaced.has_same_levels(&table) {
            return false;
        }
        *replaced = table;
        for index in 0..self.instances.len() {
            if self.instances[index].mesh == Some(mesh) {
                self.note_changed(index as u32);
            }
        }
        true
    }

    /// Frees the memory of a mesh. A mesh that is added later takes its id; until then, a second call does nothing.
    /// Before the id is taken, each selector must select once, to list the units that left, or be cleared.
    ///
    /// # Panics
    /// If an instance of the mesh is still in the scene.
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

    /// Restricts refinement to available groups, for a mesh that is loaded in parts. Terminal groups are always
    /// available. Another group is available if its units `are_loaded`, by group index, and all coarser groups that
    /// consume its simplification are available. The finest available simplification is drawn in place
    /// of missing groups. [`Selector::demand`](crate::Selector::demand) lists the missing groups.
    pub fn set_available(&mut self, mesh: MeshId, are_loaded: impl Fn(u32) -> bool) {
        let changed = &mut self.meshes[mesh.index()];
        let was_complete = changed.table.available.is_none();
        self.revision += u64::from(changed.table.set_available(are_loaded));
        // Groups of incomplete meshes are decided in each frame. Whole meshes stay within their limits until then.
        if was_complete && changed.instance_count > 0 {
            let slots = (0..).zip(&self.columns.occupants);
            let slots = slots.filter(|(_, occupant)| occupant.holds(mesh));
            slots.for_each(|(slot, _)| self.journal.push(slot));
        }
    }

    /// Adds an instance, placed by any affine map. Its errors are multiplied by `bias`: more than 1 draws it finer.
    pub fn add_instance(
        &mut self,
        mesh: MeshId,
        world_from_local: Affine3A,
        bias: f32,
    ) -> InstanceId {
        self.meshes[mesh.index()].instance_count += 1;
        let mut instance = Instance {
            mesh: Some(mesh),
            generation: self.first_generation,
            slot: None,
            layers: u64::MAX,
            world_from_local,
            bias,
            sphere: Sphere::default(),
            stretch: [0.0; 2],
        };
        instance.place(self.table(mesh), world_from_local, bias);
        // The index of a removed instance is reused with a new generation.
        let index = self.free.pop_first();
        let index = index.unwrap_or(self.instances.len() as u32);
        if let Some(removed) = self.instances.get_mut(index as usize) {
            instance.generation = removed.generation + 1;
            *removed = instance;
        } else {
            self.instances.push(instance);
        }
        self.unplaced.push(index);
        self.revision += 1;
        self.id_of(index)
    }

    /// Moves an instance. Does nothing if the instance was removed.
    pub fn set_placement(&mut self, instance: InstanceId, world_from_local: Affine3A) {
        if let Some(placed) = self.get(instance) {
            let bias = placed.bias;
            self.place(instance, world_from_local, bias);
        }
    }

    /// Changes the bias of an instance. Does nothing if the instance was removed.
    pub fn set_bias(&mut self, instance: InstanceId, bias: f32) {
        if let Some(world_from_local) = self.placement(instance) {
            self.place(instance, world_from_local, bias);
        }
    }

    fn place(&mut self, instance: InstanceId, world_from_local: Affine3A, bias: f32) {
        if let Some(mesh) = self.mesh_of(instance) {
            let table = &self.meshes[mesh.index()].table;
            self.instances[instance.index()].place(table, world_from_local, bias);
            self.note_changed(instance.index);
        }
    }

    /// Puts an instance on layers, one bit each. A view that shares none of them neither draws nor counts it. A new
    /// instance is on all layers. Does nothing if the instance was removed.
    pub fn set_layers(&mut self, instance: InstanceId, layers: u64) {
        let before = self.get(instance).map(|placed| placed.layers);
        if before.is_some_and(|before| before != layers) {
            self.instances[instance.index()].layers = layers;
            self.note_changed(instance.index);
        }
    }

    /// Removes an instance; its cut becomes empty. Does nothing if the instance was removed.
    pub fn remove(&mut self, instance: InstanceId) {
        let Some(mesh) = self.mesh_of(instance) else {
            return;
        };
        self.meshes[mesh.index()].instance_count -= 1;
        self.free.insert(instance.index);
        self.revision += 1;
        let removed = &mut self.instances[instance.index()];
        removed.mesh = None;
        if let Some(slot) = removed.slot.take() {
            self.columns.free(slot);
            self.journal.push(slot);
        }
    }

    /// Updates the columns of an instance, and records the change for selectors.
    fn note_changed(&mut self, index: u32) {
        self.revision += 1;
        let instance = &self.instances[index as usize];
        let (Some(slot), Some(mesh)) = (instance.slot, instance.mesh) else {
            return;
        };
        self.journal.push(slot);
        let occupant = Occupant {
            id: self.id_of(index),
            mesh,
            layers: instance.layers,
        };
        let error_scale = instance.stretch.map(|stretch| stretch * instance.bias);
        let sphere = instance.sphere;
        self.columns
            .set(slot as usize, occupant, &sphere, error_scale);
    }

    /// The id of the instance that has an index, or had it last.
    pub(crate) fn id_of(&self, index: u32) -> InstanceId {
        let generation = self.instances[index as usize].generation;
        InstanceId { index, generation }
    }

    /// An instance; `None` if it was removed.
    fn get(&self, id: InstanceId) -> Option<&Instance> {
        let instance = self.instances.get(id.index())?;
        (instance.mesh.is_some() && instance.generation == id.generation).then_some(instance)
    }

    /// Whether the instance in a slot has a mesh that is loaded in parts.
    pub(crate) fn is_in_parts(&self, slot: usize) -> bool {
        let occupant = &self.columns.occupants[slot];
        self.table(occupant.mesh).available.is_some()
    }

    /// The mesh of an instance; `None` if the instance was removed.
    pub(crate) fn mesh_of(&self, instance: InstanceId) -> Option<MeshId> {
        self.get(instance)?.mesh
    }

    /// An instance as it is placed; `None` if it was removed.
    #[must_use]
    pub fn placed(&self, id: InstanceId) -> Option<PlacedInstance> {
        let instance = self.get(id)?;
        Some(PlacedInstance {
            id,
            mesh: instance.mesh?,
            layers: instance.layers,
            sphere: instance.sphere,
        })
    }

    /// All instances as of the last [update](Self::update), in no particular order.
    pub fn all_placed(&self) -> impl Iterator<Item = PlacedInstance> {
        self.columns.placed()
    }

    /// Another number than before, if an instance or the available groups of a mesh have changed.
    #[must_use]
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Placement of an instance; `None` if it was removed.
    #[must_use]
    pub fn placement(&self, instance: InstanceId) -> Option<Affine3A> {
        Some(self.get(instance)?.world_from_local)
    }

    /// Orders new instances, and updates the spheres around 64 instances each.
    pub fn update(&mut self) {
        let mut unplaced = std::mem::take(&mut self.unplaced);
        // An instance may be removed before its first update.
        unplaced.retain(|&index| self.instances[index as usize].mesh.is_some());
        sort_along_curve(&mut unplaced, |index| {
            self.instances[index as usize].sphere.center
        });
        // The index of an instance that was removed and added again is in the list twice.
        unplaced.dedup();
        for &index in &unplaced {
            self.instances[index as usize].slot = Some(self.columns.free_slot());
            self.note_changed(index);
        }
        self.shrink();
        self.columns.refit();
        self.journal.trim(self.instances.len());
    }

    /// Frees the memory of removed instances behind the last present instance.
    fn shrink(&mut self) {
        self.columns.shrink();
        let mut count = self.instances.len();
        while count > 0 && self.free.remove(&(count as u32 - 1)) {
            count -= 1;
        }
        let dropped = self.instances[count..].iter();
        let next = dropped.map(|dropped| dropped.generation + 1).max();
        self.first_generation = self.first_generation.max(next.unwrap_or(0));
        truncate(&mut self.instances, count);
    }

    /// Whether [`Scene::update`] has been called since the last change.
    pub(crate) fn is_up_to_date(&self) -> bool {
        self.unplaced.is_empty() && self.columns.dirty.is_empty()
    }

    /// The slot of an instance; `None` until its first update, and once removed.
    pub(crate) fn slot_of(&self, instance: InstanceId) -> Option<usize> {
        Some(self.get(instance)?.slot? as usize)
    }

    pub(crate) fn table(&self, mesh: MeshId) -> &GroupTable {
        &self.meshes[mesh.index()].table
    }

    /// The tables of all meshes by their indices.
    pub(crate) fn tables(&self) -> impl Iterator<Item = &GroupTable> {
        self.meshes.iter().map(|mesh| &mesh.table)
    }
}

#[cfg(test)]
mod tests {
    use fieldlod_hierarchy::fixtures;
    use glam::Vec3;

    use super::*;
    use crate::lanes::bits::{CHUNK, LANES};

    #[test]
    fn memory_is_freed_after_removals() {
        let mut scene = Scene::default();
        let mesh = scene.add_mesh(&fixtures::two_level_strip());
        let place = |index: u16| Affine3A::from_translation(Vec3::X * f32::from(index));
        let ids: Vec<InstanceId> = (0..10_000)
            .map(|index| scene.add_instance(mesh, place(index), 1.0))
            .collect();
        scene.update();
        ids[100..].iter().for_each(|&id| scene.remove(id));
        scene.update();
        let columns = &scene.columns;
        let capacities = [
            scene.instances.capacity(),
            columns.occupants.capacity(),
            columns.spheres.capacity() * LANES,
            columns.chunks.capacity() * LANES * CHUNK,
        ];
        assert!(
            capacities.iter().all(|&capacity| capacity <= 1024),
            "{capacities:?}"
        );
        // An id of a dropped index is never given again.
        let again = scene.add_instance(mesh, place(0), 1.0);
        assert_eq!(again.index(), ids[100].index());
        assert_ne!(again, ids[100]);
        scene.set_bias(ids[9_999], 2.0);
        assert_eq!(scene.placement(ids[9_999]), None);
    }
}
