//! Apps without a renderer, with the same scene in each of the ways that it can be drawn.

use std::time::{Duration, Instant};

use bevy::asset::RenderAssetUsages;
use bevy::camera::RenderTarget;
use bevy::camera::visibility::VisibilityRange;
use bevy::light::CascadeShadowConfigBuilder;
use bevy::log::LogPlugin;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::render_resource::TextureFormat;
use bevy::render::settings::WgpuSettings;
use bevy::window::ExitCondition;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::SourceMesh;

/// How the scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    /// As Bevy does it.
    Full,
    /// Three levels by hand: one entity each, by distance.
    Ranges,
    /// By the plugin.
    Ours(LodKind),
}

/// A square of instances around a camera, which may walk.
pub(crate) struct Field {
    app: App,
    camera: Entity,
    step: u32,
}

/// Instances are this many of their radii apart.
const SPACING: f32 = 5.0;

impl Field {
    pub(crate) fn new(way: Way, rocks: &[SourceMesh], count: u32, sun: bool) -> Self {
        let mut app = new_app();
        let world = app.world_mut();
        let material = world.resource_mut::<Assets<StandardMaterial>>();
        let material = MeshMaterial3d(material.into_inner().add(StandardMaterial::default()));
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        let levels: Vec<_> = rocks
            .iter()
            .map(|rock| meshes.add(bevy_mesh(rock)))
            .collect();
        for pose in poses(count) {
            let one = |mesh: &Handle<Mesh>| (Mesh3d(mesh.clone()), material.clone(), pose);
            match way {
                Way::Full => {
                    world.spawn(one(&levels[0]));
                }
                Way::Ours(kind) => {
                    world.spawn((one(&levels[0]), AutoLod::of_kind(kind)));
                }
                Way::Ranges => {
                    for (level, range) in levels.iter().zip(ranges()) {
                        world.spawn((one(level), range));
                    }
                }
            }
        }
        if sun {
            world.spawn((
                DirectionalLight {
                    shadow_maps_enabled: true,
                    ..default()
                },
                CascadeShadowConfigBuilder::default().build(),
                Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y),
            ));
        }
        let camera = spawn_camera(world);
        let mut field = Self {
            app,
            camera,
            step: 0,
        };
        field.settle(if matches!(way, Way::Ours(_)) {
            count
        } else {
            0
        });
        field
    }

    fn settle(&mut self, ready: u32) {
        let deadline = Instant::now() + Duration::from_secs(120);
        let progress = |app: &App| *app.world().resource::<FieldLodProgress>();
        while progress(&self.app).ready + progress(&self.app).plain < ready {
            assert!(Instant::now() < deadline, "never ready");
            self.still();
        }
        for _ in 0..5 {
            self.still();
        }
    }

    /// A frame in which nothing moves.
    pub(crate) fn still(&mut self) {
        self.app.update();
    }

    /// A frame of a brisk walk: 1.8 m/s at 60 Hz, on a wide circle.
    pub(crate) fn walk(&mut self) {
        self.step += 1;
        let angle = self.step as f32 * 0.03 / 20.0;
        let eye = Vec3::new(20.0 * angle.cos(), 1.7, 20.0 * angle.sin());
        let ahead = Vec3::new(-angle.sin(), -0.05, angle.cos());
        let pose = Transform::from_translation(eye).looking_to(ahead, Vec3::Y);
        *self
            .app
            .world_mut()
            .get_mut::<Transform>(self.camera)
            .unwrap() = pose;
        self.app.update();
    }

    pub(crate) fn stats(&self) -> LodViewStats {
        *self.app.world().get::<LodViewStats>(self.camera).unwrap()
    }

    /// Bytes of all meshes: what the GPU gets.
    pub(crate) fn mesh_bytes(&self) -> usize {
        let bytes = |mesh: &Mesh| {
            let indices = mesh.get_index_buffer_bytes().map_or(0, <[u8]>::len);
            mesh.get_vertex_buffer_size() + indices
        };
        let meshes = self.app.world().resource::<Assets<Mesh>>();
        meshes.iter().map(|(_, mesh)| bytes(mesh)).sum()
    }

    pub(crate) fn entities(&mut self) -> usize {
        let world = self.app.world_mut();
        world.query::<&Mesh3d>().iter(world).len()
    }
}

fn new_app() -> App {
    let mut app = App::new();
    let plugins = DefaultPlugins
        .build()
        .disable::<LogPlugin>()
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
        .set(RenderPlugin {
            render_creation: WgpuSettings {
                backends: None,
                ..default()
            }
            .into(),
            ..default()
        });
    app.add_plugins((plugins, FieldLodPlugin));
    app.finish();
    app.cleanup();
    app
}

fn poses(count: u32) -> impl Iterator<Item = Transform> {
    let side = (count as f32).sqrt().ceil() as u32;
    (0..count).map(move |index| {
        let cell = Vec2::new((index % side) as f32, (index / side) as f32);
        let at = (cell - Vec2::splat(side as f32 * 0.5)) * SPACING;
        Transform::from_xyz(at.x, 0.0, at.y).with_rotation(Quat::from_rotation_y(index as f32))
    })
}

/// The distances at which a game would change the levels of a rock of radius one.
fn ranges() -> [VisibilityRange; 3] {
    [
        VisibilityRange::abrupt(0.0, 30.0),
        VisibilityRange::abrupt(30.0, 90.0),
        VisibilityRange::abrupt(90.0, f32::INFINITY),
    ]
}

fn spawn_camera(world: &mut World) -> Entity {
    let image = Image::new_target_texture(1920, 1080, TextureFormat::Rgba8UnormSrgb, None);
    let image = world.resource_mut::<Assets<Image>>().add(image);
    let pose = Transform::from_xyz(20.0, 1.7, 0.0).looking_to(Vec3::Z, Vec3::Y);
    let target = RenderTarget::Image(image.into());
    world.spawn((Camera3d::default(), target, pose)).id()
}

fn bevy_mesh(source: &SourceMesh) -> Mesh {
    let to_arrays = |values: &[Vec3]| values.iter().map(Vec3::to_array).collect::<Vec<_>>();
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, to_arrays(&source.positions))
    .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, to_arrays(&source.normals))
    .with_inserted_indices(Indices::U32(source.indices.clone()))
}
