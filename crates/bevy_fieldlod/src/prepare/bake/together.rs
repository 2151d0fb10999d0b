//! The primitives of one glTF mesh: of a plant, say its bark and its leaves, they are baked together.

use std::sync::{Arc, OnceLock};

use bevy::asset::{AssetId, AssetServer, Assets};
use bevy::gltf::GltfAssetLabel;
use bevy::image::Image;
use bevy::mesh::Mesh;
use bevy::platform::collections::HashMap;
use fieldlod_bake::{
    BakeConfig, BakeReport, MOST_TOGETHER, MeshError, SourceMesh, Surface, bake_together,
};
use fieldlod_hierarchy::Hierarchy;

use crate::api::config::{FieldLodConfig, LodKind};
use crate::prepare::source_arrays::{SourceArrays, place_in_gltf, triangle_count};
use crate::prepare::threads::BakeThreads;

/// All primitives of a glTF mesh that have levels of the mesh as a whole, until each has got its own.
pub(in crate::prepare) struct Together {
    ids: Arc<[AssetId<Mesh>]>,
    meshes: Vec<Mesh>,
    /// What each looks like, if that is known.
    looks: Vec<Look>,
    config: BakeConfig,
    baked: OnceLock<Vec<Result<(Hierarchy, BakeReport), MeshError>>>,
}

/// What a material looks like to a bake, if that is known, and its texture.
pub(in crate::prepare) type Look = (Option<Arc<Surface>>, Option<AssetId<Image>>);

/// A primitive and those that it is baked with.
#[derive(Clone)]
pub(in crate::prepare) struct Member {
    all: Arc<Together>,
    index: usize,
}

/// What is baked together.
#[derive(Default)]
pub(in crate::prepare) struct AllTogether {
    /// Those of which some have not been asked for yet.
    expected: Vec<Expected>,
    /// By each mesh, all those that it was last baked with, or would have been.
    others_of: HashMap<AssetId<Mesh>, Arc<[AssetId<Mesh>]>>,
}

struct Expected {
    all: Arc<Together>,
    /// Which of them.
    left: Vec<AssetId<Mesh>>,
}

impl AllTogether {
    /// Forgets those whose others nobody asks for.
    pub(in crate::prepare) fn clear(&mut self) {
        self.expected.clear();
    }

    /// Forgets the bake of a mesh that changed.
    pub(in crate::prepare) fn forget(&mut self, mesh: AssetId<Mesh>) {
        let has = |expected: &Expected| expected.all.ids.contains(&mesh);
        self.expected.retain(|expected| !has(expected));
    }

    /// Forgets what a mesh that is gone was baked with.
    pub(in crate::prepare) fn forget_source(&mut self, mesh: AssetId<Mesh>) {
        self.others_of.remove(&mesh);
    }

    /// `mesh`, and what changes its levels with it.
    pub(in crate::prepare) fn with_others(&self, mesh: AssetId<Mesh>) -> Vec<AssetId<Mesh>> {
        let others = self.others_of.get(&mesh);
        others.map_or_else(|| vec![mesh], |others| others.to_vec())
    }

    /// The primitives that may be baked with `mesh` by `config`, if there are any; `None` while it is not known yet what
    /// one of them looks like, by `look_of`.
    pub(in crate::prepare) fn member(
        &mut self,
        mesh: AssetId<Mesh>,
        config: &BakeConfig,
        candidates: &Candidates<'_>,
        look_of: impl FnMut(AssetId<Mesh>) -> Option<Look>,
    ) -> Option<Option<Member>> {
        let known =
            |expected: &Expected| expected.left.contains(&mesh) && expected.all.config == *config;
        self.others_of.remove(&mesh);
        let at = match self.expected.iter().position(known) {
            Some(at) => at,
            None => {
                let Some(found) = candidates.beside(mesh, config.together_below_triangles) else {
                    return Some(None);
                };
                let ids: Vec<AssetId<Mesh>> = found.iter().map(|(id, _)| *id).collect();
                let looks = ids.iter().copied().map(look_of);
                let all = Arc::new(Together {
                    looks: looks.collect::<Option<_>>()?,
                    meshes: found.iter().map(|(_, mesh)| (*mesh).clone()).collect(),
                    config: config.clone(),
                    baked: OnceLock::new(),
                    ids: ids.as_slice().into(),
                });
                self.expected.push(Expected { all, left: ids });
                self.expected.len() - 1
            }
        };
        // Whoever bakes them keeps them as long as that takes.
        let expected = &mut self.expected[at];
        let all = expected.all.clone();
        expected.left.retain(|id| *id != mesh);
        if expected.left.is_empty() {
            self.expected.swap_remove(at);
        }
        self.others_of.insert(mesh, all.ids.clone());
        let index = all.ids.iter().position(|id| *id == mesh);
        Some(index.map(|index| Member { all, index }))
    }
}

/// Where primitives that are baked together are found.
pub(in crate::prepare) struct Candidates<'a> {
    pub(in crate::prepare) kind: LodKind,
    pub(in crate::prepare) lods: &'a FieldLodConfig,
    pub(in crate::prepare) meshes: &'a Assets<Mesh>,
    pub(in crate::prepare) assets: &'a AssetServer,
}

impl Candidates<'_> {
    /// The primitives of the same glTF mesh that are drawn as whole meshes, `None` if it is the only one, or they
    /// are too many or have too many triangles.
    fn beside(
        &self,
        mesh: AssetId<Mesh>,
        most_triangles: usize,
    ) -> Option<Vec<(AssetId<Mesh>, &Mesh)>> {
        let path = self.assets.get_path(mesh)?.into_owned();
        let [of_mesh, _] = place_in_gltf(path.label()?)?;
        let mut left = most_triangles;
        let mut found: Vec<(AssetId<Mesh>, &Mesh)> = Vec::new();
        for primitive in 0..=MOST_TOGETHER {
            let label = GltfAssetLabel::Primitive {
                mesh: of_mesh as usize,
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
        (found.len() > 1).then_some(found)
    }
}

impl Member {
    /// What is baked together, in order; `None` if something there cannot be baked at all.
    pub(in crate::prepare) fn sources(&self) -> Option<Vec<SourceArrays>> {
        let meshes = self.all.meshes.iter().zip(&self.all.looks);
        let source = |(mesh, (surface, _)): (&Mesh, &Look)| {
            let source = SourceArrays::of(mesh).ok()?;
            Some(SourceArrays {
                surface: surface.clone(),
                ..source
            })
        };
        meshes.map(source).collect()
    }

    /// The texture by which this one is baked, whatever its material has since.
    pub(in crate::prepare) fn texture(&self) -> Option<AssetId<Image>> {
        self.all.looks[self.index].1
    }

    /// Which of them this is.
    pub(in crate::prepare) fn index(&self) -> usize {
        self.index
    }

    /// Bakes all of them, unless another has done so.
    pub(in crate::prepare) fn bake(
        &self,
        sources: Vec<SourceArrays>,
        threads: &BakeThreads,
    ) -> Result<(Hierarchy, BakeReport), MeshError> {
        let bake = || {
            let meshes: Vec<SourceMesh> =
                sources.into_iter().map(SourceArrays::into_mesh).collect();
            let meshes: Vec<&SourceMesh> = meshes.iter().collect();
            threads.run(|| bake_together(&meshes, &self.all.config))
        };
        self.all.baked.get_or_init(bake)[self.index].clone()
    }
}
