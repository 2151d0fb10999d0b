//! Cost of visible flux: run with `cargo bench -p fieldlod_select --bench visible_flux`.
//!
//! Medians of interleaved rounds, in microseconds.

mod common;

use std::hint::black_box;
use std::time::Duration;

use common::{look, medians, settings};
use fieldlod_select::{LodSettings, OcclusionBuffer, Scene, Selector, VisibleFlux};
use glam::{Affine3A, Vec3};

/// A field of `count` rocks.
fn field_of_rocks(count: u32) -> Scene {
    let config = fieldlod_bake::BakeConfig::default();
    let bake = |mesh| fieldlod_bake::bake_mesh(&mesh, &config).unwrap();
    let mut scene = Scene::default();
    let rock = bake(fieldlod_bake::fixtures::rock(5, 1));
    let whole = scene.add_mesh(&rock.whole_mesh_levels().unwrap());
    let rock = scene.add_mesh(&rock);
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
    scene
}

fn main() {
    println!(
        "\ninstances  depth image us  from scratch us  with flux us  walking us  with flux us  still ns  triangles  with flux"
    );
    let flux = VisibleFlux::default();
    let plain = settings();
    let counting = LodSettings {
        visible_flux: Some(flux),
        ..plain
    };
    for count in [1_000, 10_000, 100_000] {
        let scene = field_of_rocks(count);
        let middle = (count as f32).sqrt() * 3.0;
        let at = |step: u32| {
            let eye = Vec3::new(middle + step as f32 * 0.03, 1.6, 6.0);
            look(eye, eye + Vec3::new(0.3, -0.05, -1.0))
        };
        let step = std::cell::Cell::new(0);
        let next = || step.replace(step.get() + 1);
        let [mut fresh, mut fresh_flux, mut kept, mut kept_flux] =
            [const { None }; 4].map(Option::<Selector>::unwrap_or_default);
        let [image, scratch, scratch_flux, walking, walking_flux] = medians(
            60,
            [
                &mut || {
                    let buffer = OcclusionBuffer::new(&scene, &at(next()), flux.occluder_triangles);
                    black_box(&buffer);
                },
                &mut || {
                    fresh.clear();
                    fresh.select(&scene, &at(step.get()), &plain);
                },
                &mut || {
                    fresh_flux.clear();
                    fresh_flux.select(&scene, &at(step.get()), &counting);
                },
                &mut || kept.select(&scene, &at(step.get()), &plain),
                &mut || kept_flux.select(&scene, &at(step.get()), &counting),
            ],
        );
        let triangles = [kept.triangle_count(), kept_flux.triangle_count()];
        // After these frames no share is held, and a still view costs no selection.
        for _ in 0..=2 * u32::from(flux.hold_frames) {
            kept_flux.select(&scene, &at(step.get()), &counting);
        }
        let [still] = medians(
            60,
            [&mut || kept_flux.select(&scene, &at(step.get()), &counting)],
        );
        assert_eq!(
            kept_flux.statistics(),
            fieldlod_select::Statistics::default()
        );
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
