//! The render world draws an entity with another mesh. Each frame looks as if the entity had that `Mesh3d`.

#[path = "../../crates/bevy_fieldlod/src/draw/drawn_meshes.rs"]
#[expect(dead_code, reason = "the plugin uses more of it")]
mod substitution;

use bevy::asset::RenderAssetUsages;
use bevy::camera::visibility::NoCpuCulling;
use bevy::color::palettes::css;
use bevy::core_pipeline::prepass::{DeferredPrepass, DepthPrepass, NormalPrepass};
use bevy::light::{CascadeShadowConfigBuilder, NotShadowCaster};
use bevy::mesh::MeshTag;
use bevy::pbr::wireframe::{Wireframe, WireframePlugin};
use bevy::pbr::{Lightmap, RenderMeshInstances};
use bevy::post_process::motion_blur::MotionBlur;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use bevy::render::sync_world::MainEntity;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::stage::{Eye, Pending, Stage};
use image::RgbaImage;
use substitution::DrawnMeshes;

use crate::picture::count_beyond;

struct Show {
    stage: Stage,
    /// Whether entities get another [`Mesh3d`]. Otherwise only the render world draws another mesh.
    swaps: bool,
    /// The mesh of all entities, and two others.
    meshes: [Handle<Mesh>; 3],
    entities: Vec<Entity>,
    eyes: [Eye; 2],
    materials: Vec<Handle<StandardMaterial>>,
    frames: Vec<Pending>,
}

/// A mesh with a second set of texture coordinates.
fn with_two_uvs(mesh: impl Into<Mesh>) -> Mesh {
    let mesh = mesh.into();
    let uvs = mesh.attribute(Mesh::ATTRIBUTE_UV_0).unwrap().clone();
    mesh.with_inserted_attribute(Mesh::ATTRIBUTE_UV_1, uvs)
}

fn with_colors(mesh: Mesh) -> Mesh {
    let colors = vec![[0.9, 0.6, 0.3, 1.0]; mesh.count_vertices()];
    mesh.with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colors)
}

impl Show {
    fn new(swaps: bool, gpu_culling: bool) -> Option<Self> {
        let mut stage = Stage::unfinished()?;
        let plugins = (WireframePlugin::default(), substitution::plugin);
        stage.app.add_plugins(plugins);
        stage.finish();
        let meshes = [
            stage.add(with_two_uvs(Sphere::new(0.8).mesh().ico(5).unwrap())),
            stage.add(with_two_uvs(Cuboid::new(0.9, 1.5, 0.9))),
            // It has pipelines of its own.
            stage.add(with_colors(with_two_uvs(Cone::new(0.8, 1.4)))),
        ];
        let materials = [
            StandardMaterial::from(Color::srgb(0.8, 0.5, 0.3)),
            Color::srgba(0.3, 0.7, 0.5, 0.5).into(),
            Color::srgb(0.3, 0.4, 0.9).into(),
            StandardMaterial {
                base_color: css::YELLOW.into(),
                alpha_mode: AlphaMode::Mask(0.5),
                ..default()
            },
        ];
        let materials = Vec::from(materials.map(|material| stage.add(material)));
        let ground = stage.add(Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(20.0))));
        stage.spawn((Mesh3d(ground), MeshMaterial3d(materials[0].clone())));
        let entities: Vec<Entity> = (0..8u8)
            .map(|index| {
                let (x, z) = (f32::from(index % 4), f32::from(index / 4));
                let place = Transform::from_xyz(2.2 * x - 3.3, 1.0, 2.5 * z - 2.0);
                let material = MeshMaterial3d(materials[usize::from(index % 4)].clone());
                stage.spawn((Mesh3d(meshes[0].clone()), material, place))
            })
            .collect();
        if gpu_culling {
            entities
                .iter()
                .for_each(|entity| stage.insert(*entity, NoCpuCulling));
        }
        let image = lightmap();
        let image = stage.add(image);
        let lightmap = Lightmap { image, ..default() };
        stage.insert(entities[4], lightmap);
        stage.insert(entities[3], Wireframe);
        spawn_lights(&mut stage);
        let eyes = [Vec3::new(0.0, 4.0, 9.0), Vec3::new(5.0, 3.0, 6.0)].map(|at| {
            let pose = Transform::from_translation(at).looking_at(Vec3::Y * 0.8, Vec3::Y);
            let view = FieldLodCamera::default();
            stage.add_eye_of_size(UVec2::splat(128), pose, css::SKY_BLUE.into(), view)
        });
        let blur = MotionBlur {
            shutter_angle: 1.0,
            samples: 3,
        };
        stage.insert(eyes[0].entity, (blur, DepthPrepass, NormalPrepass));
        stage.insert(eyes[1].entity, (DepthPrepass, DeferredPrepass));
        (0..3).for_each(|_| stage.app.update());
        Some(Self {
            stage,
            swaps,
            meshes,
            entities,
            eyes,
            materials,
            frames: Vec::new(),
        })
    }

    fn draw_with(&mut self, index: usize, mesh: usize) {
        let (entity, handle) = (self.entities[index], self.meshes[mesh].clone());
        if self.swaps {
            self.stage.insert(entity, Mesh3d(handle));
        } else {
            let drawn = self.stage.app.world().resource::<DrawnMeshes>();
            drawn.set(entity, (mesh > 0).then_some(handle.id()));
        }
    }

    fn step(&mut self, step: usize) {
        let all = 0..self.entities.len();
        match step {
            1 => all.for_each(|index| self.draw_with(index, 1)),
            3 => (0..3).for_each(|index| self.move_by(index, 0.3)),
            // Motion vectors: entities move and change in the same frame.
            4 => {
                all.for_each(|index| self.move_by(index, -0.3));
                [0, 2, 5, 7]
                    .into_iter()
                    .for_each(|index| self.draw_with(index, 0));
            }
            5 => {
                all.clone().for_each(|index| self.move_by(index, 0.2));
                all.for_each(|index| self.draw_with(index, 2));
                let material = MeshMaterial3d(self.materials[2].clone());
                self.stage.insert(self.entities[1], material);
            }
            6 => self.stage.insert(self.entities[2], Visibility::Hidden),
            7 => self.draw_with(2, 1),
            8 => self.stage.insert(self.entities[2], Visibility::Inherited),
            9 => {
                let mut tag = MeshTag::default();
                *tag = 3;
                let components = (tag, NotShadowCaster);
                self.stage.insert(self.entities[0], components);
                // An entity gets another mesh in the frame in which it is despawned.
                self.draw_with(6, 1);
                self.stage.app.world_mut().despawn(self.entities[6]);
                self.entities.truncate(6);
            }
            // The game edits the mesh of all entities while other meshes are drawn.
            11 => {
                let mut meshes = self.stage.app.world_mut().resource_mut::<Assets<Mesh>>();
                let mut own = meshes.get_mut(&self.meshes[0]).unwrap();
                let thinner = own.clone().scaled_by(Vec3::new(0.5, 1.0, 0.5));
                *own = thinner;
            }
            13 => all.for_each(|index| self.draw_with(index, 0)),
            _ => {}
        }
    }

    fn move_by(&mut self, index: usize, by: f32) {
        let mut entity = self.stage.app.world_mut().entity_mut(self.entities[index]);
        entity.get_mut::<Transform>().unwrap().translation.x += by;
    }

    fn run_frame(&mut self, step: usize) {
        self.step(step);
        let eyes: Vec<&Eye> = self.eyes.iter().collect();
        self.frames.extend(self.stage.request(&eyes));
        self.stage.app.update();
    }

    fn pictures(&mut self) -> Vec<RgbaImage> {
        let frames = std::mem::take(&mut self.frames);
        frames.iter().map(|frame| self.stage.wait(frame)).collect()
    }

    /// The index of the mesh that the renderer draws an entity with.
    fn drawn_mesh(&self, index: usize) -> Option<usize> {
        let instances = self.stage.app.sub_app(RenderApp).world();
        let instances = instances.resource::<RenderMeshInstances>();
        let drawn = instances.mesh_asset_id(MainEntity::from(self.entities[index]))?;
        self.meshes.iter().position(|mesh| mesh.id() == drawn)
    }
}

