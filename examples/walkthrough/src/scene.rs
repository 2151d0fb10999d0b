//! The scene as Bevy entities.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use bevy::app::PluginGroupBuilder;
use bevy::asset::UnapprovedPathMode;
use bevy::camera::primitives::MeshAabb;
use bevy::camera::visibility::NoAutoAabb;
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::world_serialization::WorldInstanceReady;
use bevy_fieldlod::BakeConfig;
use bevy_fieldlod::FieldLodDebugPlugin;
use bevy_fieldlod::prelude::*;

use crate::args::{Args, Quantity};
use crate::cameras::{self, ViewOptions};
use crate::models::{self, Models};
use crate::quality::Quality;
use crate::shapes::{self, Shape, ShapeId};
use crate::{adapter, ground_texture, lamps, layout, sky};

/// What is generated before the app starts.
#[derive(Resource)]
struct Generated {
    shapes: Vec<(ShapeId, Shape)>,
    ground: Image,
    time: Duration,
}

/// Numbers of the scene without models of the user.
#[derive(Resource, Clone, Copy, Debug)]
pub(crate) struct SceneSize {
    pub(crate) instances: u64,
    pub(crate) source_triangles: u64,
    pub(crate) generation_time: Duration,
}

/// What is logged. Failed models are reported by `models`, with one line each.
const LOG_FILTER: &str = "warn,bevy_fieldlod=info,bevy_asset=off,bevy_render::renderer=error,\
                          wgpu_hal=error,winit=error";
/// What is not logged besides if nothing is drawn: that there is no renderer.
const LOG_FILTER_WITHOUT_RENDERER: &str = "bevy_render=off,bevy_gizmos_render=off,bevy_gltf=error";

/// Bevy's plugins, with a renderer if something `draws`; the caller sets the window.
pub(crate) fn default_plugins(draws: bool) -> PluginGroupBuilder {
    let mut task_pools = TaskPoolPlugin::default();
    // Levels of detail are baked there, and Bevy has but one thread for it on few cores.
    task_pools.task_pool_options.async_compute.min_threads = 2;
    DefaultPlugins
        .set(task_pools)
        .set(AssetPlugin {
            // Models on the command line may lie anywhere.
            unapproved_path_mode: UnapprovedPathMode::Allow,
            ..default()
        })
        .set(LogPlugin {
            filter: match draws {
                true => LOG_FILTER.into(),
                false => format!("{LOG_FILTER},{LOG_FILTER_WITHOUT_RENDERER}"),
            },
            ..default()
        })
        .set(adapter::render_plugin(draws))
}

/// Generates the scene and adds all that shows it.
pub(crate) fn add_to(app: &mut App, args: &Args, quality: &Quality) {
    let generated = generate(quality, args.world.is_none());
    let seconds = generated.time.as_secs_f32();
    eprintln!("walkthrough: scene generated in {seconds:.1} s");

    let defaults = FieldLodSettings::default();
    app.insert_resource(generated)
        .insert_resource(*quality)
        .insert_resource(ViewOptions {
            error_px: quality.error_px,
            shadow_bias: args.shadow_bias.unwrap_or(defaults.shadow_bias),
            offscreen_margin: args.offscreen_margin.unwrap_or(defaults.offscreen_margin),
            visible_flux: args.visible_flux,
            occlusion_culling: args.occlusion_culling,
            split: args.split,
            plain: args.plain,
            night: args.night,
        })
        .insert_resource(Models::new(args))
        .insert_resource(FieldLodDebug {
            color_levels: args.levels,
            heat_map: args.heat_map.map(Quantity::heat_map),
            ..default()
        })
        .insert_resource(FieldLodConfig {
            cache_folder: cache_folder(args),
            memory: LodMemory {
                gpu_bytes: args.gpu_mib << 20,
                ..default()
            },
            bake: BakeConfig {
                cards: args.cards,
                ..default()
            },
            ..default()
        })
        .add_plugins((
            FieldLodPlugin,
            FieldLodDebugPlugin,
            sky::plugin,
            lamps::plugin,
            cameras::plugin,
            models::plugin,
        ))
        .add_systems(Startup, spawn)
        .add_systems(
            Update,
            choose_kinds.run_if(resource_exists_and_changed::<ViewOptions>),
        );
}

/// Makes the shapes, unless the world has them, and the picture on the ground, on all cores.
fn generate(quality: &Quality, has_shapes: bool) -> Generated {
    let start = Instant::now();
    let (shapes, ground) = std::thread::scope(|scope| {
        let ground = scope.spawn(|| ground_texture::paint(quality.ground_anisotropy));
        let shapes = match has_shapes {
            true => shapes::generate_all(quality.ground_squares),
            false => Vec::new(),
        };
        let ground = ground.join();
        (
            shapes,
            ground.expect("the ground is painted without panics"),
        )
    });
    Generated {
        shapes,
        ground,
        time: start.elapsed(),
    }
}

