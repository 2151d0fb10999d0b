//! The scene as Bevy entities.

mod ground_texture;
mod layout;
pub(crate) mod models;
mod placed;
mod sky;
mod woods;

use std::collections::HashMap;
use std::path::PathBuf;
use std::time::Instant;

use bevy::app::PluginGroupBuilder;
use bevy::asset::UnapprovedPathMode;
use bevy::camera::primitives::MeshAabb;
use bevy::camera::visibility::NoAutoAabb;
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy_fieldlod::FieldLodDebugPlugin;
use bevy_fieldlod::prelude::*;

use crate::adapter;
use crate::args::Args;
use crate::cameras::{self, ViewOptions};
use crate::output::report::SceneNumbers;
use crate::quality::Quality;
use crate::shapes::{self, Shape, ShapeId};
use models::Models;

/// The shapes and the texture, generated before the app starts.
#[derive(Resource)]
struct Generated {
    shapes: Vec<(ShapeId, Shape)>,
    ground: Image,
}

/// The log filter. It hides Bevy's asset errors, because the module `models` prints one line per failed model.
const LOG_FILTER: &str = "warn,bevy_fieldlod=info,bevy_asset=off,bevy_render::renderer=error,\
                          wgpu_hal=error,winit=error";
/// Additional filters without a renderer. They hide Bevy's log lines about the missing renderer.
const LOG_FILTER_WITHOUT_RENDERER: &str = "bevy_render=off,bevy_gizmos_render=off,bevy_gltf=error";

/// Bevy's plugins, with a renderer if `draws` is set. The caller sets the window.
pub(crate) fn default_plugins(draws: bool) -> PluginGroupBuilder {
    DefaultPlugins
        .set(AssetPlugin {
            // Models on the command line may be in any folder.
            unapproved_path_mode: UnapprovedPathMode::Allow,
            ..default()
        })
        .set(LogPlugin {
            filter: if draws {
                LOG_FILTER.into()
            } else {
                format!("{LOG_FILTER},{LOG_FILTER_WITHOUT_RENDERER}")
            },
            ..default()
        })
        .set(adapter::render_plugin(draws))
}

/// Generates the scene, and adds its resources, plugins and systems.
pub(crate) fn add_to(app: &mut App, args: &Args, quality: &Quality) {
    let start = Instant::now();
    let generated = generate(quality);
    let generate_s = start.elapsed().as_secs_f32();
    eprintln!("walkthrough: scene generated in {generate_s:.1} s");

    app.insert_resource(generated)
        .insert_resource(SceneNumbers {
            generate_s,
            ..default()
        })
        .insert_resource(*quality)
        .insert_resource(ViewOptions {
            error_px: quality.error_px,
            visible_flux: args.visible_flux,
            split: args.split,
            plain: args.plain,
        })
        .insert_resource(Models {
            files: args.models.clone(),
            loading: args.models.len(),
        })
        .insert_resource(FieldLodDebug {
            color_levels: args.levels,
            ..default()
        })
        .insert_resource(FieldLodAppConfig {
            cache_folder: cache_folder(),
            ..default()
        })
        // The flight starts when all levels are ready.
        .insert_resource(LodPriority::LoadingScreen)
        .add_plugins((
            FieldLodPlugin,
            FieldLodVisibleFluxPlugin,
            FieldLodDebugPlugin,
            sky::plugin,
            cameras::plugin,
            models::plugin,
        ))
        .add_systems(Startup, spawn)
        .add_systems(
            Update,
            choose_kinds.run_if(resource_exists_and_changed::<ViewOptions>),
        );
}

/// Generates the shapes and the ground's texture on all cores.
fn generate(quality: &Quality) -> Generated {
    std::thread::scope(|scope| {
        let ground = scope.spawn(|| ground_texture::paint(quality.ground_anisotropy));
        let shapes = shapes::generate_all(quality.ground_squares);
        let ground = ground.join().expect("the painter does not panic");
        Generated { shapes, ground }
    })
}

/// The folder of baked levels: beside the program, so that `cargo clean` removes it.
fn cache_folder() -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?;
    Some(program.parent()?.join("walkthrough-cache"))
}

fn spawn(world: &mut World) {
    let Some(generated) = world.remove_resource::<Generated>() else {
        return;
    };
    // All instances of a shape share one mesh and one material.
    let ground = world.resource_mut::<Assets<Image>>().add(generated.ground);
    let mut shapes = HashMap::new();
    for (id, shape) in generated.shapes {
        let triangles = shape.triangle_count();
        let (mesh, mean_color) = shape.into_mesh();
        // Without the box, Bevy computes the bounds of each of the thousands of instances.
        let bounds = mesh.compute_aabb().unwrap_or_default();
        let material = material(id, mean_color, &ground);
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
        shapes.insert(id, (mesh, materials.add(material), bounds, triangles));
    }

    let options = *world.resource::<ViewOptions>();
    for placed in layout::place_all(world.resource::<Quality>().vegetation) {
        let (mesh, material, bounds, triangles) = &shapes[&placed.shape];
        let mut numbers = world.resource_mut::<SceneNumbers>();
        numbers.instances += 1;
        numbers.source_triangles += triangles;
        world.spawn((
            Mesh3d(mesh.clone()),
            MeshMaterial3d(material.clone()),
            placed.transform,
            *bounds,
            NoAutoAabb,
            AutoLod::of_kind(options.kind_of(Some(placed.shape))),
            placed.shape,
        ));
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

impl ViewOptions {
    /// The kind of levels of a shape, or of a model without a shape. All cameras share the level of a whole mesh, so the
    /// split screen draws units instead.
    fn kind_of(&self, shape: Option<ShapeId>) -> LodKind {
        match (self, shape) {
            (Self { plain: true, .. }, _) => LodKind::Plain,
            (Self { split: true, .. }, _) => LodKind::Clusters,
            // Units would need several entities for each of the thousands of trees.
            (_, Some(ShapeId::Oak(_) | ShapeId::Pine(_) | ShapeId::Cypress)) => LodKind::WholeMesh,
            _ => LodKind::Auto,
        }
    }
}

/// Updates the kind of levels of every object when the split screen is switched on or off.
fn choose_kinds(
    options: Res<ViewOptions>,
    mut was_split: Local<bool>,
    mut objects: Query<(Option<&ShapeId>, &mut AutoLod)>,
) {
    if *was_split == options.split {
        return;
    }
    *was_split = options.split;
    for (shape, mut lod) in &mut objects {
        let kind = options.kind_of(shape.copied());
        if lod.kind != kind {
            lod.kind = kind;
        }
    }
}
