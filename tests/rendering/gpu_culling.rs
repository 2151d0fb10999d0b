//! GPU culling draws the same pictures as CPU culling.

use bevy::camera::visibility::{NoCpuCulling, RenderLayers};
use bevy::color::palettes::css;
use bevy::diagnostic::FrameCount;
use bevy::light::{CascadeShadowConfigBuilder, DirectionalLight};
use bevy::post_process::motion_blur::MotionBlur;
use bevy::prelude::*;
use bevy::render::view::NoIndirectDrawing;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::{Eye, Pending, Stage};
use image::RgbaImage;

use crate::picture::{count, difference};

/// The scene that [`STEPS`] change.
struct Story {
    stage: Stage,
    boulder: Entity,
    prop: Entity,
    glass: Entity,
    sun: Entity,
    eyes: Vec<Eye>,
}

/// A sun on layers 0 and 1.
fn spawn_sun(stage: &mut Stage) -> Entity {
    // The first cascade ends before the rocks: later cascades must have shadows too.
    let cascades = CascadeShadowConfigBuilder {
        first_cascade_far_bound: 2.0,
        ..default()
    };
    stage.spawn((
        DirectionalLight {
            illuminance: 5_000.0,
            shadow_maps_enabled: true,
            ..default()
        },
        cascades.build(),
        Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y),
        RenderLayers::from_layers(&[0, 1]),
    ))
}

impl Story {
    fn new(gpu_culling: bool) -> Option<Self> {
        let mut stage = Stage::new()?;
        stage.shrink_shadow_maps();
        stage.config().advanced.gpu_culling = gpu_culling;
        let stone = stage.add(StandardMaterial::from(Color::srgb(0.6, 0.5, 0.4)));
        let clear = stage.add(StandardMaterial::from(Color::srgba(0.4, 0.6, 0.5, 0.5)));
        let mut add_rock = |subdivisions, material: &Handle<StandardMaterial>, x| {
            let mesh = stage.add(bevy_mesh(&fieldlod_tests::rock(subdivisions, 7)));
            let place = Transform::from_xyz(x, 1.5, 0.0);
            let material = MeshMaterial3d(material.clone());
            stage.spawn((Mesh3d(mesh), material, place, AutoLod::default()))
        };
        let boulder = add_rock(5, &stone, 0.0);
        let prop = add_rock(3, &stone, -2.5);
        let glass = add_rock(3, &clear, 2.5);
        let ground = stage.add(Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(20.0))));
        let layers = RenderLayers::from_layers(&[0, 1]);
        stage.spawn((Mesh3d(ground), MeshMaterial3d(stone), layers.clone()));
        let sun = spawn_sun(&mut stage);
        stage.spawn((
            PointLight {
                shadow_maps_enabled: true,
                intensity: 300_000.0,
                ..default()
            },
            Transform::from_xyz(1.0, 5.0, 4.0),
        ));
        let mut story = Self {
            stage,
            boulder,
            prop,
            glass,
            sun,
            eyes: Vec::new(),
        };
        story.add_eye(1.0, -1.5);
        story.add_eye(300.0, 1.5);
        story.stage.run_until_ready();
        Some(story)
    }

    fn add_eye(&mut self, error_px: f32, x: f32) {
        let pose = Transform::from_xyz(x, 4.0, 7.0).looking_at(Vec3::new(0.0, 0.7, 0.0), Vec3::Y);
        let settings = FieldLodCamera::with_error_px(error_px);
        let size_px = UVec2::splat(128);
        let background = css::SKY_BLUE.into();
        let eye = self
            .stage
            .add_eye_of_size(size_px, pose, background, settings);
        self.eyes.push(eye);
    }

    /// Draws two frames, and waits for pictures of the second.
    fn pictures(&mut self) -> Vec<RgbaImage> {
        let pending = self.draw();
        pending.iter().map(|one| self.stage.wait(one)).collect()
    }

    /// Draws two frames, and requests pictures of the second.
    fn draw(&mut self) -> Vec<Pending> {
        self.stage.app.update();
        let eyes: Vec<&Eye> = self.eyes.iter().collect();
        let pending = self.stage.request(&eyes);
        self.stage.app.update();
        pending
    }

    /// Enables motion blur. Returns the first eye's picture of a frame in which objects move and units are spawned.
    fn smeared(&mut self) -> RgbaImage {
        let blur = MotionBlur {
            shutter_angle: 1.0,
            samples: 8,
        };
        self.stage.insert(self.eyes[0].entity, blur);
        self.stage.app.update();
        let finer = FieldLodCamera::with_error_px(0.3);
        self.stage.insert(self.eyes[0].entity, finer);
        for (entity, x) in [(self.boulder, 0.6), (self.prop, -1.9), (self.glass, 2.0)] {
            let place = Transform::from_xyz(x, 1.5, 0.0);
            self.stage.insert(entity, place);
        }
        // The noise of the blur depends on the frame count, which may differ between two apps.
        *self.stage.app.world_mut().resource_mut::<FrameCount>() = FrameCount(1_000);
        let pending = self.stage.request(&[&self.eyes[0]]);
        self.stage.wait(&pending[0])
    }
}

