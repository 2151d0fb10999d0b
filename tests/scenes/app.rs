//! An app that draws a scene by one of the methods.

use std::any::TypeId;
use std::time::{Duration, Instant};

use bevy::anti_alias::taa::TemporalAntiAliasing;
use bevy::camera::primitives::{Aabb, Frustum};
use bevy::camera::visibility::{NoCpuCulling, VisibilityRange};
use bevy::color::palettes::css;
use bevy::light::CascadeShadowConfigBuilder;
use bevy::pbr::RenderMeshInstances;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::mesh::allocator::MeshAllocator;
use bevy::render::mesh::{RenderMesh, RenderMeshBufferInfo};
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{PipelineCache, PollType};
use bevy::render::renderer::RenderDevice;
use bevy::render::sync_world::RenderEntity;
use bevy::render::view::{Msaa, RenderVisibleEntities, RenderVisibleEntitiesClass};
use bevy_fieldlod::prelude::*;
use image::RgbaImage;

use super::forest::{WindMaterial, wind_material, wind_plugin};
use super::levels::source_mesh;
use super::{Paint, Place, Scene};
use crate::frame_times::{FrameTimes, drop_commands};
use crate::stage::{Eye, Stage};

/// How a scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// At full detail, with [`NoCpuCulling`] or without.
    Full {
        /// Whether the GPU alone culls.
        gpu: bool,
    },
    /// With three hand-made levels and [`VisibilityRange`]s, which the GPU evaluates for entities with
    /// [`NoCpuCulling`].
    Ranges {
        /// Whether the GPU alone culls.
        gpu: bool,
    },
    /// By the plugin.
    AutoLod {
        /// The kind of levels.
        kind: LodKind,
        /// The error threshold of the camera, in pixels.
        error_px: f32,
    },
}

impl Method {
    /// The plugin's default at an error in pixels.
    #[must_use]
    pub fn auto_lod(error_px: f32) -> Self {
        let kind = LodKind::Auto;
        Self::AutoLod { kind, error_px }
    }

    fn has_no_cpu_culling(self) -> bool {
        matches!(self, Self::Full { gpu: true } | Self::Ranges { gpu: true })
    }
}

/// A scene in an app of its own.
#[derive(Debug)]
pub struct SceneApp {
    stage: Stage,
    eye: Eye,
    path: fn(f32) -> Transform,
    /// Frames of a pose before its picture.
    frames_before: u8,
}

/// The distances of a hand-made level before they are scaled.
#[derive(Component)]
struct Distances([f32; 2]);

/// Moves an object along its drive. At the end, it starts again.
#[derive(Component)]
struct Drives {
    from: Vec3,
    way: Vec3,
}

impl SceneApp {
    /// Adds the scene to `stage`, which must be unfinished. With the plugin, the camera is inactive until
    /// [`Self::wait_for_levels`]. Otherwise it is active at once: Bevy 0.19.1 never draws entities with
    /// [`NoCpuCulling`] by a camera that becomes active after they were spawned.
    #[must_use]
    pub fn new(
        mut stage: Stage,
        scene: &Scene,
        method: Method,
        size_px: UVec2,
        has_shadows: bool,
    ) -> Self {
        let mut settings = FieldLodCamera::default();
        if let Method::AutoLod { error_px, .. } = method {
            stage.app.add_plugins(FieldLodPlugin);
            stage.app.insert_resource(FieldLodAppConfig {
                cache_folder: Some(scene.cache().into()),
                ..default()
            });
            settings = FieldLodCamera::with_error_px(error_px);
        }
        stage
            .app
            .add_plugins(wind_plugin)
            .init_resource::<Traffic>()
            .add_systems(Update, drive);
        stage.finish();
        // The wind stands still, so that pictures can be compared.
        let world = stage.app.world_mut();
        world.resource_mut::<Time<Virtual>>().pause();
        Spawner::new(world, scene, method).spawn(scene);
        spawn_sun(world, has_shadows);
        let pose = (scene.path)(0.0);
        let eye = stage.add_eye_of_size(size_px, pose, css::SKY_BLUE.into(), settings);
        let path = scene.path;
        let mut app = Self {
            stage,
            eye,
            path,
            frames_before: 0,
        };
        app.scale_ranges(scene.range_scale);
        if let Method::AutoLod { .. } = method {
            app.set_active(false);
        }
        app
    }

    /// Activates or deactivates the camera.
    ///
    /// # Panics
    /// If the camera was despawned.
    pub fn set_active(&mut self, is_active: bool) {
        let mut camera = self.stage.app.world_mut().entity_mut(self.eye.entity);
        camera.get_mut::<Camera>().expect("a camera").is_active = is_active;
    }

