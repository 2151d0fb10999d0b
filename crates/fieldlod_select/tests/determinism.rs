//! One hash of a whole walk: the same cuts in debug and release, in scalars and lanes, on every
//! machine.

mod common;

use std::sync::OnceLock;

use camera_field::{CAMERA_FROM_VIEW, Camera, Intrinsics};
use common::synthetic;
use fieldlod_hierarchy::{Hierarchy, fixtures};
use fieldlod_select::{
    Cut, InstanceId, LodSettings, OcclusionBuffer, Scene, Selector, View, VisibleFlux, select,
};
use glam::{Affine3A, Mat3, Vec2, Vec3};

const EXPECTED: u64 = 0x1e4f_5576_231b_1e1b;
const EXPECTED_WITH_FLUX: u64 = 0xf96b_6959_1853_8760;
const FRAMES: u16 = 600;

fn ball() -> &'static Hierarchy {
    static BALL: OnceLock<Hierarchy> = OnceLock::new();
    BALL.get_or_init(|| synthetic::ball(4, 0.002))
}

/// Placements without trigonometry: turned by Pythagorean triples, scaled, some unevenly.
fn placements() -> Vec<Affine3A> {
    let place = |index: u16| {
        let (x, z) = (f32::from(index % 8), f32::from(index / 8));
        let turn = Mat3::from_cols(Vec3::new(0.6, 0.0, -0.8), Vec3::Y, Vec3::new(0.8, 0.0, 0.6));
        let uneven = if index.is_multiple_of(3) {
            Vec3::new(1.0, 0.5, 2.0)
        } else {
            Vec3::ONE
        };
        let linear = turn * Mat3::from_diagonal(uneven * (0.5 + z * 0.1));
        Affine3A::from_mat3_translation(linear, Vec3::new(x * 3.0, 0.0, z * -3.0))
    };
    (0..64).map(place).collect()
}

/// A walk through them: forward, sideways, head-bob, slowly turning; a jump half-way.
fn view(frame: u16) -> View {
    let step = f32::from(frame);
    let bob = f32::from(frame % 40) - 20.0;
    let jump = if frame < FRAMES / 2 { 0.0 } else { 12.0 };
    let eye = Vec3::new(
        jump + step * 0.01,
        1.2 + bob.abs() * 0.003,
        6.0 - step * 0.03,
    );
    facing(eye, Vec3::new(step * 0.001 - 0.3, 0.1, 1.0))
}

fn facing(eye: Vec3, back: Vec3) -> View {
    let back = back * (1.0 / back.dot(back).sqrt());
    let right = Vec3::Y.cross(back);
    let right = right * (1.0 / right.dot(right).sqrt());
    let world_from_view = Mat3::from_cols(right, back.cross(right), back);
    assert_eq!(CAMERA_FROM_VIEW * CAMERA_FROM_VIEW, Mat3::IDENTITY);
    let camera = Camera::Perspective(Intrinsics::centered(935.0, Vec2::new(1920.0, 1080.0)));
    View::new(
        camera,
        &Affine3A::from_mat3_translation(world_from_view, eye),
    )
}

fn settings() -> LodSettings {
    LodSettings::capped(1.0, 3.0)
}

/// FNV-1a over all units of all instances.
fn hash(hash: u64, units: &[u32]) -> u64 {
    let numbers = units.iter().copied().chain([u32::MAX]);
    numbers.fold(hash, |hash, unit| {
        (hash ^ u64::from(unit)).wrapping_mul(0x0100_0000_01b3)
    })
}

const SEED: u64 = 0xcbf2_9ce4_8422_2325;

fn walk_in_scalars() -> u64 {
    let placements = placements();
    let mut cuts = vec![Cut::default(); placements.len()];
    (0..FRAMES).fold(SEED, |mut sum, frame| {
        for (placement, cut) in placements.iter().zip(&mut cuts) {
            select(ball(), placement, &view(frame), &settings(), cut);
            sum = hash(sum, cut.units());
        }
        sum
    })
}

fn walk_in_lanes() -> u64 {
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(ball());
    let ids: Vec<InstanceId> = placements()
        .into_iter()
        .map(|p| scene.add_instance(mesh, p, 1.0))
        .collect();
    scene.update();
    let mut selector = Selector::default();
    (0..FRAMES).fold(SEED, |mut sum, frame| {
        selector.select(&scene, &view(frame), &settings());
        for &id in &ids {
            sum = hash(sum, selector.units(&scene, id));
        }
        sum
    })
}

#[test]
fn the_cuts_of_a_walk_hash_to_the_committed_number() {
    let sum = walk_in_scalars();
    assert_eq!(
        sum,
        EXPECTED,
        "the cuts of the walk have changed. If that is meant, put {sum:#x} for EXPECTED in {} and say why in the commit",
        file!()
    );
}

