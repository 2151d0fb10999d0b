//! Figure 18: layered depth images made at the convergent point and at the average position.
//!
//! The paper compares one number of samples for each of ten pairs of parallel cameras in two
//! scenes, and does not say which focal length the camera at the average position has. We count for
//! both sensible answers, and also for pairs that are not parallel, which the paper leaves open.

use std::path::Path;

use camera_field::double::PosedCamera;
use fieldlod_hierarchy::fixtures::Random;
use glam::{DVec2, DVec3, dvec2, dvec3};
use serde::Serialize;

use super::ldi_set::{CameraSet, Placement, SetResult, between};
use super::scene::{Scene, Solid};
use crate::canvas::{Align, Canvas, Color, Rect};
use crate::files::WriteError;
use crate::plot::{Axis, Plot, draw_legend};

const SETS: u32 = 10;
/// Pairs beyond those of the figure, from other seeds: ten are few to judge by.
const FURTHER_SETS: u32 = 40;
/// Widest turn of each camera of a pair that is not parallel; the least is a quarter of it.
const MOST_TOE_IN_DEG: f64 = 12.0;

/// The numbers of figure 18, for two scenes each.
#[derive(Clone, Debug, Serialize)]
pub struct Figure18 {
    /// Ten pairs of parallel cameras, as in the paper.
    pub parallel: [SceneResult; 2],
    /// Forty further pairs of parallel cameras.
    pub parallel_further: [Comparisons; 2],
    /// Ten pairs that turn towards each other by 3° to 12° each.
    pub not_parallel: [SceneResult; 2],
    /// Forty further pairs that are not parallel.
    pub not_parallel_further: [Comparisons; 2],
}

/// Ten pairs of cameras in one scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneResult {
    /// Name of the scene.
    pub scene: &'static str,
    /// All pairs together.
    pub all: Comparisons,
    /// Each pair.
    pub sets: Vec<SetResult>,
}

/// The convergent point against the average position.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Comparisons {
    /// The camera at the average position has the same focal length.
    pub same_focal: Comparison,
    /// The camera at the average position has the same density on the plane at the mean depth.
    pub same_density: Comparison,
}

impl Comparisons {
    fn new(sets: &[SetResult]) -> Self {
        Self {
            same_focal: Comparison::new(sets, |set| set.merged.average_same_focal),
            same_density: Comparison::new(sets, |set| set.merged.average_same_density),
        }
    }
}

/// Samples merged at the convergent point against the average position.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Comparison {
    /// Pairs of cameras.
    pub sets: usize,
    /// Pairs for which the convergent point merges fewer.
    pub fewer_in: usize,
    /// Per cent by which fewer merge, mean over the pairs; negative if more do.
    pub mean_fewer_percent: f64,
    /// The same per cent of the pair with the least.
    pub least_fewer_percent: f64,
    /// The same per cent of the pair with the most.
    pub greatest_fewer_percent: f64,
}