    /// Runs frames until all levels are there, and starts to draw.
    pub fn wait_for_levels(&mut self) {
        let deadline = Instant::now() + Duration::from_secs(600);
        (0..2).for_each(|_| self.stage.app.update());
        while !self.has_levels() {
            assert!(Instant::now() < deadline, "levels are not ready");
            self.stage.app.update();
            // Bakes have a low priority: frames without a pause would leave them no time.
            std::thread::sleep(Duration::from_millis(50));
        }
        self.set_active(true);
        (0..3).for_each(|_| self.stage.app.update());
    }

    /// Whether no mesh waits for levels.
    #[must_use]
    pub fn has_levels(&self) -> bool {
        let progress = self.stage.app.world().get_resource::<FieldLodProgress>();
        progress.is_none_or(|progress| progress.waiting == 0)
    }

    /// Drops the commands of all further frames, see [`drop_commands`].
    pub fn drop_commands(&mut self) {
        drop_commands(&mut self.stage.app);
    }

    /// Whether all pipelines are compiled.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let render = self.stage.app.sub_app(RenderApp).world();
        let pipelines = render.resource::<PipelineCache>();
        pipelines.waiting_pipelines().next().is_none()
    }

    /// The world of the game.
    pub fn world_mut(&mut self) -> &mut World {
        self.stage.app.world_mut()
    }

    /// Multiplies the distances of hand-made levels.
    pub fn scale_ranges(&mut self, scale: f32) {
        let world = self.stage.app.world_mut();
        let mut ranges = world.query::<(&Distances, &mut VisibilityRange)>();
        for (distances, mut range) in ranges.iter_mut(world) {
            let [from, to] = distances.0.map(|distance| distance * scale);
            *range = VisibilityRange::abrupt(from, to);
        }
    }

    /// Turns the sun's shadows on or off.
    pub fn set_shadows(&mut self, has_shadows: bool) {
        let world = self.stage.app.world_mut();
        let mut suns = world.query::<&mut DirectionalLight>();
        suns.iter_mut(world)
            .for_each(|mut sun| sun.shadow_maps_enabled = has_shadows);
    }

    /// Sets the samples per pixel.
    pub fn set_msaa(&mut self, msaa: Msaa) {
        self.stage.insert(self.eye.entity, msaa);
    }

    /// Draws with temporal antialiasing, each picture after `frames` frames of the same pose.
    pub fn set_taa(&mut self, frames: u8) {
        self.frames_before = frames;
        let taa = (Msaa::Off, TemporalAntiAliasing::default());
        self.stage.insert(self.eye.entity, taa);
    }

    /// Sets the error threshold of the plugin, in pixels.
    pub fn set_error_px(&mut self, error_px: f32) {
        let settings = FieldLodCamera::with_error_px(error_px);
        self.stage.insert(self.eye.entity, settings);
    }

    /// Sets whether the camera of the plugin weighs errors by the visible shares of objects.
    pub fn set_visible_flux(&mut self, is_on: bool) {
        let mut camera = self.stage.app.world_mut().entity_mut(self.eye.entity);
        if is_on {
            camera.insert(FieldLodVisibleFlux);
        } else {
            camera.remove::<FieldLodVisibleFlux>();
        }
    }

    /// Moves the camera to its place after a number of metres.
    pub fn go_to(&mut self, metres: f32) {
        let pose = (self.path)(metres);
        self.stage.insert(self.eye.entity, pose);
    }

    /// One frame, without a wait for the GPU.
    pub fn frame(&mut self) -> FrameTimes {
        FrameTimes::of_update(&mut self.stage.app)
    }

    /// Whether the renderer has stopped after an error.
    #[must_use]
    pub fn has_stopped(&self) -> bool {
        self.stage.app.should_exit().is_some()
    }

    /// One frame. Returns its time with the wait for the GPU, and its parts on the CPU.
    pub fn draw(&mut self) -> (Duration, FrameTimes) {
        let start = Instant::now();
        let parts = self.frame();
        let device = self.stage.app.world().resource::<RenderDevice>();
        let done = device.poll(PollType::wait_indefinitely());
        done.expect("the graphics device is not lost");
        (start.elapsed(), parts)
    }

    /// A picture from a pose, and the [triangles](Self::triangles) of its frame. Cars stand at their starts.
    pub fn picture_and_triangles(&mut self, pose: Transform) -> (RgbaImage, u64) {
        self.stage.insert(self.eye.entity, pose);
        self.stage.app.world_mut().resource_mut::<Traffic>().stands = true;
        (0..self.frames_before).for_each(|_| self.stage.app.update());
        let pending = self.stage.draw(&self.eye);
        self.stage.app.world_mut().resource_mut::<Traffic>().stands = false;
        let triangles = self.triangles();
        // The picture arrives some frames later.
        self.look_up();
        (self.stage.wait(&pending), triangles)
    }

    /// Turns the camera to the sky, which takes a software adapter no time.
    ///
    /// # Panics
    /// If the camera was despawned.
    pub fn look_up(&mut self) {
        let mut camera = self.stage.app.world_mut().entity_mut(self.eye.entity);
        let mut pose = camera.get_mut::<Transform>().expect("a camera");
        *pose = pose.looking_to(Vec3::Y, Vec3::X);
    }

    /// Triangles that the camera draws: of all meshes in its lists, in its frustum and in their ranges. Shadows are not
    /// counted.
    #[must_use]
    pub fn triangles(&self) -> u64 {
        let main = self.stage.app.world();
        let render = self.stage.app.sub_app(RenderApp).world();
        let camera = main.entity(self.eye.entity);
        let (Some(view), Some(frustum)) = (camera.get::<RenderEntity>(), camera.get::<Frustum>())
        else {
            return 0;
        };
        let eye = camera
            .get::<GlobalTransform>()
            .map_or(Vec3::ZERO, GlobalTransform::translation);
        let (instances, meshes) = (
            render.resource::<RenderMeshInstances>(),
            render.resource::<RenderAssets<RenderMesh>>(),
        );
        let is_drawn = |entity: Entity| {
            let Ok(entity) = main.get_entity(entity) else {
                return false;
            };
            let (Some(at), Some(aabb)) = (entity.get::<GlobalTransform>(), entity.get::<Aabb>())
            else {
                return false;
            };
            let range = entity.get::<VisibilityRange>();
            let distance = at.translation().distance(eye);
            range.is_none_or(|range| range.is_visible_at_all(distance))
                && frustum.intersects_obb(aabb, &at.affine(), true, false)
        };
        let lists = render.get::<RenderVisibleEntities>(view.id());
        let lists = lists.and_then(|lists| lists.classes.get(&TypeId::of::<Mesh3d>()));
        let listed = lists
            .into_iter()
            .flat_map(RenderVisibleEntitiesClass::iter_visible);
        let drawn = listed.filter(|(_, main)| is_drawn(main.id()));
        let mesh = drawn.filter_map(|(_, main)| meshes.get(instances.mesh_asset_id(*main)?));
        mesh.map(|mesh| match mesh.buffer_info {
            RenderMeshBufferInfo::Indexed { count, .. } => u64::from(count) / 3,
            RenderMeshBufferInfo::NonIndexed => u64::from(mesh.vertex_count) / 3,
        })
        .sum()
    }

    /// The number of entities of the scene, with the units of the plugin.
    #[must_use]
    pub fn entities(&self) -> usize {
        let entities = self.stage.app.world().iter_entities();
        // The camera and the sun are not counted.
        entities
            .filter(EntityRef::contains::<GlobalTransform>)
            .count()
            - 2
    }

    /// Bytes of the renderer's buffers for vertices and indices.
    #[must_use]
    pub fn mesh_bytes(&self) -> u64 {
        let app = self.stage.app.sub_app(RenderApp);
        app.world().resource::<MeshAllocator>().slabs_size()
    }

    /// The name of the adapter.
    #[must_use]
    pub fn adapter(&self) -> String {
        let world = self.stage.app.world();
        world
            .resource::<bevy::render::renderer::RenderAdapterInfo>()
            .name
            .clone()
    }
}