fn lightmap() -> Image {
    let texels = [255u8, 60, 60, 255, 60, 255, 60, 255].repeat(2);
    let size = Extent3d {
        width: 2,
        height: 2,
        depth_or_array_layers: 1,
    };
    let format = TextureFormat::Rgba8UnormSrgb;
    let usage = RenderAssetUsages::default();
    Image::new(size, TextureDimension::D2, texels, format, usage)
}

fn spawn_lights(stage: &mut Stage) {
    stage.shrink_shadow_maps();
    let cascades = CascadeShadowConfigBuilder {
        first_cascade_far_bound: 6.0,
        maximum_distance: 40.0,
        num_cascades: 2,
        ..default()
    };
    let sun = DirectionalLight {
        illuminance: 5_000.0,
        shadow_maps_enabled: true,
        ..default()
    };
    let low = Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y);
    stage.spawn((sun, cascades.build(), low));
    let lamp = PointLight {
        shadow_maps_enabled: true,
        intensity: 300_000.0,
        ..default()
    };
    stage.spawn((lamp, Transform::from_xyz(1.0, 5.0, 3.0)));
}

#[test]
fn substituted_mesh_looks_like_swapped_mesh() {
    let Some(mut swapped) = Show::new(true, false) else {
        return;
    };
    let mut substituted = [true, false].map(|gpu_culling| Show::new(false, gpu_culling).unwrap());
    for step in 0..16 {
        swapped.run_frame(step);
        for show in &mut substituted {
            show.run_frame(step);
            for index in 0..show.entities.len() {
                let world = show.stage.app.world();
                let mesh = world.get::<Mesh3d>(show.entities[index]).unwrap();
                assert_eq!(mesh.0, show.meshes[0]);
                let drawn = [&swapped, &*show].map(|show| show.drawn_mesh(index));
                assert_eq!(drawn[0], drawn[1], "entity {index} in step {step}");
            }
        }
    }
    let swapped = swapped.pictures();
    for mut show in substituted {
        let pictures = show.pictures();
        let pairs = swapped.iter().zip(&pictures);
        let differences: Vec<usize> = pairs.map(|(a, b)| count_beyond(a, b, 2)).collect();
        assert_eq!(differences, [0; 32]);
    }
    // At least eight pictures differ from the previous picture of the same camera.
    let frames = swapped.windows(3);
    let changes = frames.filter(|frames| count_beyond(&frames[0], &frames[2], 2) > 125);
    assert!(changes.count() >= 8);
}
