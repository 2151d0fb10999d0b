//! Selection of fields of rocks, as whole meshes and as clusters.
//!
//! Run with `cargo bench -p fieldlod_select --bench props`. Arguments after `--` are numbers of rocks,
//! `clusters` for meshes of clusters, and `views` for several views, one after the other and at once.

mod common;

use std::time::{Duration, Instant};

use common::{look_from_afar, look_through, medians};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{
    AdvancedSettings, Cut, InstanceId, LodSettings, Offscreen, Scene, Selector, ShadowLight, View,
    select,
};
use glam::{Affine3A, Quat, Vec2, Vec3};
use rayon::prelude::*;

/// Rocks are this far apart, in their radii.
const SPACING: f32 = 5.0;
const WARM_UP: u32 = 20;
const FRAMES: u32 = 300;
const FIRST_FRAMES: usize = 7;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let has = |word: &str| args.iter().any(|arg| arg == word);
    let mut sizes: Vec<u32> = args.iter().filter_map(|arg| arg.parse().ok()).collect();
    let config = fieldlod_bake::BakeConfig::default();
    let bake = |detail| {
        let rock = fieldlod_bake::fixtures::rock(detail, 1);
        fieldlod_bake::bake_mesh(&rock, &config).unwrap()
    };
    let levels = if has("clusters") {
        bake(6)
    } else {
        bake(4).whole_mesh_levels().unwrap()
    };
    if sizes.is_empty() {
        sizes.extend([1_000, 10_000, 100_000]);
        if !has("clusters") {
            sizes.push(1_000_000);
        }
    }
    if has("views") {
        sizes.iter().for_each(|&size| views(&levels, size));
        return;
    }
    println!("us of the fastest of {FIRST_FRAMES} first frames, then of {FRAMES} frames");
    println!("| rocks | lens | sun | way | first | least | median | most |");
    println!("|---:|---|---|---|---:|---:|---:|---:|");
    for size in sizes {
        let field = Field::new(&levels, size);
        for lens in [Lens::Perspective, Lens::Orthographic] {
            for has_sun in [false, true] {
                for way in [Way::Still, Way::Walk, Way::Turn, Way::Zoom, Way::Jump] {
                    field.measure(&Path { lens, has_sun, way });
                }
            }
        }
    }
}

/// Rocks in a square.
struct Field<'a> {
    levels: &'a Hierarchy,
    scene: Scene,
    placements: Vec<Affine3A>,
    ids: Vec<InstanceId>,
}

impl<'a> Field<'a> {
    fn new(levels: &'a Hierarchy, count: u32) -> Self {
        let mut scene = Scene::default();
        let mesh = scene.add_mesh(levels);
        let side = (count as f32).sqrt().ceil() as u32;
        let place = |index: u32| {
            let cell = Vec2::new((index % side) as f32, (index / side) as f32);
            let at = (cell - Vec2::splat(side as f32 * 0.5)) * SPACING;
            let turn = Quat::from_rotation_y(index as f32);
            Affine3A::from_rotation_translation(turn, Vec3::new(at.x, 0.0, at.y))
        };
        let placements: Vec<Affine3A> = (0..count).map(place).collect();
        let ids = placements
            .iter()
            .map(|at| scene.add_instance(mesh, *at, 1.0))
            .collect();
        scene.update();
        Self {
            levels,
            scene,
            placements,
            ids,
        }
    }

    fn measure(&self, path: &Path) {
        let settings = path.settings();
        let select_at = |selector: &mut Selector, step: u32| {
            let view = path.view(step);
            let start = Instant::now();
            selector.select(&self.scene, &view, &settings);
            start.elapsed()
        };
        // All are kept until the end, so that each gets its memory from the system.
        let mut fresh: [Selector; FIRST_FRAMES] = Default::default();
        let first = fresh.iter_mut().map(|selector| select_at(selector, 0));
        let first = first.min().unwrap_or_default();
        let [selector, ..] = &mut fresh;
        for step in 1..=WARM_UP {
            select_at(selector, step);
        }
        let frames = WARM_UP + 1..=WARM_UP + FRAMES;
        let mut times: Vec<Duration> = frames.map(|step| select_at(selector, step)).collect();
        times.sort_unstable();
        self.check(path);
        let us = |time: Duration| time.as_secs_f64() * 1e6;
        println!(
            "| {} | {:?} | {} | {:?} | {:.1} | {:.1} | {:.1} | {:.1} |",
            self.ids.len(),
            path.lens,
            if path.has_sun { "yes" } else { "no" },
            path.way,
            us(first),
            us(times[0]),
            us(times[times.len() / 2]),
            us(times[times.len() - 1]),
        );
    }

