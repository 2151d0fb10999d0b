//! What there is to select from: meshes and where they stand.

use fieldlod_hierarchy::Hierarchy;
use glam::{Affine3A, Mat3, Vec4};

use crate::boxes::AxisBox;
use crate::error_bounds::or_infinity;
use crate::stretch::largest_stretch;
use crate::table::GroupTable;
use crate::tree::{FAN, Node, Tally, Tree};

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

#[derive(Clone, Debug)]
pub(crate) struct Instance {
    pub(crate) world_from_local: Affine3A,
    pub(crate) bias: f32,
    /// The level at which all views draw it.
    pub(crate) forced_level: Option<u32>,
    pub(crate) node: Node,
}

/// Which instance has an index now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceEntry {
    /// `None` once removed.
    pub(crate) mesh: Option<MeshId>,
    pub(crate) generation: u32,
    /// The layers that it is on.
    pub(crate) layers: u64,
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
/// selection. A change costs the same in a scene of any size, but for a sort of all instances each
/// time that a quarter of them has come, gone or moved far.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    meshes: Vec<Mesh>,
    /// Meshes that were removed.
    free_meshes: Vec<u32>,
    pub(crate) instances: Vec<Instance>,
    /// Apart from the instances: all that is read of one at its coarsest.
    pub(crate) entries: Vec<InstanceEntry>,
    free: Vec<u32>,
    pub(crate) tree: Tree,
    /// Counts rebuilds of the tree.
    pub(crate) tree_revision: u64,
    /// Counts changes.
    pub(crate) revision: u64,
    /// Counts changes of what is at hand.
    pub(crate) available_revision: u64,
    changed: Vec<u32>,
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

    /// Lets selection refine only those groups of a mesh whose units are `at_hand`, by their index: for
    /// meshes that are loaded in parts. What would be refined and is not is drawn at the finest level that
    /// is there ([`Selector::demand`](crate::Selector::demand) tells what is missing). Terminal groups
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
        self.revision += 1;
        self.meshes[mesh.0 as usize].instance_count += 1;
        // The index of an instance that was removed is used again, under a new generation.
        let mut entry = InstanceEntry {
            mesh: Some(mesh),
            generation: 0,
            layers: u64::MAX,
            is_occluder: true,
        };
        let instance = self.instance(mesh, world_from_local, bias, None, entry.layers);
        let index = if let Some(index) = self.free.pop() {
            entry.generation = self.entries[index as usize].generation + 1;
            self.instances[index as usize] = instance;
            self.entries[index as usize] = entry;
            index
        } else {
            self.instances.push(instance);
            self.entries.push(entry);
            self.instances.len() as u32 - 1
        };
        self.changed.push(index);
        InstanceId {
            index,
            generation: entry.generation,
        }
    }

    /// Moves an instance; nothing if it was removed.
    pub fn set_placement(&mut self, instance: InstanceId, world_from_local: Affine3A) {
        let Instance {
            bias, forced_level, ..
        } = self.instances[instance.index()];
        self.set(instance, world_from_local, bias, forced_level);
    }

    /// Changes an instance's bias; nothing if it was removed.
    pub fn set_bias(&mut self, instance: InstanceId, bias: f32) {
        let Instance {
            world_from_local,
            forced_level,
            ..
        } = self.instances[instance.index()];
        self.set(instance, world_from_local, bias, forced_level);
    }

    /// Draws an instance at this level of its mesh in all views, 0 being the finest, or lets each view choose
    /// again; the coarsest where the mesh has fewer. Nothing if it was removed.
    pub fn set_forced_level(&mut self, instance: InstanceId, forced_level: Option<u32>) {
        let Instance {
            world_from_local,
            bias,
            ..
        } = self.instances[instance.index()];
        self.set(instance, world_from_local, bias, forced_level);
    }

    /// Puts an instance on layers, each a bit: views that share none of them draw nothing of it and do not
    /// count it. It is on all of them to begin with; on none, it is hidden. Nothing if it was removed.
    pub fn set_layers(&mut self, instance: InstanceId, layers: u64) {
        if self.mesh_of(instance).is_some() && self.entries[instance.index()].layers != layers {
            self.entries[instance.index()].layers = layers;
            self.set_placement(instance, self.instances[instance.index()].world_from_local);
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

    fn set(
        &mut self,
        instance: InstanceId,
        world_from_local: Affine3A,
        bias: f32,
        forced_level: Option<u32>,
    ) {
        let Some(mesh) = self.mesh_of(instance) else {
            return;
        };
        self.revision += 1;
        let tally = self.instances[instance.index()].node.tally;
        let layers = self.entries[instance.index()].layers;
        let mut changed = self.instance(mesh, world_from_local, bias, forced_level, layers);
        changed.node.tally = tally;
        self.instances[instance.index()] = changed;
        self.changed.push(instance.index);
    }

    /// Gives an instance numbers that [`Scene::tally_within`] adds up, or takes them off; to begin with it has
    /// none. That changes nothing that is selected. Nothing if it was removed.
    pub fn set_numbers(&mut self, instance: InstanceId, numbers: Option<[u32; 3]>) {
        if self.mesh_of(instance).is_none() {
            return;
        }
        let tally = Tally::of(numbers);
        let was = std::mem::replace(&mut self.instances[instance.index()].node.tally, tally);
        // What has changed, or has not been there, is counted when the tree is brought up to date.
        if !self.is_up_to_date() {
            self.changed.push(instance.index);
        } else if was != tally {
            self.tree.replace_tally(instance.index, &was, &tally);
        }
    }

    /// Removes an instance: its cut is empty from now on. Nothing if it was removed before.
    pub fn remove(&mut self, instance: InstanceId) {
        let Some(mesh) = self.mesh_of(instance) else {
            return;
        };
        self.revision += 1;
        self.meshes[mesh.0 as usize].instance_count -= 1;
        // The node stays in the tree, with no bounds, until that is built anew.
        self.entries[instance.index()].mesh = None;
        self.instances[instance.index()].node = Node {
            changed_at: self.revision,
            ..Node::EMPTY
        };
        self.free.push(instance.index);
        self.changed.push(instance.index);
    }

    /// The mesh of an instance; `None` if that was removed.
    #[must_use]
    pub fn mesh_of(&self, instance: InstanceId) -> Option<MeshId> {
        let entry = self.entries.get(instance.index())?;
        (entry.generation == instance.generation)
            .then_some(entry.mesh)
            .flatten()
    }

    /// Where an instance is, or was last.
    #[must_use]
    pub fn placement(&self, instance: InstanceId) -> Affine3A {
        self.instances[instance.index()].world_from_local
    }

    /// Brings the bounds of the scene up to date.
    pub fn update(&mut self) {
        // What has changed goes to the leaves that have to be fitted again.
        for &index in &self.changed {
            self.tree.put(index, &self.instances[index as usize].node);
        }
        self.changed.clear();
        // A tree that has become too loose is built anew.
        if self.tree.needs_rebuild() {
            let nodes: Vec<Node> = self.instances.iter().map(|i| i.node).collect();
            self.tree = Tree::new(&nodes);
            self.tree_revision += 1;
        } else {
            let instances = &self.instances;
            self.tree.refit(&|i| instances[i as usize].node);
        }
    }

    /// Whether [`Scene::update`] has been called since the last change.
    pub(crate) fn is_up_to_date(&self) -> bool {
        self.changed.is_empty()
    }

    /// The tally of instances on one of `layers` that have numbers and are certainly on the inner side of all
    /// `planes`, each a normal of length 1 and a distance along it, as those of a frustum are. Visits every other
    /// instance on those layers that may have something there; with it, whether all of it certainly is. With `sums`
    /// off it visits all of them; with it on, instances on none of the layers must have no numbers, or zeros.
    pub fn tally_within(
        &self,
        planes: &[Vec4],
        layers: u64,
        sums: bool,
        visit: &mut impl FnMut(InstanceId, bool),
    ) -> Tally {
        let mut tally = Tally::default();
        if !self.tree.order.is_empty() {
            let root = self.tree.levels.len() - 1;
            let mut within = Within {
                scene: self,
                planes,
                layers,
                sums,
                visit,
                tally: &mut tally,
            };
            within.visit_node(root, 0, false);
        }
        tally
    }

    /// How many instances there are.
    #[must_use]
    pub fn instance_count(&self) -> usize {
        self.instances.len() - self.free.len()
    }

    /// The instance that has an index now or had it last.
    pub(crate) fn instance_at(&self, index: u32) -> InstanceId {
        InstanceId {
            index,
            generation: self.entries[index as usize].generation,
        }
    }

    pub(crate) fn table(&self, mesh: MeshId) -> &GroupTable {
        &self.meshes[mesh.0 as usize].table
    }

    fn instance(
        &self,
        mesh: MeshId,
        world_from_local: Affine3A,
        bias: f32,
        forced_level: Option<u32>,
        layers: u64,
    ) -> Instance {
        let table = self.table(mesh);
        let bounds = table.bounds.placed(&world_from_local, bias);
        let radius = bounds.sphere.radius;
        let stretch = largest_stretch(&Mat3::from(world_from_local.matrix3));
        let seen_radius = or_infinity(table.radius * stretch * bias);
        Instance {
            world_from_local,
            bias,
            forced_level,
            node: Node {
                radii: [seen_radius; 2],
                layers,
                is_forced: forced_level.is_some(),
                bounds,
                occluder_radius: if table.occluders.is_empty() {
                    0.0
                } else {
                    radius
                },
                surface_box: AxisBox::placed(&table.surface_box, &world_from_local),
                changed_at: self.revision,
                tally: Tally::of(None),
            },
        }
    }
}

/// The traversal of what is within planes.
struct Within<'a, F> {
    scene: &'a Scene,
    planes: &'a [Vec4],
    layers: u64,
    sums: bool,
    visit: &'a mut F,
    tally: &'a mut Tally,
}