fn spawn_sun(world: &mut World, has_shadows: bool) {
    world.spawn((
        DirectionalLight {
            illuminance: 6_000.0,
            shadow_maps_enabled: has_shadows,
            ..default()
        },
        CascadeShadowConfigBuilder::default().build(),
        Transform::default().looking_to(Vec3::new(-1.0, -0.7, -0.5), Vec3::Y),
    ));
}

/// Frames since the cars started. In pictures they stand at their starts, so that pictures can be compared.
#[derive(Resource, Default)]
struct Traffic {
    frame: u32,
    stands: bool,
}

/// Moves all cars by a frame of a sixtieth of a second at 10 m/s.
fn drive(mut traffic: ResMut<Traffic>, mut cars: Query<(&Drives, &mut Transform)>) {
    traffic.frame = if traffic.stands { 0 } else { traffic.frame + 1 };
    for (car, mut at) in &mut cars {
        let share = traffic.frame as f32 / 6.0 / car.way.length();
        at.translation = car.from + car.way * share.fract();
    }
}

/// The meshes and materials of a scene.
struct Spawner<'a> {
    world: &'a mut World,
    method: Method,
    /// The meshes of each prop.
    props: Vec<Vec<Drawn>>,
    paints: Vec<Material>,
}

/// A mesh of a prop, with its distances if it is a hand-made level.
struct Drawn {
    mesh: Handle<Mesh>,
    paint: usize,
    distances: Option<[f32; 2]>,
}

