//! Characters are drawn in their pose at every level: a bending tube of two primitives, and a ball with a morph target.

use bevy::camera::visibility::NoCpuCulling;
use bevy::color::palettes::css;
use bevy::core_pipeline::prepass::MotionVectorPrepass;
use bevy::mesh::morph::MorphWeights;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::drawn_level;
use fieldlod_tests::frame_times::drop_commands;
use fieldlod_tests::stage::{Eye, Stage};
use image::RgbaImage;

use crate::character_files::{ball, tube};
use crate::gltf_file::GltfFile;
use crate::picture::{count, difference, differs, enclosed};
use crate::swap::uniform;

/// The scene of a file with levels, and a camera.
struct Show {
    stage: Stage,
    eye: Eye,
    parts: Vec<Entity>,
    // The folder of the scene.
    _file: GltfFile,
}

impl Show {
    fn new(mut file: GltfFile, gpu_culling: bool) -> Option<Self> {
        file.glb();
        let mut stage = Stage::unfinished_in(file.folder())?;
        stage.config().advanced.gpu_culling = gpu_culling;
        stage.finish();
        let assets = stage.app.world().resource::<AssetServer>();
        let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("mesh.glb"));
        stage.spawn((WorldAssetRoot(scene), AutoLod::default()));
        let light = Transform::default().looking_to(Vec3::new(-1.0, -0.8, -1.0), Vec3::Y);
        stage.spawn((DirectionalLight::default(), light));
        let eye = stage.add_eye(at(9.0), css::BLACK.into(), FieldLodCamera::default());
        let mut meshes = stage
            .app
            .world_mut()
            .query_filtered::<Entity, With<Mesh3d>>();
        stage.run_until("the scene is loaded", |stage| {
            meshes.iter(stage.app.world()).len() > 0
        });
        let parts = meshes.iter(stage.app.world()).collect();
        stage.run_until_ready();
        Some(Self {
            stage,
            eye,
            parts,
            _file: file,
        })
    }

    fn with_each_culling(file: fn() -> GltfFile) -> impl Iterator<Item = Self> {
        [true, false]
            .into_iter()
            .filter_map(move |culling| Self::new(file(), culling))
    }

    /// Bends the joints and sets the weight of the morph target.
    fn pose(&mut self, bend: f32, weight: f32) {
        let world = self.stage.app.world_mut();
        for mut weights in world.query::<&mut MorphWeights>().iter_mut(world) {
            weights.weights_mut()[0] = weight;
        }
        let skin = world.query::<&SkinnedMesh>().iter(world).next();
        let joints = skin.map_or(Vec::new(), |skin| skin.joints.clone());
        let turns = [
            Quat::from_rotation_z(bend),
            Quat::from_rotation_x(0.5 * bend),
        ];
        for (joint, turn) in joints.into_iter().skip(1).zip(turns) {
            world.get_mut::<Transform>(joint).unwrap().rotation = turn;
        }
    }

    fn shoot(&mut self, settings: FieldLodCamera) -> RgbaImage {
        self.stage.insert(self.eye.entity, settings);
        let [picture] = self.stage.shoot([&self.eye]);
        picture
    }

    fn level(&mut self) -> Option<u32> {
        drawn_level(self.stage.app.world_mut(), self.parts[0], self.eye.entity)
    }
}

/// The pose of a camera in front of the middle of the tube.
fn at(distance: f32) -> Transform {
    Transform::from_xyz(0.0, 2.0, distance)
}

const SOURCE: u32 = 0;
const COARSE: u32 = 4;

/// For each pixel, whether it is not black.
fn mask(picture: &RgbaImage) -> Vec<bool> {
    picture
        .pixels()
        .map(|pixel| pixel.0[..3].iter().any(|&value| value > 8))
        .collect()
}

/// The number of pixels in both masks, divided by the number in either.
fn overlap(a: &[bool], b: &[bool]) -> f32 {
    let both = a.iter().zip(b).filter(|(a, b)| **a && **b).count();
    let any = a.iter().zip(b).filter(|(a, b)| **a || **b).count();
    both as f32 / any as f32
}

/// The number of pixels of a mask whose value does not occur in another mask within one pixel.
fn beyond_a_pixel(mask: &[bool], other: &[bool], width: usize) -> usize {
    let has_beside = |at: usize| {
        let (x, y) = (at % width, at / width);
        let rows = y.saturating_sub(1)..=(y + 1).min(other.len() / width - 1);
        let columns = x.saturating_sub(1)..=(x + 1).min(width - 1);
        rows.flat_map(|y| columns.clone().map(move |x| y * width + x))
            .any(|beside| other[beside] == mask[at])
    };
    (0..mask.len()).filter(|&at| !has_beside(at)).count()
}

