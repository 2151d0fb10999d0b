//! The same scene drawn by each method.

use std::any::TypeId;
use std::collections::HashMap;

use bevy::camera::visibility::{NoCpuCulling, RenderLayers, VisibilityRange, VisibleEntities};
use bevy::light::CascadeShadowConfigBuilder;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::SourceMesh;
#[cfg(not(feature = "no_device"))]
use fieldlod_tests::apps::rendererless as plugins;
use fieldlod_tests::apps::{bevy_mesh, finish, run_until_ready, spawn_camera};
use fieldlod_tests::frame_times::FrameTimes;

#[cfg(feature = "no_device")]
use crate::no_device::plugins;

/// How the scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Method {
    /// As Bevy does it.
    Full,
    /// The same, culled on the GPU alone.
    FullNoCpuCulling,
    /// Three levels by hand: one entity each, by distance.
    Ranges,
    /// By the plugin.
    AutoLod(LodKind),
    /// By the plugin, with `FieldLodConfig::gpu_culling` off.
    AutoLodCpuCulling,
}

/// Whether a view sees the props.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Props {
    /// There are none.
    None,
    /// The camera and the sun see them.
    Seen,
    /// They are hidden.
    Hidden,
    /// They are on a layer that nothing sees.
    OnOtherLayer,
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
    /// `count` instances of the first of `rocks`, whose coarser levels by hand the others are.
    pub(crate) fn new(
        method: Method,
        rocks: &[SourceMesh],
        count: u32,
        props: Props,
        sun: bool,
    ) -> Self {
        let count = if props == Props::None { 0 } else { count };
        let mut app = App::new();
        app.add_plugins((plugins(), FieldLodPlugin));
        finish(&mut app);
        let world = app.world_mut();
        if method == Method::AutoLodCpuCulling {
            world.resource_mut::<FieldLodConfig>().gpu_culling = false;
        }
        spawn_rocks(world, method, rocks, count);
        if sun {
            spawn_sun(world);
        }
        let pose = Transform::from_xyz(20.0, 1.7, 0.0).looking_to(Vec3::Z, Vec3::Y);
        let camera = spawn_camera(world, UVec2::new(1920, 1080), pose);
        let has_plugin = matches!(method, Method::AutoLod(_) | Method::AutoLodCpuCulling);
        run_until_ready(&mut app, if has_plugin { count } else { 0 });
        hide_rocks(app.world_mut(), props);
        // What has come and gone settles.
        for _ in 0..5 {
            app.update();
        }
        Self {
            app,
            camera,
            step: 0,
        }
    }

    /// A frame in which nothing moves.
    pub(crate) fn still(&mut self) -> FrameTimes {
        FrameTimes::of_update(&mut self.app)
    }

    /// A frame of a brisk walk: 1.8 m/s at 60 Hz, on a wide circle.
    pub(crate) fn walk(&mut self) -> FrameTimes {
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
        FrameTimes::of_update(&mut self.app)
    }

    /// Goes back to where the walk begins.
    pub(crate) fn rewind(&mut self) {
        self.step = 0;
        self.walk();
    }

    /// What the camera draws, each with its mesh.
    pub(crate) fn visible(&self) -> Vec<(Entity, AssetId<Mesh>)> {
        let world = self.app.world();
        let visible = world.get::<VisibleEntities>(self.camera).unwrap();
        let visible = visible.get(TypeId::of::<Mesh3d>()).iter();
        visible
            .map(|&entity| (entity, world.get::<Mesh3d>(entity).unwrap().id()))
            .collect()
    }

    /// The mesh that each entity has, in the camera's view or not.
    pub(crate) fn levels(&mut self) -> HashMap<Entity, AssetId<Mesh>> {
        let world = self.app.world_mut();
        let mut meshes = world.query::<(Entity, &Mesh3d)>();
        let meshes = meshes.iter(world);
        meshes.map(|(entity, mesh)| (entity, mesh.id())).collect()
    }

    pub(crate) fn stats(&self) -> FieldLodViewStats {
        *self
            .app
            .world()
            .get::<FieldLodViewStats>(self.camera)
            .unwrap()
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
            Method::Full => {
                world.spawn(one(&levels[0]));
            }
            Method::FullNoCpuCulling => {
                world.spawn((one(&levels[0]), NoCpuCulling));
            }
            Method::AutoLodCpuCulling => {
                world.spawn((one(&levels[0]), AutoLod::default()));
            }
            Method::AutoLod(kind) => {
                world.spawn((one(&levels[0]), AutoLod::of_kind(kind)));
            }
            Method::Ranges => {
                for (level, range) in levels.iter().zip(ranges()) {
                    world.spawn((one(level), range));
                }
            }
        }
    }
}

fn hide_rocks(world: &mut World, props: Props) {
    let mut rocks = world.query_filtered::<Entity, With<Mesh3d>>();
    let rocks: Vec<Entity> = rocks.iter(world).collect();
    for rock in rocks {
        let mut rock = world.entity_mut(rock);
        match props {
            Props::None | Props::Seen => {}
            Props::Hidden => {
                rock.insert(Visibility::Hidden);
            }
            Props::OnOtherLayer => {
                rock.insert(RenderLayers::layer(1));
            }
        }
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

/// The distances at which a game would change the levels of a rock of radius one.
fn ranges() -> [VisibilityRange; 3] {
    [
        VisibilityRange::abrupt(0.0, 30.0),
        VisibilityRange::abrupt(30.0, 90.0),
        VisibilityRange::abrupt(90.0, f32::INFINITY),
    ]
}
