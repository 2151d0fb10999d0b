//! A world of many instances, and the cameras of its frames.

use fieldlod_bake::{BakeConfig, MeshError, SourceMesh, bake_mesh};
use fieldlod_select::{InstanceId, MeshId, Scene};
use glam::Affine3A;

use crate::eye::{Eye, Instance};
use crate::object::{ErrorSource, LodObject};
use crate::object_view::ObjectView;

/// Meshes, their instances and the cameras of the frames.
#[derive(Debug, Default)]
pub struct World {
    /// The world's name.
    pub name: String,
    /// The meshes with their levels.
    pub(super) objects: Vec<LodObject>,
    mesh_ids: Vec<MeshId>,
    /// The index of the object of each instance, and its placement.
    pub(super) instances: Vec<(usize, Instance)>,
    /// The camera of each frame.
    pub(super) eyes: Vec<Eye>,
    /// The instances as inputs of the selection.
    pub(super) scene: Scene,
    pub(super) ids: Vec<InstanceId>,
}

impl World {
    /// An empty world.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            ..Self::default()
        }
    }

    /// Bakes a mesh and returns its index. `as_a_whole` makes each instance draw the whole mesh at one level.
    ///
    /// # Errors
    /// [`MeshError`] if the mesh could not be baked.
    pub fn add_mesh(&mut self, mesh: &SourceMesh, as_a_whole: bool) -> Result<usize, MeshError> {
        let baked = bake_mesh(mesh, &BakeConfig::default())?;
        let whole = as_a_whole.then(|| baked.whole_mesh_levels()).flatten();
        let hierarchy = whole.unwrap_or(baked);
        self.mesh_ids.push(self.scene.add_mesh(&hierarchy));
        self.objects
            .push(LodObject::new(hierarchy, ErrorSource::Reported));
        Ok(self.objects.len() - 1)
    }

    /// Adds an instance of a mesh. The scale must be the same along all axes.
    ///
    /// # Panics
    /// If `mesh` is not an index from [`World::add_mesh`].
    pub fn place(&mut self, mesh: usize, world_from_local: Affine3A) {
        let id = self.mesh_ids[mesh];
        let id = self.scene.add_instance(id, world_from_local, 1.0);
        self.scene.update();
        self.ids.push(id);
        self.instances.push((mesh, Instance::at(world_from_local)));
    }

    /// Adds a frame.
    pub fn look(&mut self, eye: Eye) {
        self.eyes.push(eye);
    }

    /// The views of all instances from `eye`.
    pub(super) fn views(&self, eye: &Eye) -> Vec<ObjectView<'_>> {
        let view = |(object, instance): &(usize, Instance)| {
            ObjectView::new(&self.objects[*object], instance, eye)
        };
        self.instances.iter().map(view).collect()
    }

    /// Triangles of all instances at full detail.
    #[must_use]
    pub fn source_triangles(&self) -> u64 {
        let of = |(object, _): &(usize, Instance)| {
            self.objects[*object].hierarchy.source_triangle_count()
        };
        self.instances.iter().map(of).sum()
    }
}
