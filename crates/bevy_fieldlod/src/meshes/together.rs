//! The primitives of one glTF mesh: of a plant, say its bark and its leaves, they are baked together.

use std::sync::{Arc, OnceLock};

use bevy::asset::{AssetId, AssetServer, Assets};
use bevy::gltf::GltfAssetLabel;
use bevy::mesh::Mesh;
use fieldlod_bake::{BakeConfig, MOST_TOGETHER, MeshError, SourceMesh, Surface, bake_together};
use fieldlod_hierarchy::Hierarchy;

use super::bake::source_mesh;
use super::lookup::triangle_count;
use super::source_arrays::SourceArrays;
use super::threads::BakeThreads;
use crate::config::{FieldLodConfig, LodKind};

/// All primitives of a glTF mesh that have levels of the mesh as a whole, until each has got its own.
pub(super) struct Together {
    ids: Vec<AssetId<Mesh>>,
    meshes: Vec<Mesh>,
    /// What each looks like, once that is loaded.
    surfaces: OnceLock<Vec<Option<Arc<Surface>>>>,
    config: BakeConfig,
    baked: OnceLock<Vec<Result<Hierarchy, MeshError>>>,
}

/// A primitive and those that it is baked with.
#[derive(Clone)]
pub(super) struct Member {
    all: Arc<Together>,
    index: usize,
}

/// Those of which some are not baked yet.
#[derive(Default)]
pub(super) struct AllTogether(Vec<Arc<Together>>);

impl AllTogether {
    /// Forgets what has been baked, but not what someone still waits for.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Forgets the bake of a mesh that changed.
    pub(super) fn forget(&mut self, mesh: AssetId<Mesh>) {
        self.0.retain(|all| !all.ids.contains(&mesh));
    }

    /// The primitives that may be baked with `mesh` by `config`, if there are any.
    pub(super) fn member(
        &mut self,
        mesh: AssetId<Mesh>,
        config: &BakeConfig,
        candidates: &Candidates<'_>,
    ) -> Option<Member> {
        let known = |all: &&Arc<Together>| all.ids.contains(&mesh) && all.config == *config;
        let all = match self.0.iter().find(known) {
            Some(all) => all.clone(),
            None => {
                let all = Arc::new(candidates.beside(mesh, config)?);
                self.0.push(all.clone());
                all
            }
        };
        let index = all.ids.iter().position(|id| *id == mesh)?;
        Some(Member { all, index })
    }
}

/// Where primitives that are baked together are found.
pub(super) struct Candidates<'a> {
    pub(super) kind: LodKind,
    pub(super) lods: &'a FieldLodConfig,
    pub(super) meshes: &'a Assets<Mesh>,
    pub(super) assets: &'a AssetServer,
}

impl Candidates<'_> {
    /// The primitives of the same glTF mesh that are drawn as whole meshes, `None` if it is the only one, or they
    /// are too many or have too many triangles.
    fn beside(&self, mesh: AssetId<Mesh>, config: &BakeConfig) -> Option<Together> {
        let path = self.assets.get_path(mesh)?.into_owned();
        let of_mesh: usize = mesh_index(path.label()?)?;
        let mut left = config.together_below_triangles;
        let mut found: Vec<(AssetId<Mesh>, &Mesh)> = Vec::new();
        for primitive in 0..=MOST_TOGETHER {
            let label = GltfAssetLabel::Primitive {
                mesh: of_mesh,
                primitive,
            };
            let path = path.clone().with_label(label.to_string());
            let Some(handle) = self.assets.get_handle::<Mesh>(path) else {
                break;
            };
            if primitive == MOST_TOGETHER {
                return None;
            }
            let Some(mesh) = self.meshes.get(&handle) else {
                continue;
            };
            let triangles = triangle_count(mesh);
            if self.lods.kind_for(self.kind, triangles) == LodKind::WholeMesh {
                left = left.checked_sub(triangles)?;
                found.push((handle.id(), mesh));
            }
        }
        (found.len() > 1).then(|| Together {
            ids: found.iter().map(|(id, _)| *id).collect(),
            meshes: found.iter().map(|(_, mesh)| (*mesh).clone()).collect(),
            surfaces: OnceLock::new(),
            config: config.clone(),
            baked: OnceLock::new(),
        })
    }
}

/// Which mesh of its file a primitive with this label is of.
fn mesh_index(label: &str) -> Option<usize> {
    let (mesh, _) = label.strip_prefix("Mesh")?.split_once("/Primitive")?;
    mesh.parse().ok()
}

impl Member {
    /// Finds out what all of them look like, unless that is known; `None` while some of it is being loaded.
    pub(super) fn find_surfaces(
        &self,
        surface_of: impl FnMut(AssetId<Mesh>) -> Option<Option<Arc<Surface>>>,
    ) -> Option<()> {
        if self.all.surfaces.get().is_none() {
            let surfaces = self.all.ids.iter().copied().map(surface_of);
            let surfaces = surfaces.collect::<Option<Vec<_>>>()?;
            self.all.surfaces.get_or_init(|| surfaces);
        }
        Some(())
    }

    /// What is baked together, in order; `None` if something there cannot be baked at all.
    pub(super) fn sources(&self) -> Option<Vec<SourceArrays>> {
        let surfaces = self.all.surfaces.get()?;
        let sources = self.all.meshes.iter().zip(surfaces);
        let source = |(mesh, surface): (&Mesh, &Option<Arc<Surface>>)| {
            let mut source = SourceArrays::of(mesh).ok()?;
            source.surface.clone_from(surface);
            Some(source)
        };
        sources.map(source).collect()
    }

    /// Which of them this is.
    pub(super) fn index(&self) -> usize {
        self.index
    }

    /// Bakes all of them, unless another has done so.
    pub(super) fn bake(
        &self,
        sources: Vec<SourceArrays>,
        threads: &BakeThreads,
    ) -> Result<Hierarchy, MeshError> {
        let bake = || {
            let meshes: Vec<SourceMesh> = sources.into_iter().map(source_mesh).collect();
            let meshes: Vec<&SourceMesh> = meshes.iter().collect();
            let baked = threads.run(|| bake_together(&meshes, &self.all.config));
            baked.into_iter().map(|baked| Ok(baked?.0)).collect()
        };
        self.all.baked.get_or_init(bake)[self.index].clone()
    }
}
