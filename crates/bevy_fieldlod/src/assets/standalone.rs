//! Draws primitives of `.fieldlod` and `.fieldpages` files without their glTF file.

use std::sync::Arc;

use bevy::asset::AssetId;
use bevy::ecs::system::SystemParam;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use fieldlod_hierarchy::{BakedFile, BakedPrimitive};

use crate::api::auto_lod::AutoLod;
use crate::api::events::{LodError, LodFailed, asset_name};
use crate::api::systems::FieldLodSystems;
use crate::assets::baked_lods::BakedLods;
use crate::compat::OnRemove;
use crate::prepare::track::AutoLodLookup;
use crate::scene::unit_mesh::{source_indices, source_mesh};

/// Draws a primitive of a `.fieldlod` or `.fieldpages` file, without the glTF file that it was baked from. Add a
/// material of any type.
///
/// Once the file is loaded, the plugin inserts a [`Mesh3d`] and an [`AutoLod`] with the levels, or sets the levels of
/// an existing [`AutoLod`]. Entities of the same primitive share the mesh and the levels. Removing this component
/// removes the [`Mesh3d`] and the [`AutoLod`]. A failure triggers [`LodFailed`](crate::LodFailed).
/// - A `.fieldlod` file is in memory as a whole. The mesh is the source geometry.
/// - A `.fieldpages` file (`fieldlod bake --pages`) is streamed. The mesh is the coarsest level; finer levels are read
///   in the background as views need them, and evicted to keep the budgets of
///   [`FieldLodAppConfig::memory`](crate::FieldLodAppConfig::memory). Missing pages fall back to coarser geometry. The
///   mesh is always drawn as units.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_fieldlod::prelude::*;
/// fn setup(mut commands: Commands, assets: Res<AssetServer>, mut materials: ResMut<Assets<StandardMaterial>>) {
///     let statue = LodMesh3d::new(assets.load("statue.fieldlod"), 0, 0);
///     commands.spawn((statue, MeshMaterial3d(materials.add(StandardMaterial::default()))));
/// }
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct LodMesh3d {
    /// The file.
    pub file: Handle<BakedLods>,
    /// Index of the mesh in the glTF file that was baked.
    pub mesh_index: u32,
    /// Index of the primitive in that mesh.
    pub primitive_index: u32,
}

impl LodMesh3d {
    /// A primitive, by its indices in the glTF file that was baked.
    #[must_use]
    pub fn new(file: Handle<BakedLods>, mesh_index: u32, primitive_index: u32) -> Self {
        Self {
            file,
            mesh_index,
            primitive_index,
        }
    }

    pub(crate) fn key(&self) -> PrimitiveKey {
        (self.file.id(), self.mesh_index, self.primitive_index)
    }

    pub(crate) fn no_primitive(&self, file: &str) -> LodError {
        LodError::NoPrimitive {
            file: file.into(),
            mesh: self.mesh_index,
            primitive: self.primitive_index,
        }
    }
}

/// File, mesh and primitive.
pub(crate) type PrimitiveKey = (AssetId<BakedLods>, u32, u32);

/// The meshes of primitives that are drawn without a glTF file, as long as their file exists.
#[derive(Resource, Default)]
pub(crate) struct StandaloneMeshes(
    pub(crate) HashMap<PrimitiveKey, Result<StandaloneMesh, LodError>>,
);

#[derive(Clone)]
pub(crate) struct StandaloneMesh {
    pub(crate) source: Handle<Mesh>,
    /// The levels; `None` if a [`LevelProvider`](crate::prepare::lookup::LevelProvider) prepares them.
    pub(crate) lods: Option<Handle<BakedLods>>,
}

/// An entity whose file is being loaded.
#[derive(Component)]
pub(crate) struct AwaitsFile;

/// The steps of drawing primitives without a glTF file, before [`FieldLodSystems::Track`].
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum StandaloneSteps {
    /// Finds entities whose file is being loaded.
    Await,
    /// Adds meshes of opt-in features to [`StandaloneMeshes`].
    Make,
    /// Inserts the meshes on entities.
    Insert,
}

/// Inserts meshes on entities when their files are loaded.
pub(crate) fn plugin(app: &mut App) {
    use StandaloneSteps::{Await, Insert, Make};
    app.init_resource::<StandaloneMeshes>()
        .add_observer(remove_mesh)
        .configure_sets(
            PostUpdate,
            (
                Await,
                (Make, Insert)
                    .chain()
                    .run_if(any_with_component::<AwaitsFile>),
            )
                .chain()
                .before(FieldLodSystems::Track),
        )
        .add_systems(
            PostUpdate,
            (
                (
                    remove_changed_files.run_if(on_message::<AssetEvent<BakedLods>>),
                    await_files,
                )
                    .chain()
                    .in_set(Await),
                insert_meshes.in_set(Insert),
            ),
        );
}