impl<F: FnMut(InstanceId, bool)> Within<'_, F> {
    fn visit_node(&mut self, level: usize, index: usize, is_within: bool) {
        let tree = &self.scene.tree;
        let Some(is_within) = self.side(&tree.levels[level][index], is_within) else {
            return;
        };
        let first = index * FAN;
        if level > 0 {
            let end = tree.levels[level - 1].len().min(first + FAN);
            for child in first..end {
                self.visit_node(level - 1, child, is_within);
            }
            return;
        }
        let end = tree.order.len().min(first + FAN);
        for &instance in &tree.order[first..end] {
            let node = &self.scene.instances[instance as usize].node;
            if let Some(is_within) = self.side(node, is_within) {
                (self.visit)(self.scene.instance_at(instance), is_within);
            }
        }
    }

    /// Whether a node is certainly within; `None` if there is nothing to visit, or it was counted.
    fn side(&mut self, node: &Node, is_within: bool) -> Option<bool> {
        if node.layers & self.layers == 0 {
            return None;
        }
        let is_within = side(node, self.planes, is_within)?;
        if is_within && self.sums && node.tally.without_numbers == 0 {
            self.tally.add(&node.tally);
            return None;
        }
        Some(is_within)
    }
}

/// Whether a node is certainly on the inner side of all planes; `None` if it is certainly not.
fn side(node: &Node, planes: &[Vec4], is_within: bool) -> Option<bool> {
    let sphere = &node.bounds.sphere;
    if node.bounds.is_empty() {
        return None;
    }
    if is_within {
        return Some(true);
    }
    let inside_by = |plane: &Vec4| plane.dot(sphere.center.extend(1.0));
    let mut all = true;
    for plane in planes {
        let inside_by = inside_by(plane);
        if inside_by < -sphere.radius {
            return None;
        }
        all &= inside_by > sphere.radius;
    }
    Some(all)
}
