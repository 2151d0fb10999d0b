//! Cost of visible flux: run with `cargo bench -p fieldlod_flux`.
//!
//! Medians of interleaved rounds, in microseconds.

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use camera_field::Camera;
use fieldlod_flux::{DepthImage, FluxSettings, Occluder, Occluders, VisibleFlux};
use fieldlod_select::{LodSettings, Scene, Selector, Statistics, View};
use glam::{Affine3A, Mat4, Vec2, Vec3};

/// The threshold with the image error of clusterlod at 1 px, by `fieldlod_lab/RECORD.md`.
const ERROR_PX: f32 = 1.37;

fn look(eye: Vec3, target: Vec3) -> View {
    let projection = Mat4::perspective_infinite_reverse_rh(60f32.to_radians(), 16.0 / 9.0, 0.1);
    let camera = Camera::from_projection(&projection, Vec2::new(1920.0, 1080.0)).unwrap();
    let world_from_view = Mat4::look_at_rh(eye, target, Vec3::Y).inverse();
    View::new(camera, &Affine3A::from_mat4(world_from_view))
}

/// Median times of several functions, run in turns.
fn medians<const N: usize>(mut functions: [&mut dyn FnMut(); N]) -> [Duration; N] {
    let mut times = [const { Vec::new() }; N];
    for _ in 0..60 {
        for (function, times) in functions.iter_mut().zip(&mut times) {
            let start = Instant::now();
            function();
            times.push(start.elapsed());
        }
    }
    times.map(|mut times| {
        times.sort_unstable();
        times[times.len() / 2]
    })
}

/// The selection of one view, with visible flux.
#[derive(Default)]
struct Eye {
    flux: VisibleFlux,
    selector: Selector,
}

impl Eye {
    fn select(&mut self, (scene, occluders): &(Scene, Occluders), view: &View) {
        let settings = LodSettings::with_error_px(ERROR_PX);
        let mut weights = self.flux.look(scene, view, occluders);
        self.selector
            .select_weighed(scene, view, &settings, &mut weights);
    }
}

/// A field of `count` rocks.
fn field_of_rocks(count: u32) -> (Scene, Occluders) {
    let config = fieldlod_bake::BakeConfig::default();
    let bake = |mesh| fieldlod_bake::bake_mesh(&mesh, &config).unwrap();
    let (mut scene, mut occluders) = (Scene::default(), Occluders::default());
    let mut add = |hierarchy| {
        let mesh = scene.add_mesh(&hierarchy);
        occluders.set_mesh(mesh, Some(Arc::new(Occluder::new(&hierarchy))));
        mesh
    };
    let rock = bake(fieldlod_bake::fixtures::rock(5, 1));
    let whole = add(rock.whole_mesh_levels().unwrap());
    let rock = add(rock);
    let side = (count as f32).sqrt().ceil() as u32;
    for index in 0..count {
        let (x, z) = ((index % side) as f32, (index / side) as f32);
        let nudge = ((index.wrapping_mul(40_503) & 0xffff) >> 8) as f32 / 256.0;
        let place = Vec3::new(x * 6.0 + nudge * 3.0, 0.0, z * -6.0);
        // One in seven is large.
        let (mesh, size) = if index % 7 == 0 {
            (rock, 2.0)
        } else {
            (whole, 0.9)
        };
        let placement = Affine3A::from_translation(place) * Affine3A::from_scale(Vec3::splat(size));
        scene.add_instance(mesh, placement, 1.0);
    }
    scene.update();
    (scene, occluders)
}

fn main() {
    println!(
        "\ninstances  depth image us  from scratch us  with flux us  walking us  with flux us  still ns  triangles  with flux"
    );
    let flux = FluxSettings::default();
    let plain = LodSettings::with_error_px(ERROR_PX);
    for count in [1_000, 10_000, 100_000] {
        let field = field_of_rocks(count);
        let (scene, occluders) = &field;
        let middle = (count as f32).sqrt() * 3.0;
        let at = |step: u32| {
            let eye = Vec3::new(middle + step as f32 * 0.03, 1.6, 6.0);
            look(eye, eye + Vec3::new(0.3, -0.05, -1.0))
        };
        let step = std::cell::Cell::new(0);
        let next = || step.replace(step.get() + 1);
        let [mut fresh, mut kept] = [Selector::default(), Selector::default()];
        let [mut fresh_eye, mut kept_eye] = [Eye::default(), Eye::default()];
        let [image, scratch, scratch_flux, walking, walking_flux] = medians([
            &mut || {
                let image = DepthImage::new(scene, &at(next()), occluders, flux.occluder_triangles);
                black_box(&image);
            },
            &mut || {
                fresh.clear();
                fresh.select(scene, &at(step.get()), &plain);
            },
            &mut || {
                fresh_eye.selector.clear();
                fresh_eye.select(&field, &at(step.get()));
            },
            &mut || kept.select(scene, &at(step.get()), &plain),
            &mut || kept_eye.select(&field, &at(step.get())),
        ]);
        let triangles = [kept.triangle_count(), kept_eye.selector.triangle_count()];
        // After these frames no share is held, and a still view costs no selection.
        for _ in 0..=2 * u32::from(flux.hold_frames) {
            kept_eye.select(&field, &at(step.get()));
        }
        let [still] = medians([&mut || kept_eye.select(&field, &at(step.get()))]);
        assert_eq!(kept_eye.selector.statistics(), Statistics::default());
        let us = |time: Duration| time.as_secs_f64() * 1e6;
        println!(
            "{count:9}  {:14.1}  {:15.1}  {:12.1}  {:10.1}  {:12.1}  {:8.0}  {:9}  {:9}",
            us(image),
            us(scratch),
            us(scratch_flux),
            us(walking),
            us(walking_flux),
            us(still) * 1e3,
            triangles[0],
            triangles[1]
        );
    }
}