/// Where levels of detail are kept: beside the program, so that `cargo clean` removes it.
fn cache_folder(args: &Args) -> Option<PathBuf> {
    let program = std::env::current_exe().ok().filter(|_| !args.no_cache)?;
    Some(program.parent()?.join("walkthrough-cache"))
}

/// The shape of an entity.
#[derive(Component)]
struct HasShape(ShapeId);

fn spawn(world: &mut World) {
    let Some(generated) = world.remove_resource::<Generated>() else {
        return;
    };
    // One mesh and one material for each shape.
    let ground = world.resource_mut::<Assets<Image>>().add(generated.ground);
    world.insert_resource(Ground(ground.clone()));
    let mut shapes = HashMap::new();
    for (id, shape) in generated.shapes {
        let triangles = shape.triangle_count();
        let (mesh, mean_color) = shape.into_mesh();
        // Bevy would work it out anew for each of the thousands of instances.
        let bounds = mesh.compute_aabb().unwrap_or_default();
        let material = material(id, mean_color, &ground);
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
        shapes.insert(id, (mesh, materials.add(material), bounds, triangles));
    }

    // Their instances.
    let mut size = SceneSize {
        instances: 0,
        source_triangles: 0,
        generation_time: generated.time,
    };
    let options = *world.resource::<ViewOptions>();
    let placed = match shapes.is_empty() {
        true => Vec::new(),
        false => layout::place_all(world.resource::<Quality>().vegetation),
    };
    for placed in placed {
        let (mesh, material, bounds, triangles) = &shapes[&placed.shape];
        size.instances += 1;
        size.source_triangles += triangles;
        world.spawn((
            Name::new(placed.shape.name()),
            Mesh3d(mesh.clone()),
            MeshMaterial3d(material.clone()),
            placed.transform,
            *bounds,
            NoAutoAabb,
            AutoLod::of_kind(options.kind_of(placed.shape)),
            HasShape(placed.shape),
        ));
    }
    world.insert_resource(size);
}

/// The texture on the ground.
#[derive(Resource)]
pub(crate) struct Ground(Handle<Image>);

/// Gives what was loaded of a world the levels and the materials that it has when it is generated.
pub(crate) fn dress(
    ready: On<WorldInstanceReady>,
    mut commands: Commands,
    options: Res<ViewOptions>,
    ground: Res<Ground>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    children: Query<&Children>,
    names: Query<&Name>,
    material_of: Query<&MeshMaterial3d<StandardMaterial>>,
) {
    let mut dressed = HashSet::new();
    for node in children.iter_descendants(ready.entity) {
        let name = names.get(node).ok();
        let Some(shape) = name.and_then(|name| ShapeId::of_name(name)) else {
            continue;
        };
        let levels = AutoLod::of_kind(options.kind_of(shape));
        commands.entity(node).insert((levels, HasShape(shape)));
        for primitive in children.iter_descendants(node) {
            let Ok(MeshMaterial3d(handle)) = material_of.get(primitive) else {
                continue;
            };
            if dressed.insert(handle.id())
                && let Some(mut loaded) = materials.get_mut(handle)
            {
                let color = loaded.base_color.to_linear().to_vec3();
                *loaded = material(shape, color, &ground.0);
            }
        }
    }
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

/// Trees are exchanged as a whole, so that each of thousands stays one entity.
pub(crate) fn lod_kind(shape: ShapeId) -> LodKind {
    match shape {
        ShapeId::Oak(_) | ShapeId::Pine(_) | ShapeId::Cypress => LodKind::WholeMesh,
        _ => LodKind::Auto,
    }
}

impl ViewOptions {
    /// What a thing of this shape gets. The level of a whole is the same for all cameras: beside a half at full detail,
    /// all is cut into pieces instead.
    fn kind_of(&self, shape: ShapeId) -> LodKind {
        match self {
            Self { plain: true, .. } => LodKind::Plain,
            Self { split: true, .. } => LodKind::Clusters,
            _ => lod_kind(shape),
        }
    }
}

/// Gives every entity the kind of levels of detail that the split of the screen asks for.
fn choose_kinds(
    options: Res<ViewOptions>,
    mut was_split: Local<bool>,
    mut things: Query<(&HasShape, &mut AutoLod)>,
) {
    if *was_split == options.split {
        return;
    }
    *was_split = options.split;
    for (shape, mut lod) in &mut things {
        let kind = options.kind_of(shape.0);
        if lod.kind != kind {
            lod.kind = kind;
        }
    }
}
