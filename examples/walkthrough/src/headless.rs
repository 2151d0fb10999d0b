//! Selection along the path without a renderer: what a machine without any graphics adapter runs.

use std::collections::HashMap;
use std::path::Path;
use std::time::{Duration, Instant};

use bevy_fieldlod::{FieldLodConfig, FieldLodSettings, LodKind};
use camera_field::Camera;
use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, import_gltf};
use fieldlod_hierarchy::{Hierarchy, Sphere, Unit};
use fieldlod_select::{InstanceId, InstanceView, MeshId, Scene, Selector, View, whole_mesh_levels};
use glam::{Affine3A, Mat4, Vec2, Vec3};

use crate::args::Args;
use crate::cameras::NEAR_IN_M;
use crate::path::{CameraPath, Pose};
use crate::report::{self, FrameNumbers, SceneNumbers};
use crate::scene::{self, Placed};
use crate::shapes::{self, Shape, ShapeId};
use crate::stage;

/// What the plugin keeps of the scene when it selects.
#[derive(Default)]
struct World {
    scene: Scene,
    hierarchies: Vec<(Hierarchy, MeshId)>,
    instances: Vec<Instance>,
}

/// A placed hierarchy.
struct Instance {
    id: InstanceId,
    /// Its place in the list of hierarchies.
    hierarchy: usize,
    world_from_local: Affine3A,
}

/// Bakes the scene, selects along the path, prints the summary.
pub(crate) fn run(args: &Args) -> Result<(), String> {
    let frames = args.frames()?;
    let start = Instant::now();
    let shapes = shapes::generate_all();
    let generation_time = start.elapsed();
    let start = Instant::now();
    let mut world = World::default();
    world.build(shapes)?;
    world.add_guests(&args.models);
    world.scene.update();
    let numbers = world.numbers(generation_time, start.elapsed());

    // As the plugin selects.
    let settings = FieldLodSettings::with_error_px(args.error_px).to_lod_settings(true);
    let path = CameraPath::new();
    let mut selector = Selector::default();
    let along_the_path = frames.into_iter().map(|(_, round)| {
        let pose = path.pose(round);
        let view = View::new(camera(args, &pose)?, &pose.world_from_view());
        let start = Instant::now();
        selector.select(&world.scene, &view, &settings);
        let selection_time = start.elapsed();
        Ok(world.count_visible(&selector, &view, selection_time))
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

impl World {
    /// Bakes all shapes and places their instances.
    fn build(&mut self, shapes: Vec<(ShapeId, Shape)>) -> Result<(), String> {
        eprintln!("walkthrough: baking the scene");
        let mut index_of = HashMap::new();
        for (id, shape) in shapes {
            let baked = bake_mesh(&source_mesh(shape), &BakeConfig::default());
            let baked = baked.map_err(|fault| format!("{id:?}: {fault}"))?;
            index_of.insert(id, self.add_mesh(baked, stage::lod_kind(id, false)));
        }
        for placed in scene::layout() {
            self.add_instance(index_of[&placed.shape], placed.world_from_local());
        }
        Ok(())
    }

    /// Adds the models named on the command line, at their spots. Each primitive stands on its own
    /// there: the nodes of the file are not looked at.
    fn add_guests(&mut self, models: &[std::path::PathBuf]) {
        for (model, spot) in models.iter().zip(scene::guest_spots()) {
            match bake_guest(model) {
                Ok(hierarchies) => {
                    for hierarchy in hierarchies {
                        let place = place_guest(&hierarchy, &spot);
                        let index = self.add_mesh(hierarchy, LodKind::Auto);
                        self.add_instance(index, place);
                    }
                }
                Err(fault) => eprintln!("walkthrough: {}: {fault}", model.display()),
            }
        }
    }

    /// Adds a mesh, to be exchanged as a whole or cut into units as the plugin would.
    fn add_mesh(&mut self, baked: Hierarchy, kind: LodKind) -> usize {
        let triangles = baked.source_triangle_count() as usize;
        let whole_mesh = match FieldLodConfig::default().kind_for(kind, triangles) {
            LodKind::WholeMesh => whole_mesh_levels(&baked),
            _ => None,
        };
        let hierarchy = whole_mesh.unwrap_or(baked);
        let id = self.scene.add_mesh(&hierarchy);
        self.hierarchies.push((hierarchy, id));
        self.hierarchies.len() - 1
    }

    fn add_instance(&mut self, hierarchy: usize, world_from_local: Affine3A) {
        let mesh = self.hierarchies[hierarchy].1;
        let id = self.scene.add_instance(mesh, world_from_local, 1.0);
        self.instances.push(Instance {
            id,
            hierarchy,
            world_from_local,
        });
    }

    fn hierarchy(&self, instance: &Instance) -> &Hierarchy {
        &self.hierarchies[instance.hierarchy].0
    }

    fn numbers(&self, generation_time: Duration, bake_time: Duration) -> SceneNumbers {
        let triangles = |i| self.hierarchy(i).source_triangle_count();
        SceneNumbers {
            adapter: None,
            instances: self.instances.len() as u64,
            source_triangles: self.instances.iter().map(triangles).sum(),
            generation_time,
            bake_time,
        }
    }

    /// Counts what is in the field of view, of the cuts and of the source meshes.
    fn count_visible(
        &self,
        selector: &Selector,
        view: &View,
        selection_time: Duration,
    ) -> FrameNumbers {
        let mut numbers = FrameNumbers {
            selection_time,
            ..FrameNumbers::default()
        };
        for instance in &self.instances {
            let hierarchy = self.hierarchy(instance);
            let in_view = InstanceView::new(view, &instance.world_from_local);
            let visible = |unit: &&Unit| {
                let sphere = in_view.sphere_in_camera(&sphere_around(unit));
                view.camera().touches_sphere(sphere.center, sphere.radius)
            };
            let drawn = selector.units(&self.scene, instance.id).iter();
            let drawn = drawn.map(|&unit| &hierarchy.units[unit as usize]);
            for unit in drawn.filter(visible) {
                numbers.triangles_drawn += u64::from(unit.triangle_count);
                numbers.units_drawn += 1;
            }
            let source = hierarchy.units.iter().filter(|u| u.producer().is_none());
            for unit in source.filter(visible) {
                numbers.triangles_full += u64::from(unit.triangle_count);
            }
        }
        numbers
    }
}

fn source_mesh(shape: Shape) -> SourceMesh {
    SourceMesh {
        positions: shape.positions,
        normals: shape.normals,
        uvs: shape.uvs,
        indices: shape.indices,
    }
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

fn sphere_around(unit: &Unit) -> Sphere {
    let [min, max]: [Vec3; 2] = [unit.aabb.min, unit.aabb.max];
    Sphere {
        center: (min + max) * 0.5,
        radius: min.distance(max) * 0.5,
    }
}
