//! A field of props, drawn by one of the methods.

use std::collections::HashMap;

use bevy::camera::visibility::{NoCpuCulling, VisibilityRange};
use bevy::light::CascadeShadowConfigBuilder;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::SourceMesh;
use fieldlod_tests::apps::{bevy_mesh, finish, run_until_ready, spawn_camera};
use fieldlod_tests::frame_times::FrameTimes;

use crate::no_device::plugins;

/// How the scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Method {
    /// At full detail.
    Full,
    /// At full detail, culled on the GPU alone.
    FullNoCpuCulling,
    /// Three hand-made levels: one entity each, with a range of distances.
    Ranges,
    /// By the plugin.
    AutoLod(LodKind),
    /// By the plugin without `AdvancedAppConfig::gpu_culling`.
    AutoLodCpuCulling,
}

/// A square of instances around a camera.
pub(crate) struct Field {
    app: App,
    camera: Entity,
    step: u32,
}

/// Distance of instances, in radii.
const SPACING: f32 = 5.0;

impl Field {
    /// `count` instances of the first of `rocks`. The others are its hand-made levels.
    pub(crate) fn new(method: Method, rocks: &[SourceMesh], count: u32, has_sun: bool) -> Self {
        let mut app = App::new();
        app.add_plugins((plugins(), FieldLodPlugin));
        finish(&mut app);
        let world = app.world_mut();
        if method == Method::AutoLodCpuCulling {
            world
                .resource_mut::<FieldLodAppConfig>()
                .advanced
                .gpu_culling = false;
        }
        spawn_rocks(world, method, rocks, count);
        if has_sun {
            spawn_sun(world);
        }
        let pose = Transform::from_xyz(20.0, 1.7, 0.0).looking_to(Vec3::Z, Vec3::Y);
        let camera = spawn_camera(world, UVec2::new(1920, 1080), pose);
        let has_plugin = matches!(method, Method::AutoLod(_) | Method::AutoLodCpuCulling);
        run_until_ready(&mut app, if has_plugin { count } else { 0 });
        Self {
            app,
            camera,
            step: 0,
        }
    }

    /// A frame without motion.
    pub(crate) fn still(&mut self) -> FrameTimes {
        FrameTimes::of_update(&mut self.app)
    }

    /// A frame of a walk at 1.8 m/s and 60 Hz, on a wide circle.
    pub(crate) fn walk(&mut self) -> FrameTimes {
        self.step += 1;
        let angle = self.step as f32 * 0.03 / 20.0;
        let eye = Vec3::new(20.0 * angle.cos(), 1.7, 20.0 * angle.sin());
        let ahead = Vec3::new(-angle.sin(), -0.05, angle.cos());
        let pose = Transform::from_translation(eye).looking_to(ahead, Vec3::Y);
        self.app.world_mut().entity_mut(self.camera).insert(pose);
        FrameTimes::of_update(&mut self.app)
    }

    /// Returns to the start of the walk.
    pub(crate) fn rewind(&mut self) {
        self.step = 0;
        self.walk();
    }

    /// The current mesh of each entity.
    pub(crate) fn levels(&mut self) -> HashMap<Entity, AssetId<Mesh>> {
        let world = self.app.world_mut();
        let mut meshes = world.query::<(Entity, &Mesh3d)>();
        let meshes = meshes.iter(world);
        meshes.map(|(entity, mesh)| (entity, mesh.id())).collect()
    }

    pub(crate) fn stats(&self) -> FieldLodViewStats {
        let stats = self.app.world().get::<FieldLodViewStats>(self.camera);
        stats.copied().unwrap_or_default()
    }
}

fn spawn_rocks(world: &mut World, method: Method, rocks: &[SourceMesh], count: u32) {
    let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
    let material = MeshMaterial3d(materials.add(StandardMaterial::default()));
    let mut meshes = world.resource_mut::<Assets<Mesh>>();
    let levels: Vec<_> = rocks
        .iter()
        .map(|rock| meshes.add(bevy_mesh(rock)))
        .collect();
    for pose in poses(count) {
        let one = |mesh: &Handle<Mesh>| (Mesh3d(mesh.clone()), material.clone(), pose);
        match method {
            Method::Full => world.spawn(one(&levels[0])),
            Method::FullNoCpuCulling => world.spawn((one(&levels[0]), NoCpuCulling)),
            Method::AutoLodCpuCulling => world.spawn((one(&levels[0]), AutoLod::default())),
            Method::AutoLod(kind) => world.spawn((one(&levels[0]), AutoLod::of_kind(kind))),
            Method::Ranges => {
                let levels = levels.iter().zip(ranges());
                let levels: Vec<_> = levels.map(|(mesh, range)| (one(mesh), range)).collect();
                world.spawn_batch(levels);
                continue;
            }
        };
    }
}

fn spawn_sun(world: &mut World) {
    world.spawn((
        DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        },
        CascadeShadowConfigBuilder::default().build(),
        Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y),
    ));
}

fn poses(count: u32) -> impl Iterator<Item = Transform> {
    let side = (count as f32).sqrt().ceil() as u32;
    (0..count).map(move |index| {
        let cell = Vec2::new((index % side) as f32, (index / side) as f32);
        let at = (cell - Vec2::splat(side as f32 * 0.5)) * SPACING;
        Transform::from_xyz(at.x, 0.0, at.y).with_rotation(Quat::from_rotation_y(index as f32))
    })
}

/// Typical distances of hand-made levels of a rock of radius one.
fn ranges() -> [VisibilityRange; 3] {
    [
        VisibilityRange::abrupt(0.0, 30.0),
        VisibilityRange::abrupt(30.0, 90.0),
        VisibilityRange::abrupt(90.0, f32::INFINITY),
    ]
}
