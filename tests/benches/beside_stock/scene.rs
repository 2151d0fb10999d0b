//! A measuring process: one scene, with the plugin or without.

use std::path::Path;
use std::time::{Duration, Instant};

use bevy::camera::primitives::Aabb;
use bevy::light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::mesh::allocator::MeshAllocator;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::{Eye, Stage, plugins};
use fieldlod_tests::{height_field, rock};

use crate::measure::SUPERSAMPLED;
use crate::{By, Case, pictures, process};

/// Generated scenes.
pub(crate) const SCENES: [&str; 4] = ["props", "terrain", "menu", "menu, handles kept"];
/// Distances of the camera from the centre of the scene, in radii of the scene.
const RADII: [f32; 3] = [1.0, 2.5, 10.0];
/// Frames at each pose before the measurement, and at the last pose of the plugin. Unused units are despawned during
/// the latter. Each frame takes about a second on a busy software adapter.
const FRAMES: [u32; 2] = [6, 70];
/// Frames after a menu is closed, until unused levels are dropped.
const FRAMES_AFTER_MENU: u32 = 1_250;
/// Kinds of meshes that a menu shows one after the other.
const KINDS: u32 = 24;
const SIZE_PX: UVec2 = UVec2::new(480, 270);

/// The results of a measuring process at a pose.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Measured {
    pub(crate) radii: f32,
    pub(crate) triangles: u64,
    pub(crate) triangles_full: u64,
    pub(crate) resident_mb: f64,
    pub(crate) slabs_mb: f64,
    /// Mesh assets.
    pub(crate) meshes: usize,
    /// Seconds from spawning the scene until it is drawn with its levels.
    pub(crate) ready_s: f64,
}

pub(crate) fn measure(case: &Case) -> Vec<Measured> {
    let mut stage = new_stage(case);
    let eye = add_eye_and_sun(&mut stage, case.by);
    stage.app.update();
    let start = Instant::now();
    if case.scene.starts_with("menu") {
        show_menu(&mut stage, case);
        let ready = start.elapsed();
        if !case.only_bakes {
            (0..FRAMES_AFTER_MENU).for_each(|_| stage.app.update());
        }
        return vec![measure_pose(&mut stage, &eye, 0.0, ready)];
    }
    spawn(&mut stage, case);
    let ready = start.elapsed();
    let (center, radius) = bounds(stage.app.world_mut());
    let radii = RADII.into_iter().filter(|_| !case.only_bakes);
    radii
        .map(|radii| {
            let away = Vec3::new(0.5, 0.4, 1.0).normalize() * radius * radii;
            let pose = Transform::from_translation(center + away).looking_at(center, Vec3::Y);
            stage.insert(eye.entity, pose);
            let is_last = case.by == By::Plugin && radii == RADII[2];
            let frames = FRAMES[usize::from(is_last)];
            (0..frames).for_each(|_| stage.app.update());
            let measured = measure_pose(&mut stage, &eye, radii, ready);
            let name = Path::new(&case.scene).file_stem().unwrap();
            let name = name.to_string_lossy();
            let path = pictures::path(&case.pictures, &name, radii, case.by);
            let [picture] = stage.shoot([&eye]);
            picture.save(path).unwrap();
            measured
        })
        .collect()
}

fn add_eye_and_sun(stage: &mut Stage, by: By) -> Eye {
    let pose = Transform::from_xyz(0.0, 0.0, 4.0);
    let background = Color::srgb(0.3, 0.35, 0.4);
    let scale = if by == By::Truth { SUPERSAMPLED } else { 1 };
    let eye = stage.add_eye_of_size(SIZE_PX * scale, pose, background, FieldLodCamera::default());
    stage.insert(eye.entity, Msaa::Sample4);
    // Software adapters are slow.
    let shadow_map = DirectionalLightShadowMap { size: 1024 };
    stage.app.insert_resource(shadow_map);
    let light = DirectionalLight {
        shadow_maps_enabled: true,
        illuminance: 4_000.0,
        ..default()
    };
    let cascades = CascadeShadowConfigBuilder {
        num_cascades: 2,
        ..default()
    };
    let sun = Transform::default().looking_to(Vec3::new(-0.5, -0.8, -0.6), Vec3::Y);
    stage.spawn((light, cascades.build(), sun));
    eye
}

fn new_stage(case: &Case) -> Stage {
    let plugins = plugins().set(AssetPlugin {
        file_path: "/".into(),
        unapproved_path_mode: bevy::asset::UnapprovedPathMode::Allow,
        ..default()
    });
    let mut app = App::new();
    app.add_plugins(plugins);
    if case.by == By::Plugin {
        app.add_plugins(FieldLodPlugin)
            .insert_resource(LodPriority::LoadingScreen)
            .insert_resource(FieldLodAppConfig {
                whole_world: true,
                cache_folder: Some(case.cache.clone()),
                ..default()
            });
    }
    let mut stage = Stage { app };
    stage.finish();
    stage
}

