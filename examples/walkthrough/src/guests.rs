//! Models named on the command line.

use std::path::{Path, PathBuf};

use bevy::asset::{AssetLoadError, LoadState};
use bevy::camera::primitives::MeshAabb;
use bevy::mesh::Indices;
use bevy::prelude::*;
use bevy::world_serialization::WorldInstanceReady;
use bevy_fieldlod::prelude::*;

use crate::scene::{self, PLINTH_IN_M};
use crate::stage;

/// The models, and how far they have come.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct Guests {
    models: Vec<PathBuf>,
    /// Models that are neither in the scene nor failed.
    pub(crate) awaited: usize,
    /// Mesh entities of the models in the scene.
    pub(crate) instances: u64,
    /// Their triangles.
    pub(crate) source_triangles: u64,
}

impl Guests {
    pub(crate) fn new(models: &[PathBuf]) -> Self {
        Self {
            models: models.to_vec(),
            awaited: models.len(),
            ..Self::default()
        }
    }
}

/// A model that has not appeared yet.
#[derive(Component)]
struct Awaited {
    model: PathBuf,
    file: Handle<Gltf>,
}

/// Loads the models and seats them.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(Startup, load)
        .add_systems(Update, (show_loaded, report_failed).chain());
}

fn load(mut commands: Commands, guests: Res<Guests>, assets: Res<AssetServer>) {
    for (model, spot) in guests.models.iter().zip(scene::guest_spots()) {
        let awaited = Awaited {
            model: model.clone(),
            file: assets.load(absolute(model)),
        };
        let seat = (awaited, stage::transform(&spot), Visibility::default());
        commands.spawn(seat).observe(seat_guest);
    }
}

/// Bevy looks for relative paths in its assets folder; users mean the current directory.
fn absolute(model: &Path) -> PathBuf {
    std::path::absolute(model).unwrap_or_else(|_| model.to_owned())
}

/// Spawns the default scene of each file that has been read.
fn show_loaded(
    mut commands: Commands,
    mut guests: ResMut<Guests>,
    files: Res<Assets<Gltf>>,
    awaited: Query<(Entity, &Awaited)>,
) {
    for (seat, awaited) in &awaited {
        let Some(file) = files.get(&awaited.file) else {
            continue;
        };
        commands.entity(seat).remove::<Awaited>();
        let Some(scene) = file.default_scene.as_ref().or(file.scenes.first()) else {
            guests.awaited -= 1;
            report(&awaited.model, "it has no scene");
            continue;
        };
        commands
            .entity(seat)
            .insert((WorldAssetRoot(scene.clone()), AutoLod::default()));
    }
}

fn report_failed(
    mut commands: Commands,
    mut guests: ResMut<Guests>,
    assets: Res<AssetServer>,
    awaited: Query<(Entity, &Awaited)>,
) {
    for (seat, awaited) in &awaited {
        if let LoadState::Failed(fault) = assets.load_state(&awaited.file) {
            guests.awaited -= 1;
            report(&awaited.model, &cause(&fault));
            commands.entity(seat).despawn();
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

/// One line: further ones would be a backtrace.
fn report(model: &Path, fault: &str) {
    let first_line = fault.lines().next().unwrap_or("unknown fault");
    eprintln!("walkthrough: {}: {first_line}", model.display());
}

/// Scales a model to its spot once its meshes are known, and puts a plinth below it.
fn seat_guest(
    ready: On<WorldInstanceReady>,
    mut commands: Commands,
    mut guests: ResMut<Guests>,
    mut transforms: Query<&mut Transform>,
    children: Query<&Children>,
    mesh_of: Query<&Mesh3d>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let seat = ready.entity;
    guests.awaited = guests.awaited.saturating_sub(1);
    let Ok(spot) = transforms.get(seat).copied() else {
        return;
    };
    let mut bounds = Bounds::default();
    let mut pending = vec![(seat, Mat4::IDENTITY)];
    while let Some((entity, seat_from_entity)) = pending.pop() {
        if let Some(mesh) = mesh_of
            .get(entity)
            .ok()
            .and_then(|mesh| meshes.get(&mesh.0))
        {
            bounds.include(mesh, seat_from_entity);
            guests.instances += 1;
            guests.source_triangles += triangle_count(mesh);
        }
        for &child in children.get(entity).into_iter().flatten() {
            let local = transforms
                .get(child)
                .map_or(Mat4::IDENTITY, Transform::to_matrix);
            pending.push((child, seat_from_entity * local));
        }
    }
    if bounds.min.cmple(bounds.max).all() {
        let fit = scene::fit_guest(bounds.min, bounds.max);
        if let Ok(mut transform) = transforms.get_mut(seat) {
            *transform = spot * Transform::from_matrix(fit.into());
        }
    }
    commands.spawn((
        Mesh3d(meshes.add(Cuboid::from_size(PLINTH_IN_M))),
        MeshMaterial3d(materials.add(Color::linear_rgb(0.34, 0.27, 0.19))),
        spot * Transform::from_xyz(0.0, -0.5 * PLINTH_IN_M.y, 0.0),
    ));
}

struct Bounds {
    min: Vec3,
    max: Vec3,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            min: Vec3::MAX,
            max: Vec3::MIN,
        }
    }
}

impl Bounds {
    fn include(&mut self, mesh: &Mesh, seat_from_mesh: Mat4) {
        let Some(aabb) = mesh.compute_aabb() else {
            return;
        };
        let (center, half_size) = (Vec3::from(aabb.center), Vec3::from(aabb.half_extents));
        for corner in 0..8 {
            let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let offset = half_size * Vec3::new(sign(0), sign(1), sign(2));
            let point = seat_from_mesh.transform_point3(center + offset);
            self.min = self.min.min(point);
            self.max = self.max.max(point);
        }
    }
}

fn triangle_count(mesh: &Mesh) -> u64 {
    let corners = mesh.indices().map_or(mesh.count_vertices(), Indices::len);
    corners as u64 / 3
}
