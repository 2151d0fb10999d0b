//! Meshes that are drawn from their `.fieldlod` or `.fieldpages` file alone.

use std::sync::Arc;

use bevy::asset::AssetId;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy};

use crate::api::auto_lod::AutoLod;
use crate::api::events::{LodError, LodFailed, asset_name};
use crate::api::systems::FieldLodSystems;
use crate::assets::baked_lods::BakedLods;
use crate::pages::mesh_in_pages::MeshInPages;
use crate::prepare::LodMeshes;
use crate::prepare::track::AutoLodLookup;
use crate::scene::unit_mesh::source_mesh;

/// Draws a primitive of a `.fieldlod` or `.fieldpages` file, with any material beside it, where the glTF file that
/// it was baked from is not at hand. A `.fieldlod` file must have all vertices, as it has unless baked
/// `--beside-source`.
///
/// Once the file is loaded, the entity gets a [`Mesh3d`] and an [`AutoLod`] with the levels; one that it has
/// keeps what else it says, and one above it that speaks for a `.fieldpages` file. Entities of the same primitive share both, and lose them with this component.
/// - Of a `.fieldlod` file, which is in memory as a whole, the mesh is the source geometry.
/// - Of a `.fieldpages` file (`fieldlod bake --pages`) it is the coarsest level; finer ones are read in the
///   background as views want them, and leave again, under the budgets of
///   [`FieldLodConfig::memory`](crate::FieldLodConfig::memory). What is not there is drawn coarser. It is always cut
///   into units, and [`AutoLod::simplified_level`] has no say.
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
    /// A primitive of a file, by its place in the glTF file that was baked.
    #[must_use]
    pub fn new(file: Handle<BakedLods>, mesh_index: u32, primitive_index: u32) -> Self {
        Self {
            file,
            mesh_index,
            primitive_index,
        }
    }

    fn key(&self) -> PrimitiveKey {
        (self.file.id(), self.mesh_index, self.primitive_index)
    }
}

type PrimitiveKey = (AssetId<BakedLods>, u32, u32);

/// Source meshes and levels of what is drawn from files alone, as long as the file is there.
#[derive(Resource, Default)]
struct StandaloneMeshes(HashMap<PrimitiveKey, Result<StandaloneMesh, LodError>>);

#[derive(Clone)]
struct StandaloneMesh {
    source: Handle<Mesh>,
    /// Of a file that is in memory as a whole.
    lods: Option<Handle<BakedLods>>,
}

/// An entity whose file is being loaded.
#[derive(Component)]
struct AwaitsFile;

/// Gives entities their meshes as files are loaded.
pub(crate) fn plugin(app: &mut App) {
    let systems = (
        forget_changed_files.run_if(on_message::<AssetEvent<BakedLods>>),
        await_files,
        give_meshes.run_if(any_with_component::<AwaitsFile>),
    );
    app.init_resource::<StandaloneMeshes>()
        .add_observer(take_mesh)
        .add_systems(PostUpdate, systems.chain().before(FieldLodSystems::Track));
}

/// A file that was loaded anew has other meshes, and one that is gone needs none.
fn forget_changed_files(
    mut events: MessageReader<AssetEvent<BakedLods>>,
    mut known: ResMut<StandaloneMeshes>,
    entities: Query<(Entity, &LodMesh3d)>,
    mut commands: Commands,
) {
    for event in events.read() {
        let (AssetEvent::Modified { id } | AssetEvent::Removed { id }) = event else {
            continue;
        };
        let count = known.0.len();
        known.0.retain(|(file, ..), _| file != id);
        if known.0.len() == count {
            continue;
        }
        for (entity, _) in entities.iter().filter(|(_, mesh)| mesh.file.id() == *id) {
            commands.entity(entity).try_insert(AwaitsFile);
        }
    }
}

pub(crate) fn await_files(mut commands: Commands, changed: Query<Entity, Changed<LodMesh3d>>) {
    for entity in &changed {
        commands.entity(entity).try_insert(AwaitsFile);
    }
}

