//! The scene as Bevy entities.

use std::collections::HashMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use bevy::app::PluginGroupBuilder;
use bevy::asset::{RenderAssetUsages, UnapprovedPathMode};
use bevy::camera::primitives::MeshAabb;
use bevy::camera::visibility::NoAutoAabb;
use bevy::log::LogPlugin;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy::render::renderer::RenderAdapterInfo;
use bevy_fieldlod::FieldLodDebugPlugin;
use bevy_fieldlod::prelude::*;

use crate::args::{Args, Quantity};
use crate::cameras::{self, Look};
use crate::guests::{self, Guests};
use crate::scene::{self, Placed};
use crate::shapes::{self, Shape, ShapeId};
use crate::{ground, hours, lamps, sky};

/// What is generated before the app starts.
#[derive(Resource)]
struct Ingredients {
    shapes: Vec<(ShapeId, Shape)>,
    ground: Image,
    generation_time: Duration,
}

/// The size of the scene without guests.
#[derive(Resource, Clone, Copy, Debug)]
pub(crate) struct SceneSize {
    pub(crate) instances: u64,
    pub(crate) source_triangles: u64,
    pub(crate) generation_time: Duration,
}

/// Bevy's plugins as every rendering mode needs them; the caller adds its window.
pub(crate) fn default_plugins() -> PluginGroupBuilder {
    DefaultPlugins
        .set(AssetPlugin {
            // Models on the command line may lie anywhere.
            unapproved_path_mode: UnapprovedPathMode::Allow,
            ..default()
        })
        .set(LogPlugin {
            // Failed models are reported by `guests`, with one line each.
            filter: "warn,bevy_fieldlod=info,bevy_asset=off,bevy_render::renderer=error,\
                     wgpu_hal=error"
                .into(),
            ..default()
        })
}

/// Generates the scene and adds all that shows it.
pub(crate) fn set(app: &mut App, args: &Args) {
    let start = Instant::now();
    let (shapes, ground) = std::thread::scope(|scope| {
        let ground = scope.spawn(ground::paint);
        let shapes = shapes::generate_all();
        (
            shapes,
            ground.join().expect("the ground is painted without panics"),
        )
    });
    let generation_time = start.elapsed();
    let seconds = generation_time.as_secs_f32();
    eprintln!("walkthrough: scene generated in {seconds:.1} s");
    let ingredients = Ingredients {
        shapes,
        ground,
        generation_time,
    };
    app.insert_resource(ingredients)
        .insert_resource(Look {
            error_px: args.error_px,
            split: args.split,
            night: args.night,
        })
        .insert_resource(Guests::new(&args.models))
        .add_plugins((
            FieldLodPlugin,
            FieldLodDebugPlugin,
            hours::plugin,
            sky::plugin,
            lamps::plugin,
            cameras::plugin,
            guests::plugin,
        ))
        .insert_resource(FieldLodDebug {
            color_levels: args.levels,
            heat_map: args.heat_map.map(Quantity::heat_map),
            ..default()
        })
        .insert_resource(FieldLodConfig {
            cache_folder: cache_folder(args),
            ..default()
        })
        .add_systems(Startup, build)
        .add_systems(Update, choose_kinds);
}

/// Beside the program, so that `cargo clean` removes it.
fn cache_folder(args: &Args) -> Option<PathBuf> {
    let program = std::env::current_exe().ok().filter(|_| !args.no_cache)?;
    Some(program.parent()?.join("walkthrough-cache"))
}

fn build(world: &mut World) {
    let Some(mut ingredients) = world.remove_resource::<Ingredients>() else {
        return;
    };
    let adapter = world.get_resource::<RenderAdapterInfo>();
    if adapter.is_some_and(|adapter| adapter.device_type == wgpu::DeviceType::Cpu) {
        ground::filter_evenly(&mut ingredients.ground);
    }
    let ground = world
        .resource_mut::<Assets<Image>>()
        .add(ingredients.ground);
    let mut kinds = HashMap::new();
    for (id, shape) in ingredients.shapes {
        let triangles = shape.triangle_count();
        let (mesh, mean_color) = mesh(shape);
        // Bevy would work it out anew for each of the thousands of instances.
        let bounds = mesh.compute_aabb().unwrap_or_default();
        let material = material(id, mean_color, &ground);
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        let material = world
            .resource_mut::<Assets<StandardMaterial>>()
            .add(material);
        kinds.insert(id, (mesh, material, bounds, triangles));
    }
    let mut size = SceneSize {
        instances: 0,
        source_triangles: 0,
        generation_time: ingredients.generation_time,
    };
    for placed in scene::layout() {
        let (mesh, material, bounds, triangles) = &kinds[&placed.shape];
        size.instances += 1;
        size.source_triangles += triangles;
        world.spawn((
            Name::new(placed.shape.name()),
            Mesh3d(mesh.clone()),
            MeshMaterial3d(material.clone()),
            transform(&placed),
            *bounds,
            NoAutoAabb,
            AutoLod::of_kind(lod_kind(placed.shape, false)),
            Showing(placed.shape),
        ));
    }
    world.insert_resource(size);
}

/// What an entity shows.
#[derive(Component)]
struct Showing(ShapeId);

/// Trees are exchanged as a whole, so that each of thousands stays one entity. A level so chosen is
/// the same for all cameras: beside a half at full detail, all is cut into pieces instead.
pub(crate) fn lod_kind(shape: ShapeId, split: bool) -> LodKind {
    match shape {
        _ if split => LodKind::Clusters,
        ShapeId::Oak(_) | ShapeId::Pine(_) | ShapeId::Cypress => LodKind::WholeMesh,
        _ => LodKind::Auto,
    }
}

fn choose_kinds(
    look: Res<Look>,
    mut was_split: Local<bool>,
    mut things: Query<(&Showing, &mut AutoLod)>,
) {
    if *was_split == look.split {
        return;
    }
    *was_split = look.split;
    for (showing, mut lod) in &mut things {
        let kind = lod_kind(showing.0, look.split);
        if lod.kind != kind {
            lod.kind = kind;
        }
    }
}

pub(crate) fn transform(placed: &Placed) -> Transform {
    Transform {
        translation: placed.position,
        rotation: placed.rotation,
        scale: Vec3::splat(placed.scale),
    }
}

/// The mesh, with vertex colours relative to their mean, and that mean.
pub(crate) fn mesh(shape: Shape) -> (Mesh, Vec3) {
    let count = shape.colors.len().max(1) as f32;
    let mean = match shape.colors.iter().sum::<Vec3>() / count {
        Vec3::ZERO => Vec3::ONE,
        mean => mean,
    };
    let relative = |color: &Vec3| (*color / mean).extend(1.0).to_array();
    let colors: Vec<_> = shape.colors.iter().map(relative).collect();
    let mut mesh = Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, shape.positions)
    .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, shape.normals)
    .with_inserted_indices(Indices::U32(shape.indices));
    if !colors.is_empty() {
        mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, colors);
    }
    if !shape.uvs.is_empty() {
        mesh.insert_attribute(Mesh::ATTRIBUTE_UV_0, shape.uvs);
    }
    (mesh, mean)
}

fn material(id: ShapeId, mean_color: Vec3, ground: &Handle<Image>) -> StandardMaterial {
    let is_ground = id == ShapeId::Terrain;
    StandardMaterial {
        base_color: Color::linear_rgb(mean_color.x, mean_color.y, mean_color.z),
        base_color_texture: is_ground.then(|| ground.clone()),
        perceptual_roughness: 0.92,
        reflectance: 0.25,
        ..default()
    }
}
