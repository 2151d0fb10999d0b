//! A world of several objects, and the eyes that look at it.

use fieldlod_bake::{BakeConfig, MeshError, SourceMesh, bake_mesh};
use fieldlod_select::{InstanceId, MeshId, Scene};
use glam::Affine3A;

use crate::eye::{Eye, Instance};
use crate::object::{ErrorSource, LodObject};
use crate::object_view::ObjectView;

/// Meshes, where they stand, and from where they are seen.
#[derive(Debug)]
pub struct World {
    /// What it is called.
    pub name: String,
    /// How meshes are baked that are added from now on.
    pub config: BakeConfig,
    /// The meshes with their levels.
    pub(super) objects: Vec<LodObject>,
    mesh_ids: Vec<MeshId>,
    /// The object of each instance, and its place.
    pub(super) instances: Vec<(usize, Instance)>,
    /// One for each frame.
    pub(super) eyes: Vec<Eye>,
    /// What each of them saw before, in frames of selection alone.
    pub(super) approaches: Vec<Vec<Eye>>,
    /// As selection knows the instances, in the same order.
    pub(super) scene: Scene,
    pub(super) ids: Vec<InstanceId>,
}

impl World {
    /// A world with nothing in it.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            config: BakeConfig::default(),
            objects: Vec::new(),
            mesh_ids: Vec::new(),
            instances: Vec::new(),
            eyes: Vec::new(),
            approaches: Vec::new(),
            scene: Scene::default(),
            ids: Vec::new(),
        }
    }

    /// Bakes a mesh that may be placed: in pieces that have levels of their own, or as a whole. Returns its
    /// number.
    ///
    /// # Errors
    /// [`MeshError`] of a mesh that cannot be baked.
    pub fn add_mesh(&mut self, mesh: &SourceMesh, as_a_whole: bool) -> Result<usize, MeshError> {
        let baked = bake_mesh(mesh, &self.config)?;
        let whole = as_a_whole.then(|| baked.whole_mesh_levels()).flatten();
        let hierarchy = whole.unwrap_or(baked);
        self.mesh_ids.push(self.scene.add_mesh(&hierarchy));
        self.objects
            .push(LodObject::new(hierarchy, ErrorSource::Reported));
        Ok(self.objects.len() - 1)
    }

    /// Puts an instance of a mesh, by its number, at a place whose scale is the same along all axes.
    ///
    /// # Panics
    /// If there is no mesh of that number.
    pub fn place(&mut self, mesh: usize, world_from_local: Affine3A) {
        let id = self.mesh_ids[mesh];
        let id = self.scene.add_instance(id, world_from_local, 1.0);
        self.scene.update();
        self.ids.push(id);
        self.instances.push((mesh, Instance::at(world_from_local)));
    }

    /// Adds a frame as an eye sees it that was nowhere before.
    pub fn look(&mut self, eye: Eye) {
        self.look_after(Vec::new(), eye);
    }

    /// Adds a frame as an eye sees it after the frames of its way there, in which cuts are selected only.
    pub fn look_after(&mut self, approach: Vec<Eye>, eye: Eye) {
        self.approaches.push(approach);
        self.eyes.push(eye);
    }

    /// All instances as an eye sees them.
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