#[test]
fn posed_levels_look_like_posed_source() {
    let Some(mut show) = Show::new(tube(), true) else {
        return;
    };
    // The first guarantee measures deviations.
    show.shoot(FieldLodCamera::guaranteed(1.0));
    show.stage.run_until("deviations are measured", |stage| {
        stage.app.world().resource::<FieldLodProgress>().baking == 0
    });
    let source_at_rest = mask(&show.shoot(FieldLodCamera::at_level(SOURCE)));
    show.pose(1.1, 0.6);
    let source = show.shoot(FieldLodCamera::at_level(SOURCE));
    let promised = show.shoot(FieldLodCamera::guaranteed(1.0));
    assert!(show.level() > Some(SOURCE));
    let coarse = show.shoot(FieldLodCamera::at_level(COARSE));
    assert_eq!(show.level(), Some(COARSE));
    let width = source.width() as usize;
    let [source, promised_mask, coarse_mask] = [&source, &promised, &coarse].map(mask);
    assert!(count(&source) > 2_000);
    assert!(
        overlap(&source, &source_at_rest) < 0.7,
        "the pose does not show"
    );
    let too_far = beyond_a_pixel(&promised_mask, &source, width)
        + beyond_a_pixel(&source, &promised_mask, width);
    assert_eq!(too_far, 0);
    let coarse_overlap = overlap(&source, &coarse_mask);
    assert!((0.8..1.0).contains(&coarse_overlap), "{coarse_overlap}");
    for picture in [promised, coarse] {
        let background = *picture.get_pixel(0, 0);
        assert_eq!(enclosed(&picture, background), 0, "there is a hole");
    }
}

#[test]
fn level_change_draws_right_pose_at_once() {
    for file in [tube as fn() -> GltfFile, ball] {
        for mut show in Show::with_each_culling(file) {
            show.pose(0.8, 1.0);
            let mut levels = Vec::new();
            let pictures = [4.0, 300.0, 30.0, 4.0, 90.0, 6.0].map(|distance| {
                show.stage.insert(show.eye.entity, at(distance));
                let pictures = [(); 2].map(|()| show.stage.draw(&show.eye));
                levels.push(show.level().unwrap());
                pictures
            });
            for (pictures, level) in pictures.iter().zip(&levels) {
                let [first, next] = pictures.each_ref().map(|one| show.stage.wait(one));
                assert_eq!(count(&difference(&first, &next)), 0, "level {level}");
                let background = *next.get_pixel(0, 0);
                assert!(next.pixels().any(|pixel| differs(*pixel, background)));
            }
            levels.sort_unstable();
            levels.dedup();
            assert!(levels.len() > 2, "{levels:?}");
            let world = show.stage.app.world();
            let is_on_gpu = |part: &Entity| world.entity(*part).contains::<NoCpuCulling>();
            assert!(!show.parts.iter().any(is_on_gpu), "Bevy culls characters");
        }
    }
}

#[test]
fn coarse_character_casts_posed_shadow() {
    let Some(mut show) = Show::new(tube(), true) else {
        return;
    };
    show.stage.shrink_shadow_maps();
    let ground = Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(40.0)));
    let ground = show.stage.add(ground);
    let white = show.stage.add(StandardMaterial::from(Color::WHITE));
    let below = Transform::from_xyz(0.0, -1.0, 0.0);
    let ground = (Mesh3d(ground), MeshMaterial3d(white), below);
    show.stage.spawn(ground);
    let world = show.stage.app.world_mut();
    let mut lights = world.query::<&mut DirectionalLight>();
    lights.single_mut(world).unwrap().shadow_maps_enabled = true;
    // The tube is right of the image. Only its shadow is visible.
    let pose =
        Transform::from_xyz(-8.0, 14.0, 0.0).looking_at(Vec3::new(-8.0, -1.0, -6.0), Vec3::Y);
    show.stage.insert(show.eye.entity, pose);
    let mut shadow = |bend: f32, level: u32| {
        show.pose(bend, 0.0);
        let picture = show.shoot(FieldLodCamera::at_level(level));
        let brightest = picture.pixels().map(|pixel| pixel.0[0]).max().unwrap();
        let is_dark = |pixel: &image::Rgba<u8>| pixel.0[0] < brightest / 2;
        picture.pixels().map(is_dark).collect::<Vec<bool>>()
    };
    let at_rest = shadow(0.0, SOURCE);
    let source = shadow(1.1, SOURCE);
    let coarse = shadow(1.1, COARSE);
    assert!(count(&source) > 500, "{}", count(&source));
    let overlaps = [&at_rest, &coarse].map(|other| overlap(&source, other));
    assert!(overlaps[0] < 0.7 && overlaps[1] > 0.75, "{overlaps:?}");
}

#[test]
fn level_change_keeps_last_skin() {
    for mut show in Show::with_each_culling(tube) {
        drop_commands(&mut show.stage.app);
        show.stage.insert(show.eye.entity, MotionVectorPrepass);
        show.pose(0.3, 0.2);
        (0..3).for_each(|_| show.stage.app.update());
        let Some(before) = uniform(&show.stage, show.parts[0]) else {
            return;
        };
        let near = show.level();
        show.stage.insert(show.eye.entity, at(100.0));
        show.pose(0.4, 0.3);
        show.stage.app.update();
        assert!(show.level() > near);
        let after = uniform(&show.stage, show.parts[0]).unwrap();
        assert_ne!(after.first_index_index, before.first_index_index);
        assert_ne!(after.previous_input_index, u32::MAX);
        assert_eq!(after.current_skin_index, before.current_skin_index);
        assert_eq!(after.morph_descriptor_index, before.morph_descriptor_index);
        assert!(after.morph_descriptor_index != u32::MAX && after.current_skin_index != u32::MAX);
    }
}