    /// Asserts that the cuts of a first frame are those of one instance at a time, for which all casters count.
    fn check(&self, path: &Path) {
        let settings = path.settings();
        let view = path.view(0);
        let mut selector = Selector::default();
        selector.select(&self.scene, &view, &settings);
        let step = self.ids.len() / 500 + 1;
        for (id, placement) in self.ids.iter().zip(&self.placements).step_by(step) {
            let mut cut = Cut::default();
            select(self.levels, placement, &view, &settings, &mut cut);
            let units = selector.units(&self.scene, *id);
            // Instances that cast no shadow into the view are coarser.
            assert!(units == cut.units() || path.has_sun && units.len() <= cut.units().len());
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Lens {
    Perspective,
    /// From above at a slant.
    Orthographic,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    Still,
    /// On a circle: 1.8 m/s at 60 Hz.
    Walk,
    /// Half a turn in 1.7 s.
    Turn,
    /// Between 60 and 30 degrees, or images 60 and 30 m high, in 3.3 s, while walking.
    Zoom,
    /// To another place in each frame.
    Jump,
}

/// The motion of the camera.
struct Path {
    lens: Lens,
    has_sun: bool,
    way: Way,
}

impl Path {
    const WALK: Self = Self {
        lens: Lens::Perspective,
        has_sun: false,
        way: Way::Walk,
    };

    fn settings(&self) -> LodSettings {
        LodSettings {
            advanced: AdvancedSettings {
                offscreen_margin: 0.1,
                offscreen: if self.has_sun {
                    Offscreen::OnAxis { bias: 0.3 }
                } else {
                    Offscreen::Coarsest
                },
                ..AdvancedSettings::default()
            },
            ..LodSettings::default()
        }
    }

    fn view(&self, step: u32) -> View {
        let walked = match self.way {
            Way::Still | Way::Turn => 0,
            Way::Walk | Way::Zoom => step,
            Way::Jump => step * 977,
        };
        let turn = Quat::from_rotation_y(walked as f32 * -0.03 / 20.0);
        let ahead = match self.way {
            Way::Turn => Quat::from_rotation_y(step as f32 * 0.03),
            _ => turn,
        };
        let zoom = match self.way {
            Way::Zoom => 0.5 + 0.005 * (step % 200).abs_diff(100) as f32,
            _ => 1.0,
        };
        let radius = match self.way {
            Way::Jump => 20.0 + (step % 13) as f32 * 20.0,
            _ => 20.0,
        };
        let eye = turn * Vec3::new(radius, 1.7, 0.0);
        let view = match self.lens {
            Lens::Perspective => {
                look_through(60.0 * zoom, eye, eye + ahead * Vec3::new(0.0, -0.05, 1.0))
            }
            Lens::Orthographic => {
                let slant = ahead * Vec3::new(0.0, -1.0, 1.0);
                look_from_afar(60.0 * zoom, eye - slant * 100.0, eye)
            }
        };
        let sun = ShadowLight::Sun(Vec3::new(-1.0, -0.8, -0.3).normalize());
        let lights = if self.has_sun { &[sun][..] } else { &[] };
        view.with_shadow_lights(lights)
    }
}

/// Several views along the walk, one after the other and each on a thread of a pool.
fn views(levels: &Hierarchy, size: u32) {
    let field = Field::new(levels, size);
    let settings = LodSettings::default();
    for count in [1, 2, 4] {
        let new = || (0..count).map(|view| (view * 1000, Selector::default()));
        let (mut in_turn, mut at_once): (Vec<_>, Vec<_>) = (new().collect(), new().collect());
        let select = |step: u32, (ahead, selector): &mut (u32, Selector)| {
            selector.select(&field.scene, &Path::WALK.view(step + *ahead), &settings);
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
        println!("{size:8} rocks, {count} views: {in_turn:.1} us in turn, {at_once:.1} at once");
    }
}
