//! Models named on the command line.

use std::path::{Path, PathBuf};

use bevy::asset::LoadState;
use bevy::camera::primitives::MeshAabb;
use bevy::math::bounding::{Aabb3d, BoundingVolume};
use bevy::mesh::Indices;
use bevy::prelude::*;
use bevy::world_serialization::WorldInstanceReady;
use bevy_fieldlod::prelude::*;

use super::layout::{self, PLINTH_IN_M};
use crate::cameras::ViewOptions;
use crate::output::report::SceneNumbers;

/// The models and the state of their loading.
#[derive(Resource, Clone, Debug)]
pub(crate) struct Models {
    pub(crate) files: Vec<PathBuf>,
    /// Models that are still loading.
    pub(crate) loading: usize,
}

/// The file of a model that is still loading.
#[derive(Component)]
struct Loading {
    path: PathBuf,
    file: Handle<Gltf>,
}

/// Loads the models and puts them on their plinths.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(Startup, load)
        .add_systems(Update, (spawn_loaded, report_failed).chain());
}

fn load(mut commands: Commands, models: Res<Models>, assets: Res<AssetServer>) {
    for (path, spot) in models.files.iter().zip(layout::model_spots()) {
        // Bevy resolves relative paths in its assets folder, but users mean the current directory.
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.into());
        let model = Loading {
            path: path.into(),
            file: assets.load(absolute),
        };
        commands
            .spawn((model, spot, Visibility::default()))
            .observe(count)
            .observe(fit_to_spot);
    }
}

/// Spawns the default scene of each loaded file.
fn spawn_loaded(
    mut commands: Commands,
    mut models: ResMut<Models>,
    files: Res<Assets<Gltf>>,
    loading: Query<(Entity, &Loading)>,
    options: Res<ViewOptions>,
) {
    for (model, loading) in &loading {
        let Some(file) = files.get(&loading.file) else {
            continue;
        };
        let mut model = commands.entity(model);
        model.remove::<Loading>();
        match file.default_scene.as_ref().or(file.scenes.first()) {
            Some(scene) => {
                let levels = AutoLod::of_kind(options.kind_of(None));
                model.insert((WorldAssetRoot(scene.clone()), levels));
            }
            None => {
                models.loading -= 1;
                report(&loading.path, "the file has no scene");
            }
        }
    }
}

fn report_failed(
    mut commands: Commands,
    mut models: ResMut<Models>,
    assets: Res<AssetServer>,
    loading: Query<(Entity, &Loading)>,
) {
    for (model, loading) in &loading {
        if let LoadState::Failed(error) = assets.load_state(&loading.file) {
            models.loading -= 1;
            report(&loading.path, &error.to_string());
            commands.entity(model).despawn();
        }
    }
}

/// Prints the first line of an error. Further lines are a backtrace.
fn report(path: &Path, error: &str) {
    let cause = error.lines().next().unwrap_or("unknown error");
    eprintln!(
        "walkthrough: could not load the model {}: {cause}",
        path.display()
    );
}

/// Counts the meshes and triangles of a model.
fn count(
    ready: On<WorldInstanceReady>,
    mut models: ResMut<Models>,
    mut numbers: ResMut<SceneNumbers>,
    children: Query<&Children>,
    mesh_of: Query<&Mesh3d>,
    meshes: Res<Assets<Mesh>>,
) {
    models.loading = models.loading.saturating_sub(1);
    for mesh in mesh_of.iter_many(children.iter_descendants(ready.entity)) {
        let corners = meshes.get(mesh).map_or(0, |mesh| {
            mesh.indices().map_or(mesh.count_vertices(), Indices::len)
        });
        numbers.instances += 1;
        numbers.source_triangles += corners as u64 / 3;
    }
}

/// Scales a loaded model to its spot and puts a plinth below it.
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

    // All bounds are in the space of the model's root, so that they can be merged.
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
