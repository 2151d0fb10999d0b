//! Models named on the command line, and the scene as a model.

use std::path::{Path, PathBuf};

use bevy::asset::{AssetLoadError, LoadState};
use bevy::camera::primitives::MeshAabb;
use bevy::gltf::GltfExtras;
use bevy::math::bounding::{Aabb3d, BoundingVolume};
use bevy::mesh::Indices;
use bevy::prelude::*;
use bevy::world_serialization::WorldInstanceReady;
use bevy_fieldlod::prelude::*;

use crate::args::Args;
use crate::layout::{self, PLINTH_IN_M};
use crate::scene;

/// The models, and how far they have come.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct Models {
    files: Vec<PathBuf>,
    /// The folder of the scene, unless that is generated.
    world: Option<PathBuf>,
    /// Models that are neither in the scene nor failed.
    pub(crate) awaited: usize,
    /// Mesh entities of the models in the scene.
    pub(crate) instances: u64,
    /// Triangles of the models in the scene.
    pub(crate) source_triangles: u64,
}

impl Models {
    pub(crate) fn new(args: &Args) -> Self {
        Self {
            files: args.models.clone(),
            world: args.world.clone(),
            awaited: args.models.len() + usize::from(args.world.is_some()),
            ..Self::default()
        }
    }
}

/// A model whose file has not been read yet.
#[derive(Component)]
struct Awaited {
    path: PathBuf,
    file: Handle<Gltf>,
}

/// Loads the models and puts them on their plinths.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(Startup, load)
        .add_systems(Update, (spawn_loaded, report_failed).chain());
}

fn load(mut commands: Commands, models: Res<Models>, assets: Res<AssetServer>) {
    let awaited = |path: &Path| {
        // Bevy looks for relative paths in its assets folder; users mean the current directory.
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.into());
        Awaited {
            path: path.into(),
            file: assets.load(absolute),
        }
    };
    if let Some(folder) = &models.world {
        let scene = (awaited(&scene_in(folder)), Transform::default());
        let mut scene = commands.spawn((scene, Visibility::default()));
        scene.observe(count).observe(scene::dress);
    }
    for (path, spot) in models.files.iter().zip(layout::model_spots()) {
        let model = (awaited(path), spot, Visibility::default());
        commands.spawn(model).observe(count).observe(fit_to_spot);
    }
}

/// The file of a scene that was written into a folder.
fn scene_in(folder: &Path) -> PathBuf {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let scene = paths.find(|path| path.extension().is_some_and(|ext| ext == "glb"));
    // Bevy says what is wrong with it.
    scene.unwrap_or_else(|| folder.join("world.glb"))
}

/// Spawns the default scene of each file that has been read.
fn spawn_loaded(
    mut commands: Commands,
    mut models: ResMut<Models>,
    files: Res<Assets<Gltf>>,
    awaited: Query<(Entity, &Awaited)>,
) {
    for (model, awaited) in &awaited {
        let Some(file) = files.get(&awaited.file) else {
            continue;
        };
        let mut model = commands.entity(model);
        model.remove::<Awaited>();
        match file.default_scene.as_ref().or(file.scenes.first()) {
            Some(scene) => {
                model.insert((WorldAssetRoot(scene.clone()), AutoLod::default()));
            }
            None => {
                models.awaited -= 1;
                report(&awaited.path, "it has no scene");
            }
        }
    }
}

fn report_failed(
    mut commands: Commands,
    mut models: ResMut<Models>,
    assets: Res<AssetServer>,
    awaited: Query<(Entity, &Awaited)>,
) {
    for (model, awaited) in &awaited {
        if let LoadState::Failed(fault) = assets.load_state(&awaited.file) {
            models.awaited -= 1;
            report(&awaited.path, &cause(&fault));
            commands.entity(model).despawn();
        }
    }
}

/// What went wrong, without Bevy's repetition of the file's name.
fn cause(fault: &AssetLoadError) -> String {
    match fault {
        AssetLoadError::AssetLoaderError(fault) => fault.error().to_string(),
        other => other.to_string(),
    }
}

/// Prints the first line of a fault: further ones would be a backtrace.
fn report(path: &Path, fault: &str) {
    let first_line = fault.lines().next().unwrap_or("unknown fault");
    eprintln!("walkthrough: {}: {first_line}", path.display());
}

/// Counts what a model has.
fn count(
    ready: On<WorldInstanceReady>,
    mut models: ResMut<Models>,
    children: Query<&Children>,
    things: Query<(&Mesh3d, Option<&GltfExtras>)>,
    meshes: Res<Assets<Mesh>>,
) {
    models.awaited = models.awaited.saturating_sub(1);
    for (mesh, extras) in things.iter_many(children.iter_descendants(ready.entity)) {
        let triangles = extras.and_then(triangles_elsewhere).or_else(|| {
            let mesh = meshes.get(mesh)?;
            let corners = mesh.indices().map_or(mesh.count_vertices(), Indices::len);
            Some(corners as u64 / 3)
        });
        models.instances += 1;
        models.source_triangles += triangles.unwrap_or(0);
    }
}

/// Triangles of a mesh that is in a file beside its scene.
fn triangles_elsewhere(extras: &GltfExtras) -> Option<u64> {
    let extras: serde_json::Value = serde_json::from_str(&extras.value).ok()?;
    extras["fieldlod"]["triangles"].as_u64()
}

/// Scales a model to its spot once its meshes are known, and puts a plinth below it.
fn fit_to_spot(
    ready: On<WorldInstanceReady>,
    mut commands: Commands,
    mut transforms: ParamSet<(TransformHelper, Query<&mut Transform>)>,
    children: Query<&Children>,
    mesh_of: Query<&Mesh3d>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let model = ready.entity;
    let helper = transforms.p0();
    let Ok(spot) = helper.compute_global_transform(model) else {
        return;
    };

    // The bounds of all meshes, as seen from the model's root.
    let model_from_world = spot.affine().inverse();
    let mut bounds: Option<Aabb3d> = None;
    for entity in children.iter_descendants(model) {
        let mesh = mesh_of
            .get(entity)
            .ok()
            .and_then(|mesh| meshes.get(&mesh.0));
        let (Some(mesh), Ok(place)) = (mesh, helper.compute_global_transform(entity)) else {
            continue;
        };
        if let Some(local) = mesh.compute_aabb() {
            let model_from_mesh = model_from_world * place.affine();
            let center = model_from_mesh.transform_point3a(local.center);
            let half_size = model_from_mesh.matrix3.abs() * local.half_extents;
            let own = Aabb3d::new(center, half_size);
            bounds = Some(bounds.map_or(own, |all| all.merge(&own)));
        }
    }

    let spot = spot.compute_transform();
    if let (Some(bounds), Ok(mut transform)) = (bounds, transforms.p1().get_mut(model)) {
        *transform = spot * layout::fit_model(bounds.min.into(), bounds.max.into());
    }
    commands.spawn((
        Mesh3d(meshes.add(Cuboid::from_size(PLINTH_IN_M))),
        MeshMaterial3d(materials.add(Color::linear_rgb(0.34, 0.27, 0.19))),
        spot * Transform::from_xyz(0.0, -0.5 * PLINTH_IN_M.y, 0.0),
    ));
}
