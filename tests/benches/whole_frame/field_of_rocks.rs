//! Rocks in a field under a low sun, drawn by one of the methods.

use std::any::TypeId;
use std::collections::HashMap;
use std::time::{Duration, Instant};

use bevy::camera::visibility::{VisibilityRange, VisibleEntities};
use bevy::color::palettes::css;
use bevy::light::{CascadeShadowConfigBuilder, DirectionalLight};
use bevy::mesh::Indices;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::mesh::allocator::MeshAllocator;
use bevy::render::render_resource::PollType;
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice};
use bevy_fieldlod::prelude::*;
use fieldlod_tests::frame_times::FrameTimes;
use fieldlod_tests::stage::{Eye, Stage};
use image::RgbaImage;

use crate::levels::SHAPES;

const ROCKS: u32 = 45;
const SIZE_PX: UVec2 = UVec2::new(960, 540);
/// Distances of the coarser levels before scaling, in metres.
const SWITCH_AT_M: [f32; 2] = [10.0, 40.0];

/// How the rocks are drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Method {
    /// At full detail.
    Full,
    /// By the plugin at one pixel of error.
    AutoLod(LodKind),
    /// Three hand-made levels, with distances multiplied by `scale`.
    Ranges { scale: f32 },
}

/// The scene in an app of its own.
pub(crate) struct RockScene {
    stage: Stage,
    eye: Eye,
    method: Method,
    triangles_of: HashMap<AssetId<Mesh>, u64>,
}

impl RockScene {
    /// `None` without an adapter.
    pub(crate) fn new(levels: &[Vec<Mesh>], method: Method) -> Option<Self> {
        let mut stage = Stage::new()?;
        let mut triangles_of = HashMap::new();
        let mut handles = |level: &Mesh| {
            let corners = level.indices().map_or(0, Indices::len);
            let handle = stage.add(level.clone());
            triangles_of.insert(handle.id(), corners as u64 / 3);
            handle
        };
        let wanted = match method {
            Method::Ranges { .. } => 3,
            Method::Full | Method::AutoLod(_) => 1,
        };
        let meshes: Vec<Vec<Handle<Mesh>>> = levels
            .iter()
            .map(|levels| levels[..wanted].iter().map(&mut handles).collect())
            .collect();
        let stone = stage.add(StandardMaterial::from(Color::srgb(0.6, 0.55, 0.5)));
        for index in 0..ROCKS {
            let levels = &meshes[(index % SHAPES) as usize];
            spawn_rock(&mut stage, levels, &stone, place_of(index), method);
        }
        add_surroundings(&mut stage);
        let settings = FieldLodCamera::with_error_px(1.0);
        let eye = stage.add_eye_of_size(SIZE_PX, pose(0), css::SKY_BLUE.into(), settings);
        stage.run_until_ready();
        Some(Self {
            stage,
            eye,
            method,
            triangles_of,
        })
    }

    /// Moves the camera.
    pub(crate) fn go_to(&mut self, step: usize) {
        let mut camera = self.stage.app.world_mut().entity_mut(self.eye.entity);
        camera.insert(pose(step));
    }

    /// One frame. Returns its time with the wait for the GPU, and its parts on the CPU.
    pub(crate) fn draw(&mut self) -> (Duration, FrameTimes) {
        let start = Instant::now();
        let parts = FrameTimes::of_update(&mut self.stage.app);
        let device = self.stage.app.world().resource::<RenderDevice>();
        let done = device.poll(PollType::wait_indefinitely());
        done.expect("the graphics device is not lost");
        (start.elapsed(), parts)
    }

    /// The pictures at these steps.
    pub(crate) fn pictures(&mut self, steps: &[usize]) -> Vec<RgbaImage> {
        let picture = |&step: &usize| {
            self.go_to(step);
            self.draw();
            let [picture] = self.stage.shoot([&self.eye]);
            picture
        };
        steps.iter().map(picture).collect()
    }

    /// Triangles of rocks in the camera's view, shadows not counted.
    pub(crate) fn triangles_drawn(&self) -> u64 {
        if matches!(self.method, Method::AutoLod(_)) {
            return self.stage.stats(&self.eye).triangles_drawn;
        }
        let world = self.stage.app.world();
        let seen = world.get::<VisibleEntities>(self.eye.entity);
        let seen = seen
            .into_iter()
            .flat_map(|seen| seen.get(TypeId::of::<Mesh3d>()));
        let meshes = seen.filter_map(|&entity| world.get::<Mesh3d>(entity));
        meshes
            .filter_map(|mesh| self.triangles_of.get(&mesh.id()))
            .sum()
    }

    /// Entities with a mesh.
    pub(crate) fn mesh_entities(&self) -> usize {
        let world = self.stage.app.world();
        world
            .iter_entities()
            .filter(EntityRef::contains::<Mesh3d>)
            .count()
    }

    /// Bytes of the renderer's buffers for vertices and indices.
    pub(crate) fn mesh_bytes(&self) -> u64 {
        let app = self.stage.app.sub_app(RenderApp);
        app.world().resource::<MeshAllocator>().slabs_size()
    }

    pub(crate) fn adapter(&self) -> String {
        let adapter = self.stage.app.world().resource::<RenderAdapterInfo>();
        adapter.name.clone()
    }
}

/// The pose among the rocks. Each step goes forward.
fn pose(step: usize) -> Transform {
    let eye = Vec3::new(0.0, 2.2, 8.0 - 0.4 * step as f32);
    Transform::from_translation(eye).looking_to(Vec3::new(0.1, -0.08, -1.0), Vec3::Y)
}

/// The place of a rock: higher numbers are farther away.
fn place_of(index: u32) -> Transform {
    let away = 3.0 + 90.0 * (index as f32 / ROCKS as f32).powi(2);
    let aside = ((index as f32 * 0.618).fract() - 0.5) * away * 1.2;
    let turn = Quat::from_rotation_y(index as f32 * 2.4);
    Transform::from_xyz(aside, 0.4, -away).with_rotation(turn)
}

fn spawn_rock(
    stage: &mut Stage,
    levels: &[Handle<Mesh>],
    stone: &Handle<StandardMaterial>,
    place: Transform,
    method: Method,
) {
    let drawn = |mesh: &Handle<Mesh>| (Mesh3d(mesh.clone()), MeshMaterial3d(stone.clone()), place);
    match method {
        Method::Full => {
            stage.spawn(drawn(&levels[0]));
        }
        Method::AutoLod(kind) => {
            stage.spawn((drawn(&levels[0]), AutoLod { kind, ..default() }));
        }
        Method::Ranges { scale } => {
            let [near, far] = SWITCH_AT_M.map(|at| at * scale);
            let bounds = [0.0..near, near..far, far..f32::INFINITY];
            for (mesh, range) in levels.iter().zip(bounds) {
                stage.spawn((drawn(mesh), VisibilityRange::abrupt(range.start, range.end)));
            }
        }
    }
}

fn add_surroundings(stage: &mut Stage) {
    let ground = stage.add(Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(200.0))));
    let grass = stage.add(StandardMaterial::from(Color::srgb(0.35, 0.45, 0.25)));
    stage.spawn((Mesh3d(ground), MeshMaterial3d(grass)));
    stage.spawn((
        DirectionalLight {
            illuminance: 6_000.0,
            shadow_maps_enabled: true,
            ..default()
        },
        CascadeShadowConfigBuilder {
            num_cascades: 2,
            maximum_distance: 60.0,
            ..default()
        }
        .build(),
        Transform::default().looking_to(Vec3::new(-1.0, -0.7, -0.5), Vec3::Y),
    ));
}