type Step = (&'static str, fn(&mut Story));

const STEPS: [Step; 14] = [
    ("the first frame", |_| {}),
    ("a camera moves", |story| {
        let pose = Transform::from_xyz(-1.0, 2.5, 4.0).looking_at(Vec3::Y, Vec3::Y);
        story.stage.insert(story.eyes[0].entity, pose);
    }),
    ("a camera is added", |story| story.add_eye(20.0, 0.0)),
    ("an object moves to another layer", |story| {
        story.stage.insert(story.boulder, RenderLayers::layer(1));
    }),
    ("a camera draws layers 0 and 1", |story| {
        let layers = RenderLayers::from_layers(&[0, 1]);
        story.stage.insert(story.eyes[0].entity, layers);
    }),
    ("the object is on the first layer again", |story| {
        let mut boulder = story.stage.app.world_mut().entity_mut(story.boulder);
        boulder.remove::<RenderLayers>();
    }),
    ("an object is hidden", |story| {
        story.stage.insert(story.prop, Visibility::Hidden);
    }),
    ("the object is shown, and another moves", |story| {
        story.stage.insert(story.prop, Visibility::Visible);
        story
            .stage
            .insert(story.glass, Transform::from_xyz(1.5, 2.5, 1.0));
    }),
    ("a camera sees full detail", |story| {
        let settings = FieldLodCamera::at_level(0);
        story.stage.insert(story.eyes[1].entity, settings);
    }),
    ("the camera sees a cut again, and another pauses", |story| {
        let settings = FieldLodCamera::with_error_px(100.0);
        story.stage.insert(story.eyes[1].entity, settings);
        story.stage.set_active(&story.eyes[0], false);
        story.stage.app.update();
        story.stage.set_active(&story.eyes[0], true);
    }),
    ("a light is hidden", |story| {
        story.stage.insert(story.sun, Visibility::Hidden);
    }),
    // In Bevy 0.19.1, a light that was hidden has no shadows when shown again, so a new light replaces it.
    ("another light is added", |story| {
        story.stage.app.update();
        story.stage.app.world_mut().entity_mut(story.sun).despawn();
        story.sun = spawn_sun(&mut story.stage);
    }),
    ("an object loses its levels", |story| {
        let mut boulder = story.stage.app.world_mut().entity_mut(story.boulder);
        boulder.remove::<AutoLod>();
    }),
    ("an object is despawned", |story| {
        story.stage.app.world_mut().entity_mut(story.prop).despawn();
    }),
];

#[test]
fn gpu_lists_equal_cpu_lists() {
    let (Some(mut kept), Some(mut filtered)) = (Story::new(true), Story::new(false)) else {
        return;
    };
    let on_gpu = |story: &mut Story| {
        let world = story.stage.app.world_mut();
        let mut units = world.query_filtered::<Has<NoCpuCulling>, With<LodUnit>>();
        let units: Vec<bool> = units.iter(world).collect();
        assert!(!units.is_empty());
        units.iter().all(|&is_on| is_on) && world.entity(story.prop).contains::<NoCpuCulling>()
    };
    assert!(on_gpu(&mut kept), "GPU culling is unsupported");
    assert!(!on_gpu(&mut filtered));
    let frames = STEPS.map(|(_, step)| {
        [&mut kept, &mut filtered].map(|story| {
            step(story);
            story.draw()
        })
    });
    let mut before = Vec::new();
    for ((name, _), frames) in STEPS.iter().zip(&frames) {
        let pictures = |story: &mut Story, pending: &[Pending]| {
            let pictures = pending.iter().map(|one| story.stage.wait(one));
            pictures.collect::<Vec<RgbaImage>>()
        };
        let filtered = pictures(&mut filtered, &frames[1]);
        let pictures = pictures(&mut kept, &frames[0]);
        for (index, (kept, filtered)) in pictures.iter().zip(&filtered).enumerate() {
            let differing = count(&difference(kept, filtered));
            assert_eq!(differing, 0, "{name}, in the picture of camera {index}");
        }
        let has_changed = |(now, before): (&RgbaImage, &RgbaImage)| now != before;
        let changes =
            pictures.len() > before.len() || pictures.iter().zip(&before).any(has_changed);
        assert!(changes, "{name}: no picture changes");
        before = pictures;
    }
}

#[test]
fn no_indirect_drawing_uses_cpu_lists() {
    let Some(mut story) = Story::new(true) else {
        return;
    };
    let before = story.pictures();
    let is_on_gpu = |story: &Story| {
        let prop = story.stage.app.world().entity(story.prop);
        prop.contains::<NoCpuCulling>()
    };
    assert!(is_on_gpu(&story));
    story.add_eye(300.0, 1.5);
    story.stage.insert(story.eyes[2].entity, NoIndirectDrawing);
    let pictures = story.pictures();
    assert!(!is_on_gpu(&story));
    for (one, other) in before.iter().zip(&pictures) {
        assert_eq!(count(&difference(one, other)), 0);
    }
}

#[test]
fn motion_blur_is_equal_with_gpu_lists() {
    let (Some(mut on_gpu), Some(mut on_cpu)) = (Story::new(true), Story::new(false)) else {
        return;
    };
    let (smeared, expected) = (on_gpu.smeared(), on_cpu.smeared());
    assert_eq!(count(&difference(&smeared, &expected)), 0);
    // Nothing moves in this picture, so the blur leaves it sharp.
    let sharp = &on_gpu.pictures()[0];
    let differing = count(&difference(&smeared, sharp));
    assert!(differing > 250, "only {differing} pixels are blurred");
}
