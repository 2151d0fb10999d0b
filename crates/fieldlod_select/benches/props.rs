//! Selection of props, each drawn as a whole at one level: run with
//! `cargo bench -p fieldlod_select --bench props`; sizes of the field may follow. `-- views` selects for several views, one
//! after the other and at once.
//!
//! The field and the walk of the whole-frame bench of the repository, without Bevy.

mod common;

use std::time::{Duration, Instant};

use common::{look_from_afar, look_through, medians};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{LodSettings, Offscreen, Scene, Selector, ShadowLight, Statistics, View};
use glam::{Affine3A, Quat, Vec2, Vec3};
use rayon::prelude::*;

/// Props are this far apart, in their radii.
const SPACING: f32 = 5.0;
const WARM_UP: u32 = 120;
const FRAMES: u32 = 600;

fn main() {
    let mut sizes: Vec<u32> = std::env::args()
        .filter_map(|arg| arg.parse().ok())
        .collect();
    if sizes.is_empty() {
        sizes.extend([10_000, 100_000, 1_000_000]);
    }
    let config = fieldlod_bake::BakeConfig::default();
    let rock = fieldlod_bake::bake_mesh(&fieldlod_bake::fixtures::rock(4, 1), &config).unwrap();
    let levels = rock.whole_mesh_levels().unwrap();
    if std::env::args().any(|arg| arg == "views") {
        sizes.iter().for_each(|&size| views(&levels, size));
        return;
    }
    println!(
        "props, casters: first us, walking mean us, median us, most us; tested, decided, changes a frame"
    );
    for size in sizes {
        let scene = field(&levels, size, Vec3::ONE);
        for lens in [Lens::Perspective, Lens::Orthographic] {
            for has_sun in [false, true] {
                for zooms in [false, true] {
                    let path = Path {
                        lens,
                        has_sun,
                        zooms,
                    };
                    measure(&scene, size, &path);
                }
            }
        }
        let stretched = field(&levels, size, Vec3::new(1.0, 1.3, 1.0));
        print!("stretched");
        measure(&stretched, size, &Path::WALK);
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Lens {
    Perspective,
    /// From above at a slant.
    Orthographic,
}

/// How the camera goes.
struct Path {
    lens: Lens,
    has_sun: bool,
    zooms: bool,
}

impl Path {
    const WALK: Self = Self {
        lens: Lens::Perspective,
        has_sun: false,
        zooms: false,
    };
}

/// Several views along the walk, one after the other and each on a thread of a pool.
fn views(levels: &Hierarchy, size: u32) {
    let scene = field(levels, size, Vec3::ONE);
    let settings = LodSettings::default();
    for count in [1, 2, 4] {
        let new = || (0..count).map(|view| (view * 1000, Selector::default()));
        let (mut in_turn, mut at_once): (Vec<_>, Vec<_>) = (new().collect(), new().collect());
        let select = |step: u32, (ahead, selector): &mut (u32, Selector)| {
            selector.select(&scene, &Path::WALK.view(step + *ahead), &settings);
        };
        let (mut step, mut other_step) = (0, 0);
        let mut frame_in_turn = || {
            step += 1;
            in_turn.iter_mut().for_each(|view| select(step, view));
        };
        let mut frame_at_once = || {
            other_step += 1;
            let views = at_once.par_iter_mut();
            views.for_each(|view| select(other_step, view));
        };
        for _ in 0..WARM_UP {
            frame_in_turn();
            frame_at_once();
        }
        let times = medians(FRAMES as usize, [&mut frame_in_turn, &mut frame_at_once]);
        let [in_turn, at_once] = times.map(|time| time.as_secs_f64() * 1e6);
        println!("{size:8} props, {count} views: {in_turn:.1} us in turn, {at_once:.1} at once");
    }
}

fn measure(scene: &Scene, size: u32, path: &Path) {
    let settings = LodSettings {
        offscreen_margin: 0.1,
        offscreen: if path.has_sun {
            Offscreen::OnAxis { bias: 0.3 }
        } else {
            Offscreen::Coarsest
        },
        ..LodSettings::default()
    };
    let mut selector = Selector::default();
    let start = Instant::now();
    selector.select(scene, &path.view(0), &settings);
    let first = start.elapsed();
    let mut times = Vec::new();
    let mut sums = [0usize; 3];
    for step in 1..=WARM_UP + FRAMES {
        let view = path.view(step);
        let start = Instant::now();
        selector.select(scene, &view, &settings);
        let time = start.elapsed();
        if step > WARM_UP {
            times.push(time);
            let Statistics {
                instances_tested,
                instances_decided,
                ..
            } = selector.statistics();
            let changes = selector.changes().count();
            let counts = [instances_tested, instances_decided, changes];
            sums.iter_mut()
                .zip(counts)
                .for_each(|(sum, one)| *sum += one);
        }
    }
    times.sort_unstable();
    let us = |time: Duration| time.as_secs_f64() * 1e6;
    let mean = us(times.iter().sum()) / f64::from(FRAMES);
    let a_frame = sums.map(|sum| sum as f64 / f64::from(FRAMES));
    println!(
        "{size:8} {:12} {:8} {:8} {:9.1} {mean:9.1} {:9.1} {:9.1}   {a_frame:.1?} {}",
        match path.lens {
            Lens::Perspective => "perspective",
            Lens::Orthographic => "orthographic",
        },
        if path.has_sun { "a sun" } else { "none" },
        if path.zooms { "zooming" } else { "" },
        us(first),
        us(times[times.len() / 2]),
        us(times[times.len() - 1]),
        selector.triangle_count(),
    );
}

/// Props in a square, each stretched alike.
fn field(levels: &Hierarchy, count: u32, scale: Vec3) -> Scene {
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(levels);
    let side = (count as f32).sqrt().ceil() as u32;
    for index in 0..count {
        let cell = Vec2::new((index % side) as f32, (index / side) as f32);
        let at = (cell - Vec2::splat(side as f32 * 0.5)) * SPACING;
        let turn = Quat::from_rotation_y(index as f32);
        let at = Vec3::new(at.x, 0.0, at.y);
        let placement = Affine3A::from_scale_rotation_translation(scale, turn, at);
        scene.add_instance(mesh, placement, 1.0);
    }
    scene.update();
    scene
}

impl Path {
    /// A brisk walk on a wide circle: 1.8 m/s at 60 Hz. The lens zooms to and fro between 60 and 30 degrees in 3.3 s,
    /// if it does; an orthographic one between images 60 and 30 m high.
    fn view(&self, step: u32) -> View {
        let turn = Quat::from_rotation_y(step as f32 * -0.03 / 20.0);
        let to_and_fro = (step % 200).abs_diff(100) as f32 * 0.01;
        let zoom = if self.zooms {
            0.5 + 0.5 * to_and_fro
        } else {
            1.0
        };
        let eye = turn * Vec3::new(20.0, 1.7, 0.0);
        let view = match self.lens {
            Lens::Perspective => {
                look_through(60.0 * zoom, eye, eye + turn * Vec3::new(0.0, -0.05, 1.0))
            }
            Lens::Orthographic => {
                let slant = turn * Vec3::new(0.0, -1.0, 1.0);
                look_from_afar(60.0 * zoom, eye - slant * 100.0, eye)
            }
        };
        let sun = ShadowLight::Sun(Vec3::new(-1.0, -0.8, -0.3).normalize());
        let lights = if self.has_sun { &[sun][..] } else { &[] };
        view.with_shadow_lights(lights)
    }
}
