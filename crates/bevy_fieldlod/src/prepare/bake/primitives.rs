//! Bakes the primitives of one small glTF mesh together, for example the bark and the leaves of a plant, or the parts
//! of a wall. They either change levels at the same distances or keep the vertices where they meet.

use std::sync::{Arc, OnceLock};

use bevy::asset::{AssetId, AssetServer, Assets};
use bevy::mesh::Mesh;
use bevy::platform::collections::HashMap;
use fieldlod_bake::{
    BakeConfig, BakeReport, MeshError, SourceMesh, Surface, bake_adjacent, bake_together,
};
use fieldlod_hierarchy::{BakedFile, Hierarchy};

use crate::api::config::{FieldLodAppConfig, LodKind};
use crate::api::events::LodError;
use crate::prepare::lookup::NotStarted;
use crate::prepare::source_arrays::{SourceArrays, primitives_together, triangle_count};
use crate::prepare::threads::BakeThreads;

/// A group: all primitives of a glTF mesh that bakes accept, and their common bake.
pub(in crate::prepare) struct Together {
    ids: Arc<[AssetId<Mesh>]>,
    meshes: Vec<Mesh>,
    /// The surface of each mesh, if it is known.
    surfaces: Vec<Option<Arc<Surface>>>,
    config: BakeConfig,
    /// The requested kind.
    kind: LodKind,
    /// Whether some are drawn in units.
    pub(super) has_units: bool,
    /// The meshes and surfaces in the types of the baker; `None` if one of them cannot be baked.
    sources: OnceLock<Option<Vec<SourceArrays>>>,
    /// Whether a file has the levels of all members.
    is_in_file: OnceLock<Result<(), LodError>>,
    baked: OnceLock<Vec<Result<(Hierarchy, BakeReport), MeshError>>>,
}

/// A primitive and its group.
#[derive(Clone)]
pub(in crate::prepare) struct Member {
    pub(super) all: Arc<Together>,
    pub(super) index: usize,
}

/// All groups.
#[derive(Default)]
pub(in crate::prepare) struct AllTogether {
    /// Groups with members that were not requested yet.
    expected: Vec<Expected>,
    /// For each mesh, the members of its last group.
    others_of: HashMap<AssetId<Mesh>, Arc<[AssetId<Mesh>]>>,
}

struct Expected {
    all: Arc<Together>,
    /// The members that were not requested yet.
    left: Vec<AssetId<Mesh>>,
}

impl AllTogether {
    /// Drops the groups with members that were not requested.
    pub(in crate::prepare) fn clear(&mut self) {
        self.expected.clear();
    }

    /// Drops the groups of a mesh that changed.
    pub(in crate::prepare) fn remove_groups_of(&mut self, mesh: AssetId<Mesh>) {
        let has = |expected: &Expected| expected.all.ids.contains(&mesh);
        self.expected.retain(|expected| !has(expected));
    }

    /// Drops the data of a removed mesh.
    pub(in crate::prepare) fn remove_source(&mut self, mesh: AssetId<Mesh>) {
        self.remove_groups_of(mesh);
        self.others_of.remove(&mesh);
    }

    /// All members of the last group of `mesh`, or `mesh` alone.
    pub(in crate::prepare) fn with_others(&self, mesh: AssetId<Mesh>) -> Vec<AssetId<Mesh>> {
        let others = self.others_of.get(&mesh);
        others.map_or_else(|| vec![mesh], |others| others.to_vec())
    }

