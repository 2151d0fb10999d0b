//! What there is to select from: meshes and where they stand.

use fieldlod_hierarchy::{Hierarchy, Sphere};
use glam::{Affine3A, Mat3, Vec3};

use crate::GroupTable;
use crate::hold::Whole;
use crate::stretch::largest_stretch;
use crate::tree::{Node, Tree};

/// A mesh of a [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MeshId(u32);

/// An instance of a [`Scene`]; counts up from 0 and is never given twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct InstanceId(pub(crate) u32);

impl InstanceId {
    /// How many instances were added before.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Instance {
    /// `None` once removed.
    pub(crate) mesh: Option<MeshId>,
    pub(crate) world_from_local: Affine3A,
    pub(crate) bias: f32,
    pub(crate) node: Node,
}

/// Meshes and instances. Any number of [`Selector`](crate::Selector)s, one for each view, select
/// from it.
///
/// Call [`Scene::update`] after changes and before selection.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    tables: Vec<GroupTable>,
    pub(crate) instances: Vec<Instance>,
    /// The meshes of the instances, by themselves: what settling one reads.
    pub(crate) meshes: Vec<Option<MeshId>>,
    pub(crate) tree: Tree,
    /// Counts rebuilds of the tree.
    pub(crate) tree_revision: u64,
    /// Counts changes.
    pub(crate) revision: u64,
    moved: Vec<u32>,
    rebuild: bool,
}

impl Scene {
    /// Adds a mesh, which must be [valid](Hierarchy::validate).
    pub fn add_mesh(&mut self, hierarchy: &Hierarchy) -> MeshId {
        self.tables.push(GroupTable::new(hierarchy));
        MeshId(self.tables.len() as u32 - 1)
    }

    /// Adds an instance, placed by any affine map. Its errors count `bias` times: more than 1 draws
    /// it finer.
    pub fn add_instance(
        &mut self,
        mesh: MeshId,
        world_from_local: Affine3A,
        bias: f32,
    ) -> InstanceId {
        self.rebuild = true;
        self.revision += 1;
        self.meshes.push(Some(mesh));
        self.instances.push(Instance {
            mesh: Some(mesh),
            world_from_local,
            bias,
            node: self.node(mesh, &world_from_local, bias),
        });
        InstanceId(self.instances.len() as u32 - 1)
    }

    /// Moves an instance.
    pub fn set_placement(&mut self, instance: InstanceId, world_from_local: Affine3A) {
        let bias = self.instances[instance.index()].bias;
        self.set(instance, world_from_local, bias);
    }

    /// Changes an instance's bias.
    pub fn set_bias(&mut self, instance: InstanceId, bias: f32) {
        let world_from_local = self.instances[instance.index()].world_from_local;
        self.set(instance, world_from_local, bias);
    }

    fn set(&mut self, instance: InstanceId, world_from_local: Affine3A, bias: f32) {
        let Some(mesh) = self.instances[instance.index()].mesh else {
            return;
        };
        self.revision += 1;
        let node = self.node(mesh, &world_from_local, bias);
        self.instances[instance.index()] = Instance {
            mesh: Some(mesh),
            world_from_local,
            bias,
            node,
        };
        self.moved.push(instance.0);
    }

    /// Removes an instance: its cut is empty from now on.
    pub fn remove(&mut self, instance: InstanceId) {
        self.revision += 1;
        let removed = &mut self.instances[instance.index()];
        self.meshes[instance.index()] = None;
        removed.mesh = None;
        removed.node = Node {
            changed_at: self.revision,
            ..Node::default()
        };
        self.moved.push(instance.0);
    }

    /// Brings the bounds of the scene up to date.
    pub fn update(&mut self) {
        if self.rebuild {
            let nodes: Vec<Node> = self.instances.iter().map(|i| i.node).collect();
            self.tree = Tree::new(&nodes);
            self.tree_revision += 1;
        } else {
            let instances = &self.instances;
            for &instance in &self.moved {
                self.tree.refit(instance, &|i| instances[i as usize].node);
            }
        }
        self.rebuild = false;
        self.moved.clear();
    }

    /// Whether [`Scene::update`] has been called since the last change.
    #[must_use]
    pub fn is_up_to_date(&self) -> bool {
        !self.rebuild && self.moved.is_empty()
    }

    /// How many instances were ever added.
    #[must_use]
    pub fn instance_count(&self) -> usize {
        self.instances.len()
    }

    pub(crate) fn table(&self, mesh: MeshId) -> &GroupTable {
        &self.tables[mesh.0 as usize]
    }

    fn node(&self, mesh: MeshId, world_from_local: &Affine3A, bias: f32) -> Node {
        let whole = &self.table(mesh).whole;
        let linear = Mat3::from(world_from_local.matrix3);
        let stretch = largest_stretch(&linear);
        let translation = Vec3::from(world_from_local.translation);
        let center = linear * whole.bounds.center + translation;
        let radius = whole.bounds.radius * stretch;
        let or_infinity = |x: f32| if x.is_nan() { f32::INFINITY } else { x };
        let whole = Whole {
            bounds: if center.is_finite() && radius.is_finite() && bias > 0.0 {
                Sphere { center, radius }
            } else {
                // Never certainly far nor certainly outside.
                Sphere {
                    center: Vec3::ZERO,
                    radius: f32::INFINITY,
                }
            },
            error_weighed: or_infinity(whole.error_weighed * stretch * bias),
            deviation: or_infinity(whole.deviation * stretch * bias),
        };
        Node {
            whole,
            changed_at: self.revision,
        }
    }
}
