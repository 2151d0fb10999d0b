//! Hashes of walks: the same cuts in debug and release, in scalars and lanes, on every machine.

mod common;

use camera_field::{CAMERA_FROM_VIEW, Camera, Intrinsics};
use common::synthetic;
use fieldlod_select::{Cut, InstanceId, LodSettings, Scene, Selector, View, select};
use glam::{Affine3A, Mat3, Vec2, Vec3};

const EXPECTED: u64 = 0x1e4f_5576_231b_1e1b;
const FRAMES: u16 = 600;

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

/// FNV-1a over all units of all instances.
fn hash(hash: u64, units: &[u32]) -> u64 {
    let numbers = units.iter().copied().chain([u32::MAX]);
    numbers.fold(hash, |hash, unit| {
        (hash ^ u64::from(unit)).wrapping_mul(0x0100_0000_01b3)
    })
}

const SEED: u64 = 0xcbf2_9ce4_8422_2325;

/// The cuts by [`select`], and by a [`Selector`].
fn walk_hashes() -> [u64; 2] {
    let mut scene = Scene::default();
    let ball = synthetic::ball(4, 0.002);
    let mesh = scene.add_mesh(&ball);
    let placements = placements();
    let add = |placement: &Affine3A| scene.add_instance(mesh, *placement, 1.0);
    let ids: Vec<InstanceId> = placements.iter().map(add).collect();
    scene.update();
    let settings = LodSettings {
        displacement_px: Some(3.0),
        ..LodSettings::default()
    };
    let mut cuts = vec![Cut::default(); placements.len()];
    let mut selector = Selector::default();
    (0..FRAMES).fold([SEED; 2], |mut sums, frame| {
        selector.select(&scene, &view(frame), &settings);
        for ((placement, id), cut) in placements.iter().zip(&ids).zip(&mut cuts) {
            select(&ball, placement, &view(frame), &settings, cut);
            let units = [cut.units(), selector.units(&scene, *id)];
            sums = [0, 1].map(|which| hash(sums[which], units[which]));
        }
        sums
    })
}

#[test]
fn walk_cuts_hash_to_the_committed_number() {
    let [scalar, lanes] = walk_hashes();
    assert_eq!(
        scalar,
        EXPECTED,
        "the cuts of the walk have changed. If that is intended, set EXPECTED in {} to {scalar:#x} and say why in the commit",
        file!()
    );
    assert_eq!(lanes, EXPECTED);
}