    /// The group of primitives that `mesh` is baked with, if it is part of one.
    pub(in crate::prepare) fn member(
        &mut self,
        mesh: AssetId<Mesh>,
        config: &BakeConfig,
        candidates: &Candidates<'_>,
        surface_of: impl FnMut(AssetId<Mesh>) -> Result<Option<Arc<Surface>>, NotStarted>,
    ) -> Result<Option<Member>, NotStarted> {
        // The mesh may have left its last group, because the group or the configuration has changed.
        self.others_of.remove(&mesh);
        let is_expected = |expected: &Expected| {
            let Together {
                config: of, kind, ..
            } = &*expected.all;
            expected.left.contains(&mesh) && of == config && *kind == candidates.kind
        };
        let at = match self.expected.iter().position(is_expected) {
            Some(at) => at,
            None => {
                let most_triangles = config.together_below_triangles;
                let Candidates { meshes, assets, .. } = candidates;
                let Some(found) = primitives_together(mesh, most_triangles, meshes, assets) else {
                    return Ok(None);
                };
                let ids: Vec<AssetId<Mesh>> = found.iter().map(|(id, _)| *id).collect();
                let kinds = found.iter().map(|(_, mesh)| candidates.kind_of(mesh));
                let kinds: Vec<LodKind> = kinds.collect();
                // Groups of units need no surfaces, and their textures may take long to load.
                let surfaces: Vec<_> = if kinds.contains(&LodKind::WholeMesh) {
                    ids.iter()
                        .copied()
                        .map(surface_of)
                        .collect::<Result<_, _>>()?
                } else {
                    vec![None; ids.len()]
                };
                let all = Arc::new(Together {
                    surfaces,
                    meshes: found.iter().map(|(_, mesh)| (*mesh).clone()).collect(),
                    config: config.clone(),
                    kind: candidates.kind,
                    has_units: kinds.contains(&LodKind::Clusters),
                    sources: OnceLock::new(),
                    is_in_file: OnceLock::new(),
                    baked: OnceLock::new(),
                    ids: ids.as_slice().into(),
                });
                self.expected.push(Expected { all, left: ids });
                self.expected.len() - 1
            }
        };
        // The group is dropped here once all members were requested. Their tasks keep it.
        let expected = &mut self.expected[at];
        let all = expected.all.clone();
        expected.left.retain(|id| *id != mesh);
        if expected.left.is_empty() {
            self.expected.swap_remove(at);
        }
        self.others_of.insert(mesh, all.ids.clone());
        let index = all.ids.iter().position(|id| *id == mesh);
        Ok(index.map(|index| Member { all, index }))
    }
}

/// The inputs of the search for a group.
pub(in crate::prepare) struct Candidates<'a> {
    pub(in crate::prepare) kind: LodKind,
    pub(in crate::prepare) lods: &'a FieldLodAppConfig,
    pub(in crate::prepare) meshes: &'a Assets<Mesh>,
    pub(in crate::prepare) assets: &'a AssetServer,
}

impl Candidates<'_> {
    /// A primitive below the smallest size changes levels with the others.
    fn kind_of(&self, mesh: &Mesh) -> LodKind {
        match self.lods.kind_for(self.kind, triangle_count(mesh)) {
            LodKind::Clusters => LodKind::Clusters,
            _ => LodKind::WholeMesh,
        }
    }
}

impl Member {
    /// The members in order; `None` if one of them cannot be baked.
    pub(in crate::prepare) fn sources(&self) -> Option<&[SourceArrays]> {
        self.all.sources.get_or_init(|| self.convert()).as_deref()
    }

    fn convert(&self) -> Option<Vec<SourceArrays>> {
        let meshes = self.all.meshes.iter().zip(&self.all.surfaces);
        let source = |(mesh, surface): (&Mesh, &Option<Arc<Surface>>)| {
            let source = SourceArrays::of(mesh).ok()?;
            Some(SourceArrays {
                surface: surface.clone(),
                ..source
            })
        };
        meshes.map(source).collect()
    }

    /// Checks that a file has the levels of all members, unless the task of another member has checked it.
    pub(super) fn check_file(&self, baked: &BakedFile, file: &str) -> Result<(), LodError> {
        let check = || {
            let mut all = self.sources().unwrap_or_default().iter();
            all.try_for_each(|one| match one.find_hierarchy(baked, None, file) {
                // The file lacks faulty primitives, which no bake accepts.
                Err(error) if one.clone().into_mesh().validate().is_ok() => Err(error),
                _ => Ok(()),
            })
        };
        self.all.is_in_file.get_or_init(check).clone()
    }

    /// Bakes all members, unless the task of another member has baked them.
    pub(in crate::prepare) fn bake(
        &self,
        sources: &[SourceArrays],
        threads: &BakeThreads,
    ) -> Result<(Hierarchy, BakeReport), MeshError> {
        let bake = || {
            let meshes = sources.iter().cloned().map(SourceArrays::into_mesh);
            let meshes: Vec<SourceMesh> = meshes.collect();
            let meshes: Vec<&SourceMesh> = meshes.iter().collect();
            let config = &self.all.config;
            threads.run(|| {
                if self.all.has_units {
                    bake_adjacent(&meshes, config)
                } else {
                    bake_together(&meshes, config)
                }
            })
        };
        self.all.baked.get_or_init(bake)[self.index].clone()
    }
}