enum Material {
    Plain(Handle<StandardMaterial>),
    Wind(Handle<WindMaterial>),
}

impl<'a> Spawner<'a> {
    fn new(world: &'a mut World, scene: &Scene, method: Method) -> Self {
        let paint = |paint: &Paint| match *paint {
            Paint::Plain(color) => {
                let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
                Material::Plain(materials.add(StandardMaterial::from(color)))
            }
            Paint::Leaves => Material::Wind(wind_material(world, true)),
            Paint::Bark => Material::Wind(wind_material(world, false)),
        };
        let paints = scene.paints.iter().map(paint).collect();
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        let mut drawn = |mesh: Mesh, paint, distances| Drawn {
            mesh: meshes.add(mesh),
            paint,
            distances,
        };
        let mut props = Vec::new();
        for (index, prop) in scene.props.iter().enumerate() {
            let levels = matches!(method, Method::Ranges { .. }).then(|| &scene.levels()[index]);
            let near = levels.map(|levels| [0.0, levels.source_to]);
            let sources = prop.parts.iter();
            let mut all: Vec<Drawn> = sources
                .map(|part| drawn(source_mesh(&part.source), part.paint, near))
                .collect();
            for level in levels.iter().flat_map(|levels| &levels.coarser) {
                let distances = Some([level.from, level.to]);
                all.push(drawn(level.mesh.clone(), level.paint, distances));
            }
            props.push(all);
        }
        Self {
            world,
            method,
            props,
            paints,
        }
    }

    fn spawn(&mut self, scene: &Scene) {
        if scene.is_flat {
            for place in scene.blocks.iter().flat_map(|block| &block.places) {
                self.spawn_meshes(place.prop, None, place.at);
            }
            return;
        }
        let root = self.spawn_node(None, Transform::IDENTITY);
        if let Method::AutoLod { kind, .. } = self.method {
            self.world.entity_mut(root).insert(AutoLod::of_kind(kind));
        }
        for block in &scene.blocks {
            let node = self.spawn_node(Some(root), Transform::from_translation(block.at));
            for place in &block.places {
                if scene.props[place.prop].has_node {
                    self.spawn_with_node(node, place);
                } else {
                    self.spawn_meshes(place.prop, Some(node), place.at);
                }
            }
        }
    }

    fn spawn_node(&mut self, parent: Option<Entity>, at: Transform) -> Entity {
        let mut node = self.world.spawn((at, Visibility::default()));
        if let Some(parent) = parent {
            node.insert(ChildOf(parent));
        }
        node.id()
    }

    fn spawn_with_node(&mut self, block: Entity, place: &Place) {
        let node = self.spawn_node(Some(block), place.at);
        if let Some(way) = place.way {
            let from = place.at.translation;
            self.world.entity_mut(node).insert(Drives { from, way });
        }
        self.spawn_meshes(place.prop, Some(node), Transform::IDENTITY);
    }

    fn spawn_meshes(&mut self, prop: usize, parent: Option<Entity>, at: Transform) {
        for drawn in &self.props[prop] {
            let mut entity = self.world.spawn((Mesh3d(drawn.mesh.clone()), at));
            match &self.paints[drawn.paint] {
                Material::Plain(material) => entity.insert(MeshMaterial3d(material.clone())),
                Material::Wind(material) => entity.insert(MeshMaterial3d(material.clone())),
            };
            if let Some([from, to]) = drawn.distances {
                let range = VisibilityRange::abrupt(from, to);
                entity.insert((Distances([from, to]), range));
            }
            if self.method.has_no_cpu_culling() {
                entity.insert(NoCpuCulling);
            }
            if let Some(parent) = parent {
                entity.insert(ChildOf(parent));
            } else if let Method::AutoLod { kind, .. } = self.method {
                entity.insert(AutoLod::of_kind(kind));
            }
        }
    }
}