/// Spawns the scene and draws until it is ready.
fn spawn(stage: &mut Stage, case: &Case) {
    let stone = stage.add(StandardMaterial::from(Color::srgb(0.7, 0.6, 0.5)));
    match case.scene.as_str() {
        "props" => {
            let kinds: Vec<Handle<Mesh>> = (0..16).map(|seed| add(stage, &rock(4, seed))).collect();
            for index in 0..400u16 {
                let (x, z) = (f32::from(index % 20), f32::from(index / 20));
                let place = Transform::from_xyz(x * 3.0, 0.0, z * 3.0);
                let mesh = kinds[usize::from(index) % kinds.len()].clone();
                stage.spawn((Mesh3d(mesh), MeshMaterial3d(stone.clone()), place));
            }
        }
        "terrain" => {
            let mesh = add(stage, &height_field(256));
            stage.spawn((Mesh3d(mesh), MeshMaterial3d(stone)));
        }
        file => {
            let assets = stage.app.world().resource::<AssetServer>().clone();
            let scene = assets.load(GltfAssetLabel::Scene(0).from_asset(file.to_owned()));
            stage.spawn(WorldAssetRoot(scene.clone()));
            run_until(stage, |world| {
                assets.is_loaded_with_dependencies(&scene) && mesh_count(world) > 0
            });
        }
    }
    run_until(stage, is_ready);
}

fn is_ready(world: &mut World) -> bool {
    let progress = world.get_resource::<FieldLodProgress>();
    progress.is_none_or(|progress| progress.share_done() == 1.0)
}

fn run_until(stage: &mut Stage, is_done: impl Fn(&mut World) -> bool) {
    let deadline = Instant::now() + Duration::from_secs(1200);
    loop {
        stage.app.update();
        if is_done(stage.app.world_mut()) {
            return;
        }
        assert!(Instant::now() < deadline, "the scene is not ready");
    }
}

fn mesh_count(world: &mut World) -> usize {
    world.query::<&Mesh3d>().iter(world).len()
}

/// Shows kinds of meshes one after the other, and despawns each.
fn show_menu(stage: &mut Stage, case: &Case) {
    let stone = stage.add(StandardMaterial::from(Color::srgb(0.7, 0.6, 0.5)));
    let mut kept = Vec::new();
    for kind in 0..KINDS {
        // Some are props, some are drawn as units.
        let mesh = add(stage, &rock(4 + kind % 2, kind));
        let shown = stage.spawn((Mesh3d(mesh.clone()), MeshMaterial3d(stone.clone())));
        run_until(stage, is_ready);
        (0..5).for_each(|_| stage.app.update());
        stage.app.world_mut().despawn(shown);
        if case.scene.ends_with("kept") {
            kept.push(mesh);
        }
    }
    stage.app.insert_resource(Kept { _handles: kept });
}

/// Handles that a game keeps.
#[derive(Resource)]
struct Kept {
    _handles: Vec<Handle<Mesh>>,
}

fn add(stage: &mut Stage, source: &fieldlod_bake::SourceMesh) -> Handle<Mesh> {
    stage.add(bevy_mesh(source))
}

/// The centre and the radius of all meshes.
fn bounds(world: &mut World) -> (Vec3, f32) {
    let mut meshes =
        world.query_filtered::<(&Aabb, &GlobalTransform), (With<Mesh3d>, Without<LodUnit>)>();
    let corners = meshes.iter(world).flat_map(|(aabb, place)| {
        let corner =
            |bits: u32| Vec3::from(BVec3::new(bits & 1 == 0, bits & 2 == 0, bits & 4 == 0));
        let (min, size) = (Vec3::from(aabb.min()), 2.0 * Vec3::from(aabb.half_extents));
        (0..8).map(move |bits| place.transform_point(min + corner(bits) * size))
    });
    let (min, max) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), at| {
        (min.min(at), max.max(at))
    });
    (min.midpoint(max), min.distance(max) / 2.0)
}

fn measure_pose(stage: &mut Stage, eye: &Eye, radii: f32, ready: Duration) -> Measured {
    let render_world = stage.app.sub_app(RenderApp).world();
    let slabs = render_world.resource::<MeshAllocator>().slabs_size();
    let world = stage.app.world();
    let stats = world
        .get::<FieldLodViewStats>(eye.entity)
        .copied()
        .unwrap_or_default();
    let meshes = world.resource::<Assets<Mesh>>();
    Measured {
        radii,
        triangles: stats.triangles_drawn,
        triangles_full: stats.triangles_full,
        resident_mb: process::number("status", "VmRSS:") as f64 * 1.024e-3,
        slabs_mb: slabs as f64 / 1e6,
        meshes: meshes.len(),
        ready_s: ready.as_secs_f64(),
    }
}
