//! Hash of a walk: the same depth images and cuts in debug and release, on every machine.

mod common;

use camera_field::{Camera, Intrinsics};
use common::add_mesh;
use fieldlod_flux::{Occluders, VisibleFlux};
use fieldlod_hierarchy::fixtures;
use fieldlod_select::{InstanceId, LodSettings, Scene, Selector, View};
use glam::{Affine3A, Mat3, Vec2, Vec3};

const EXPECTED: u64 = 0x9239_b842_e46f_0154;
/// The offset basis of FNV-1a.
const SEED: u64 = 0xcbf2_9ce4_8422_2325;

/// FNV-1a.
fn hash(hash: u64, numbers: impl Iterator<Item = u32>) -> u64 {
    let bytes = numbers.chain([u32::MAX]).flat_map(u32::to_le_bytes);
    bytes.fold(hash, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    })
}

/// A slow walk forward and sideways.
fn view(frame: u16) -> View {
    let step = f32::from(frame) * 5.0;
    let eye = Vec3::new(step * 0.01, 1.2, 6.0 - step * 0.03);
    let camera = Camera::Perspective(Intrinsics::centered(935.0, Vec2::new(1920.0, 1080.0)));
    View::new(camera, &Affine3A::from_translation(eye))
}

/// Depth images and cuts of a walk past upright grids that hide one another.
fn walk_past_walls() -> u64 {
    let (mut scene, mut occluders) = (Scene::default(), Occluders::default());
    let grid = add_mesh(&mut scene, &mut occluders, &fixtures::grid_pyramid(4));
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
    let (mut flux, mut selector) = (VisibleFlux::default(), Selector::default());
    (0..60u16).fold(SEED, |mut sum, frame| {
        let view = view(frame);
        let mut weights = flux.look(&scene, &view, &occluders);
        selector.select_weighed(&scene, &view, &LodSettings::default(), &mut weights);
        let nearness = flux.depth_image().unwrap().nearness().iter();
        sum = hash(sum, nearness.map(|texel| texel.to_bits()));
        ids.iter().fold(sum, |sum, &id| {
            hash(sum, selector.units(&scene, id).iter().copied())
        })
    })
}

#[test]
fn depth_images_have_committed_hash_on_any_thread() {
    let threads: Vec<_> = (0..3)
        .map(|_| std::thread::spawn(walk_past_walls))
        .collect();
    for thread in threads {
        let sum = thread.join().unwrap();
        assert_eq!(
            sum,
            EXPECTED,
            "the depth images or their cuts have changed. If that is intended, set EXPECTED in {} to {sum:#x} and say why in the commit",
            file!()
        );
    }
}