impl Comparison {
    fn new(sets: &[SetResult], average: impl Fn(&SetResult) -> f64) -> Self {
        let fewer = |set: &SetResult| 100.0 * (1.0 - set.merged.convergent_point / average(set));
        let percents: Vec<f64> = sets.iter().map(fewer).collect();
        Self {
            sets: sets.len(),
            fewer_in: percents.iter().filter(|&&percent| percent > 0.0).count(),
            mean_fewer_percent: percents.iter().sum::<f64>() / percents.len() as f64,
            least_fewer_percent: percents.iter().copied().fold(f64::INFINITY, f64::min),
            greatest_fewer_percent: percents.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

/// A scene, where its cameras look and how their headings spread.
struct Example {
    name: &'static str,
    scene: Scene,
    target: DVec3,
    headings: f64,
    seed: u64,
}

fn examples() -> [Example; 2] {
    [
        Example {
            name: "stage",
            scene: Scene::stage(),
            target: dvec3(0.0, 0.2, 11.0),
            headings: 0.0,
            seed: 1,
        },
        Example {
            name: "plaza",
            scene: Scene::plaza(),
            target: dvec3(0.0, 0.2, 0.0),
            headings: core::f64::consts::TAU,
            seed: 2,
        },
    ]
}

impl Example {
    fn run(&self, sets: u32, seed: u64, most_toe_in: f64) -> Vec<CameraSet> {
        let mut random = Random::new(seed);
        (0..sets)
            .map(|_| {
                // A heading and a target of its own for each pair.
                let heading = self.headings * f64::from(random.unit());
                let target = self.target + DVec3::X * between(&mut random, -1.0, 1.0);
                let placement = Placement {
                    target,
                    heading,
                    most_toe_in,
                };
                CameraSet::new(&self.scene, placement, &mut random)
            })
            .collect()
    }

    fn result(&self, sets: &[CameraSet]) -> SceneResult {
        let sets = results(sets);
        SceneResult {
            scene: self.name,
            all: Comparisons::new(&sets),
            sets,
        }
    }

    fn further(&self, most_toe_in: f64) -> Comparisons {
        let sets = self.run(FURTHER_SETS, self.seed + 100, most_toe_in);
        Comparisons::new(&results(&sets))
    }
}

fn results(sets: &[CameraSet]) -> Vec<SetResult> {
    sets.iter().map(|set| set.result).collect()
}

pub(super) fn draw(path: &Path) -> Result<Figure18, WriteError> {
    // The paper's comparison, drawn.
    let examples = examples();
    let mut canvas = Canvas::new(1300, 1010);
    let parallel = [0, 1].map(|row| {
        let sets = examples[row].run(SETS, examples[row].seed, 0.0);
        let result = examples[row].result(&sets);
        draw_row(
            &mut canvas,
            500.0 * row as f64,
            &examples[row],
            &sets,
            &result,
        );
        result
    });
    canvas.save(path)?;
    // What the paper leaves open, in numbers alone.
    let toe_in = MOST_TOE_IN_DEG.to_radians();
    let each = |index: usize| &examples[index];
    Ok(Figure18 {
        parallel,
        parallel_further: [0, 1].map(|index| each(index).further(0.0)),
        not_parallel: [0, 1].map(|index| {
            let sets = each(index).run(SETS, each(index).seed, toe_in);
            each(index).result(&sets)
        }),
        not_parallel_further: [0, 1].map(|index| each(index).further(toe_in)),
    })
}

fn draw_row(
    canvas: &mut Canvas,
    top: f64,
    example: &Example,
    sets: &[CameraSet],
    result: &SceneResult,
) {
    let view = Rect::new(20.0, top + 40.0, 400.0, 400.0);
    draw_top_view(canvas, view, example, sets);
    draw_references(canvas, dvec2(440.0, top + 40.0), &example.scene, &sets[0]);
    draw_chart(canvas, top, result);
}

/// The scene from above, all cameras, and the frusta of the first pair.
fn draw_top_view(canvas: &mut Canvas, area: Rect, example: &Example, sets: &[CameraSet]) {
    let title = format!("{}, from above", example.name);
    canvas.title(dvec2(area.center().x, area.min.y - 18.0), &title);
    let middle = if example.headings > 0.0 {
        DVec3::ZERO
    } else {
        DVec3::Z * 8.0
    };
    let scale = area.size.x / 25.0;
    let place = |p: DVec3| area.center() + dvec2(p.x - middle.x, middle.z - p.z) * scale;
    // The solids, but for floors and long walls seen from above.
    canvas.clip_to(Some(area));
    for solid in &example.scene.solids {
        match *solid {
            Solid::Sphere { center, radius } => {
                canvas.dot(place(center), radius * scale, Color::GRAY);
            }
            Solid::Box { min, max } if max.x - min.x < 20.0 || max.z - min.z < 2.0 => {
                let (near, far) = (place(min), place(max));
                let (least, greatest) = (near.min(far), near.max(far));
                let size = greatest - least;
                canvas.fill(Rect { min: least, size }, Color::GRAY);
            }
            Solid::Box { .. } => {}
        }
    }
    // The first pair's views, and the places of all cameras.
    for camera in &sets[0].references {
        draw_frustum(canvas, camera, place);
    }
    for set in sets {
        let [a, b] = set.references.map(|camera| place(camera.pose.origin));
        canvas.line(a, b, 1.0, Color::GRAY);
        canvas.dot(a, 3.5, Color::INK);
        canvas.dot(b, 3.5, Color::INK);
        canvas.dot(place(set.average), 3.0, Color::ORANGE);
        canvas.dot(place(set.convergent), 3.5, Color::BLUE);
    }
    canvas.clip_to(None);
    canvas.frame(area, Color::PALE);
    let below = dvec2(area.center().x, area.max().y + 14.0);
    let text = "cameras; convergent (blue), average (orange)";
    canvas.caption(below, text);
}

fn draw_frustum(canvas: &mut Canvas, camera: &PosedCamera, place: impl Fn(DVec3) -> DVec2) {
    let edge = |slope: f64| place(camera.pose.to_world(dvec3(slope, 0.0, 1.0) * 18.0));
    let (left, right) = (camera.intrinsics.slope_min.x, camera.intrinsics.slope_max.x);
    let apex = place(camera.pose.origin);
    canvas.polygon(&[apex, edge(left), edge(right)], Color::BLUE.faded(28));
    canvas.polyline(&[edge(left), apex, edge(right)], 1.0, Color::BLUE);
}

/// The two images of the first pair, one below the other.
fn draw_references(canvas: &mut Canvas, corner: DVec2, scene: &Scene, set: &CameraSet) {
    let middle = corner + dvec2(120.0, -18.0);
    canvas.title(middle, "first pair");
    for (index, camera) in set.references.iter().enumerate() {
        let image = camera.intrinsics.image_px().round();
        let at = corner + dvec2(0.0, 200.0 * index as f64);
        // Light from one side, darker with depth.
        let hits = scene.capture(camera);
        canvas.shade(
            Rect {
                min: at,
                size: image,
            },
            |pixel| {
                let index = pixel.y as usize * image.x as usize + pixel.x as usize;
                hits[index].map_or(Color::WHITE, |hit| {
                    let light = dvec3(-0.5, -0.8, -0.3).normalize();
                    let facing = 0.5 + 0.5 * hit.normal.dot(light);
                    let depth = camera.pose.to_camera(hit.position).z;
                    Color::gray((0.25 + 0.75 * facing) * (1.0 - 0.02 * depth).max(0.3))
                })
            },
        );
    }
}

/// Merged samples of each pair, in per cent of all.
fn draw_chart(canvas: &mut Canvas, top: f64, result: &SceneResult) {
    let chart = Plot {
        area: Rect::new(760.0, top + 60.0, 500.0, 270.0),
        x: Axis::linear("pair of cameras", 0.0..=11.0, 1.0, 0),
        y: Axis::linear("samples merged, % of all", 0.0..=60.0, 10.0, 0),
    };
    chart.draw_frame(canvas);
    // Three bars for each pair.
    for (index, set) in result.sets.iter().enumerate() {
        let merged = set.merged;
        let bars = [
            (merged.convergent_point, Color::BLUE),
            (merged.average_same_focal, Color::ORANGE),
            (merged.average_same_density, Color::GRAY),
        ];
        for (bar, (count, color)) in bars.into_iter().enumerate() {
            let x = index as f64 + 0.64 + 0.24 * bar as f64;
            let percent = 100.0 * count / set.samples as f64;
            let corners = [(x, 0.0), (x + 0.22, 0.0), (x + 0.22, percent), (x, percent)];
            canvas.polygon(&corners.map(|(x, y)| chart.place(dvec2(x, y))), color);
        }
    }
    let names = [
        ("at the convergent point", Color::BLUE),
        ("at the average, same focal length", Color::ORANGE),
        ("at the average, same density", Color::GRAY),
    ];
    draw_legend(canvas, dvec2(760.0, top + 396.0), &names);
    // What they come to.
    let text = |comparison: &Comparison| {
        let Comparison {
            fewer_in,
            sets,
            mean_fewer_percent,
            ..
        } = comparison;
        format!("fewer in {fewer_in} of {sets}, mean {mean_fewer_percent:.1} %")
    };
    let at = dvec2(1270.0, top + 416.0);
    canvas.text(at, Align::Right, &text(&result.all.same_focal), Color::INK);
    let at = dvec2(1270.0, top + 436.0);
    canvas.text(
        at,
        Align::Right,
        &text(&result.all.same_density),
        Color::INK,
    );
}
