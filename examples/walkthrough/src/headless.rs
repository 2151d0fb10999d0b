//! Selection along the path without a renderer: what a machine without any graphics adapter runs.

use std::path::Path;
use std::time::{Duration, Instant};

use bevy_fieldlod::FieldLodSettings;
use camera_field::Camera;
use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, import_gltf};
use fieldlod_hierarchy::{Hierarchy, Sphere, Unit};
use fieldlod_select::{Cut, InstanceView, LodSettings, View, select};
use glam::{Affine3A, Mat4, Vec2, Vec3};

use crate::args::Args;
use crate::cameras::NEAR_IN_M;
use crate::path::{CameraPath, Pose};
use crate::report::{self, FrameNumbers, SceneNumbers};
use crate::scene::{self, Placed};
use crate::shapes::{self, Shape, ShapeId};

/// A placed hierarchy with the memory of its cuts.
struct Instance<'a> {
    hierarchy: &'a Hierarchy,
    world_from_local: Affine3A,
    cut: Cut,
}

/// Bakes the scene, selects along the path, prints the summary.
pub(crate) fn run(args: &Args) -> Result<(), String> {
    let frames = args.frames()?;
    let start = Instant::now();
    let shapes = shapes::generate_all();
    let generation_time = start.elapsed();
    let start = Instant::now();
    let (hierarchies, placed) = bake_scene(shapes)?;
    let guests = bake_guests(&args.models);
    let bake_time = start.elapsed();

    let own = placed
        .iter()
        .map(|(index, placed)| (&hierarchies[*index], *placed));
    let guest = guests.iter().map(|(hierarchy, place)| (hierarchy, *place));
    let mut instances: Vec<_> = own.chain(guest).map(instance).collect();
    let numbers = SceneNumbers {
        adapter: None,
        instances: instances.len() as u64,
        source_triangles: instances
            .iter()
            .map(|i| i.hierarchy.source_triangle_count())
            .sum(),
        generation_time,
        bake_time,
    };

    // As the plugin selects.
    let settings = FieldLodSettings::with_error_px(args.error_px).selection(true);
    let path = CameraPath::new();
    let along_the_path = frames.into_iter().map(|(_, round)| {
        let pose = path.pose(round);
        let view = View::new(camera(args, &pose)?, &pose.world_from_view());
        Ok(select_frame(&mut instances, &view, &settings))
    });
    let frames = along_the_path.collect::<Result<Vec<_>, String>>()?;
    report::print(args, &numbers, &frames);
    Ok(())
}

fn camera(args: &Args, pose: &Pose) -> Result<Camera, String> {
    let size = Vec2::new(args.size.width as f32, args.size.height as f32);
    let projection =
        Mat4::perspective_infinite_reverse_rh(pose.fov_in_rad, size.x / size.y, NEAR_IN_M);
    Camera::from_projection(&projection, size).map_err(|fault| fault.to_string())
}

/// The hierarchies of all shapes, and for each instance the index of its hierarchy and its place.
fn bake_scene(
    shapes: Vec<(ShapeId, Shape)>,
) -> Result<(Vec<Hierarchy>, Vec<(usize, Affine3A)>), String> {
    eprintln!("walkthrough: baking the scene");
    let index_of = |placed: &Placed| {
        let index = shapes.iter().position(|(id, _)| *id == placed.shape);
        index.expect("every shape has been generated")
    };
    let placed = scene::layout();
    let placed = placed.iter().map(|p| (index_of(p), p.world_from_local()));
    let placed = placed.collect();
    let bake = |(id, shape): (_, Shape)| {
        let mesh = source_mesh(shape);
        bake_mesh(&mesh, &BakeConfig::default()).map_err(|fault| format!("{id:?}: {fault}"))
    };
    let hierarchies = shapes.into_iter().map(bake).collect::<Result<_, _>>()?;
    Ok((hierarchies, placed))
}

fn source_mesh(shape: Shape) -> SourceMesh {
    SourceMesh {
        positions: shape.positions,
        normals: shape.normals,
        uvs: shape.uvs,
        indices: shape.indices,
    }
}

/// The models named on the command line, at their spots. Each primitive stands on its own there:
/// the nodes of the file are not looked at.
fn bake_guests(models: &[std::path::PathBuf]) -> Vec<(Hierarchy, Affine3A)> {
    let mut guests = Vec::new();
    for (model, spot) in models.iter().zip(scene::guest_spots()) {
        match bake_guest(model) {
            Ok(hierarchies) => guests.extend(hierarchies.into_iter().map(|hierarchy| {
                let place = place_guest(&hierarchy, &spot);
                (hierarchy, place)
            })),
            Err(fault) => eprintln!("walkthrough: {}: {fault}", model.display()),
        }
    }
    guests
}

fn bake_guest(model: &Path) -> Result<Vec<Hierarchy>, String> {
    let import = import_gltf(model).map_err(|fault| fault.to_string())?;
    let bake = |primitive: &fieldlod_bake::ImportedPrimitive| {
        bake_mesh(&primitive.mesh, &BakeConfig::default()).map_err(|fault| fault.to_string())
    };
    import.primitives.iter().map(bake).collect()
}

fn place_guest(hierarchy: &Hierarchy, spot: &Placed) -> Affine3A {
    let Some(bounds) = hierarchy.aabb() else {
        return spot.world_from_local();
    };
    let fit = scene::fit_guest(bounds.min, bounds.max);
    spot.world_from_local() * fit
}

fn instance((hierarchy, world_from_local): (&Hierarchy, Affine3A)) -> Instance<'_> {
    Instance {
        hierarchy,
        world_from_local,
        cut: Cut::default(),
    }
}

fn select_frame(instances: &mut [Instance], view: &View, settings: &LodSettings) -> FrameNumbers {
    let start = Instant::now();
    for Instance {
        hierarchy,
        world_from_local,
        cut,
    } in &mut *instances
    {
        select(hierarchy, world_from_local, view, settings, cut);
    }
    count_visible(instances, view, start.elapsed())
}

/// Counts what is in the field of view, of the cuts and of the source meshes.
fn count_visible(instances: &[Instance], view: &View, selection_time: Duration) -> FrameNumbers {
    let mut numbers = FrameNumbers {
        selection_time,
        ..FrameNumbers::default()
    };
    for instance in instances {
        let in_view = InstanceView::new(view, &instance.world_from_local);
        let visible = |unit: &Unit| {
            let sphere = in_view.sphere_in_camera(&sphere_around(unit));
            view.camera().touches_sphere(sphere.center, sphere.radius)
        };
        for unit in instance.hierarchy.units.iter().filter(|unit| visible(unit)) {
            let triangles = u64::from(unit.triangle_count);
            if instance.cut.draws(unit) {
                numbers.triangles_drawn += triangles;
                numbers.units_drawn += 1;
            }
            if unit.producer().is_none() {
                numbers.triangles_full += triangles;
            }
        }
    }
    numbers
}

fn sphere_around(unit: &Unit) -> Sphere {
    let [min, max]: [Vec3; 2] = [unit.aabb.min, unit.aabb.max];
    Sphere {
        center: (min + max) * 0.5,
        radius: min.distance(max) * 0.5,
    }
}