/// Drops the meshes of files that were reloaded or removed. Entities without a mesh wait for their file again.
fn remove_changed_files(
    mut events: MessageReader<AssetEvent<BakedLods>>,
    mut known: ResMut<StandaloneMeshes>,
    entities: Query<(Entity, &LodMesh3d)>,
    mut commands: Commands,
) {
    for event in events.read() {
        let id = match event {
            // A file may load after a failure.
            AssetEvent::Added { id } => id,
            AssetEvent::Modified { id } | AssetEvent::Removed { id } => {
                known.0.retain(|(file, ..), _| file != id);
                id
            }
            _ => continue,
        };
        let waits = |mesh: &LodMesh3d| mesh.file.id() == *id && !known.0.contains_key(&mesh.key());
        for (entity, _) in entities.iter().filter(|(_, mesh)| waits(mesh)) {
            commands.entity(entity).try_insert(AwaitsFile);
        }
    }
}

fn await_files(mut commands: Commands, changed: Query<Entity, Changed<LodMesh3d>>) {
    for entity in &changed {
        commands.entity(entity).try_insert(AwaitsFile);
    }
}

/// Makes the meshes of primitives.
#[derive(SystemParam)]
struct MeshMaker<'w> {
    known: ResMut<'w, StandaloneMeshes>,
    files: ResMut<'w, Assets<BakedLods>>,
    meshes: ResMut<'w, Assets<Mesh>>,
    assets: Res<'w, AssetServer>,
}

impl MeshMaker<'_> {
    /// The mesh of a primitive; `None` while its file is being loaded.
    fn find_or_make(&mut self, wanted: &LodMesh3d) -> Option<Result<StandaloneMesh, LodError>> {
        if let Some(made) = self.known.0.get(&wanted.key()) {
            return Some(made.clone());
        }
        let file = asset_name(&self.assets, wanted.file.id());
        let Some(loaded) = self.files.get(&wanted.file) else {
            let has_failed = self.assets.load_state(&wanted.file).is_failed();
            return has_failed.then_some(Err(LodError::FileNotLoaded { file }));
        };
        let primitive = if loaded.pages.is_some() {
            Err(LodError::InPages { file })
        } else {
            let found = loaded.file.find(wanted.mesh_index, wanted.primitive_index);
            found.ok_or_else(|| wanted.no_primitive(&file))
        };
        let made = primitive.cloned().map(|primitive| self.make(primitive));
        self.known.insert(wanted, made.clone());
        Some(made)
    }

    fn make(&mut self, mut primitive: BakedPrimitive) -> StandaloneMesh {
        let hierarchy = &mut primitive.hierarchy;
        let indices = source_indices(hierarchy);
        let source = source_mesh(hierarchy, indices.clone());
        // The triangles are not in the order of the baked mesh, so the hash of the baked mesh would not match.
        hierarchy.source = hierarchy.source_vertices().source_hash(&indices);
        // A file of one primitive, which `AutoLod::baked` names: the lookup finds it like any other file.
        let primitives = vec![primitive];
        let file = Arc::new(BakedFile { primitives });
        StandaloneMesh {
            source: self.meshes.add(source),
            lods: Some(self.files.add(BakedLods::new(file))),
        }
    }
}

impl StandaloneMeshes {
    /// Stores the mesh of a primitive or its error, and logs the error.
    pub(crate) fn insert(&mut self, wanted: &LodMesh3d, made: Result<StandaloneMesh, LodError>) {
        if let Err(error) = &made {
            error!("could not draw a LodMesh3d: {error}");
        }
        self.0.insert(wanted.key(), made);
    }
}

/// Inserts the meshes of loaded files.
fn insert_meshes(
    mut commands: Commands,
    waiting: Query<(Entity, &LodMesh3d, Option<&AutoLod>), With<AwaitsFile>>,
    auto_lods: AutoLodLookup,
    mut maker: MeshMaker,
) {
    for (entity, wanted, auto_lod) in &waiting {
        let Some(made) = maker.find_or_make(wanted) else {
            continue;
        };
        let mut commands = commands.entity(entity);
        // After a failure too: the entity waits again once the loaded file is reloaded.
        commands.try_remove::<AwaitsFile>();
        match made {
            Ok(StandaloneMesh { source, lods }) => {
                commands.try_insert(Mesh3d(source));
                // A `LevelProvider` needs no file in the `AutoLod`, so the `AutoLod` of an ancestor is enough.
                if lods.is_some() || auto_lods.find(entity).is_none() {
                    commands.try_insert(AutoLod {
                        baked: lods,
                        ..auto_lod.cloned().unwrap_or_default()
                    });
                }
            }
            Err(error) => {
                commands.trigger(|entity| LodFailed { entity, error });
            }
        }
    }
}

/// Removes the mesh together with the [`LodMesh3d`].
fn remove_mesh(removal: OnRemove<LodMesh3d>, mut commands: Commands) {
    let mut commands = commands.entity(removal.entity);
    commands.try_remove::<(AwaitsFile, Mesh3d, AutoLod)>();
}