/// Gives entities the meshes of files that are loaded.
fn give_meshes(
    mut commands: Commands,
    waiting: Query<(Entity, &LodMesh3d, Option<&AutoLod>), With<AwaitsFile>>,
    auto_lods: AutoLodLookup,
    mut known: ResMut<StandaloneMeshes>,
    mut lods: ResMut<LodMeshes>,
    mut files: ResMut<Assets<BakedLods>>,
    mut meshes: ResMut<Assets<Mesh>>,
    assets: Res<AssetServer>,
) {
    for (entity, wanted, auto_lod) in &waiting {
        let name = asset_name(&assets, wanted.file.id().untyped());
        let file = files.get(&wanted.file).cloned();
        let made = match (known.0.get(&wanted.key()), file) {
            (Some(made), _) => made.clone(),
            (None, Some(file)) => {
                let made = match &file.pages {
                    Some(pages) => {
                        MeshInPages::find(pages, (wanted.mesh_index, wanted.primitive_index), &name)
                            .and_then(|mesh| StandaloneMesh::in_pages(mesh, &mut meshes, &mut lods))
                    }
                    None => find(&file.file, wanted, &name)
                        .map(|primitive| StandaloneMesh::new(primitive, &mut meshes, &mut files)),
                };
                let made = made.inspect_err(|error| error!("a mesh is not drawn: {error}"));
                known.0.insert(wanted.key(), made.clone());
                made
            }
            (None, None) if assets.load_state(&wanted.file).is_failed() => {
                Err(LodError::FileNotLoaded { file: name })
            }
            (None, None) => continue,
        };
        let mut commands = commands.entity(entity);
        commands.try_remove::<AwaitsFile>();
        match made {
            Ok(StandaloneMesh { source, lods }) => {
                commands.try_insert(Mesh3d(source));
                // What is read in parts needs but some mark, perhaps that of a scene.
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

fn find<'a>(
    file: &'a BakedFile,
    wanted: &LodMesh3d,
    name: &str,
) -> Result<&'a BakedPrimitive, LodError> {
    let (mesh, primitive) = (wanted.mesh_index, wanted.primitive_index);
    let found = file.find(mesh, primitive).ok_or(LodError::NoPrimitive {
        file: name.into(),
        mesh,
        primitive,
    })?;
    if found.hierarchy.lacks_source_vertices() {
        return Err(LodError::VerticesLeftOut { file: name.into() });
    }
    Ok(found)
}

impl StandaloneMesh {
    fn new(
        primitive: &BakedPrimitive,
        meshes: &mut Assets<Mesh>,
        files: &mut Assets<BakedLods>,
    ) -> Self {
        let mut primitive = primitive.clone();
        let hierarchy = &mut primitive.hierarchy;
        let indices = source_indices(hierarchy);
        let source = source_mesh(hierarchy, indices.clone());
        // Its triangles are in another order than where it was baked.
        let vertices = hierarchy.source_vertices();
        hierarchy.source = vertices.source_hash(&indices);
        let file = BakedFile {
            primitives: vec![primitive],
        };
        Self {
            source: meshes.add(source),
            lods: Some(files.add(BakedLods::new(Arc::new(file)))),
        }
    }

    /// The coarsest level, which stays; all others come and go.
    fn in_pages(
        mesh: MeshInPages,
        meshes: &mut Assets<Mesh>,
        lods: &mut LodMeshes,
    ) -> Result<Self, LodError> {
        let source = meshes.add(mesh.coarsest()?);
        lods.set_pages(source.id(), mesh);
        Ok(Self { source, lods: None })
    }
}

fn source_indices(hierarchy: &Hierarchy) -> Vec<u32> {
    let units = hierarchy.source_units().map(|unit| &hierarchy.units[unit]);
    let triangles = units.flat_map(|unit| hierarchy.triangles_of(unit));
    triangles.flatten().collect()
}

/// Takes the mesh off an entity that is not to be drawn from a file any more.
fn take_mesh(removal: On<Remove, LodMesh3d>, mut commands: Commands) {
    let mut commands = commands.entity(removal.entity);
    commands.try_remove::<(AwaitsFile, Mesh3d, AutoLod)>();
}