#[test]
fn lanes_and_validity_hash_to_it_too() {
    assert_eq!(walk_in_lanes(), EXPECTED);
}

/// Depth images and cuts of a walk past upright grids that hide one another.
fn walk_past_walls() -> u64 {
    let mut scene = Scene::default();
    let grid = scene.add_mesh(&fixtures::grid_pyramid(4));
    let upright = Mat3::from_cols(Vec3::X, Vec3::Z, -Vec3::Y);
    let ids: Vec<InstanceId> = (0..60u16)
        .map(|index| {
            let (x, z) = (f32::from(index % 6), f32::from(index / 6));
            let scale = 0.1 + 0.02 * f32::from(index % 5);
            let place = Vec3::new(x * 2.0 + z * 0.3, 0.5, z * -3.0);
            scene.add_instance(
                grid,
                Affine3A::from_mat3_translation(upright * scale, place),
                1.0,
            )
        })
        .collect();
    scene.update();
    let flux = VisibleFlux::default();
    let settings = LodSettings {
        visible_flux: Some(flux),
        ..LodSettings::default()
    };
    let mut selector = Selector::default();
    (0..60).fold(SEED, |mut sum, frame| {
        let view = view(frame * 5);
        selector.select(&scene, &view, &settings);
        let buffer = OcclusionBuffer::new(&scene, &view, flux.occluder_triangles);
        assert_eq!(
            selector.occlusion().map(OcclusionBuffer::nearness),
            Some(buffer.nearness())
        );
        let bits: Vec<u32> = buffer
            .nearness()
            .iter()
            .map(|texel| texel.to_bits())
            .collect();
        sum = hash(sum, &bits);
        ids.iter()
            .fold(sum, |sum, &id| hash(sum, selector.units(&scene, id)))
    })
}

#[test]
fn depth_images_hash_to_the_committed_number_on_any_thread() {
    let threads: Vec<_> = (0..3)
        .map(|_| std::thread::spawn(walk_past_walls))
        .collect();
    for thread in threads {
        let sum = thread.join().unwrap();
        assert_eq!(
            sum,
            EXPECTED_WITH_FLUX,
            "what hides what has changed. If that is meant, put {sum:#x} for EXPECTED_WITH_FLUX in {} and say why in the commit",
            file!()
        );
    }
}

/// A walk, one that nods harder, and an eye that stands and nods, sways and trembles.
fn paths() -> [(&'static str, fn(u16) -> View); 3] {
    let stand = |frame: u16| {
        let swing = |period: u16| {
            let phase = f32::from(frame % period) / f32::from(period);
            (2.0 * phase - 1.0).abs() - 0.5
        };
        let eye = Vec3::new(8.0 + swing(7) * 0.004, 1.2 + swing(30) * 0.03, 1.0);
        let back = Vec3::new(swing(90) * 0.02, 0.1 + swing(5) * 0.001, 1.0);
        facing(eye, back)
    };
    let nod = |frame: u16| {
        let bob = (f32::from(frame % 24) - 12.0).abs();
        let eye = Vec3::new(
            f32::from(frame) * 0.01,
            1.2 + bob * 0.006,
            6.0 - f32::from(frame) * 0.023,
        );
        facing(eye, Vec3::new(-0.2, 0.1 + bob * 0.0008, 1.0))
    };
    [("walk", view), ("nod", nod), ("stand", stand)]
}

#[test]
fn no_group_flips_back_within_five_frames() {
    for (path, settings) in paths().iter().flat_map(|path| {
        [
            LodSettings::default(),
            LodSettings::guaranteed(1.0),
            settings(),
        ]
        .map(|settings| (path, settings))
    }) {
        let (name, view) = path;
        let placements = placements();
        let mut cuts = vec![Cut::default(); placements.len()];
        let mut last_flip = vec![vec![u16::MAX; ball().groups.len()]; placements.len()];
        let mut flips = 0;
        // Up to the jump.
        for frame in 0..FRAMES / 2 {
            for ((placement, cut), last_flip) in
                placements.iter().zip(&mut cuts).zip(&mut last_flip)
            {
                let before = cut.refined().to_vec();
                select(ball(), placement, &view(frame), &settings, cut);
                for (group, (before, now)) in before.iter().zip(cut.refined()).enumerate() {
                    if before != now {
                        let back = last_flip[group] != u16::MAX && frame - last_flip[group] <= 5;
                        assert!(!back, "{name}: group {group} flipped back in frame {frame}");
                        last_flip[group] = frame;
                        flips += 1;
                    }
                }
            }
        }
        assert!(flips > 100 || *name == "stand", "{name} changes nothing");
    }
}
