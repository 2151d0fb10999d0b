//! Figure 18: layered depth images made at the convergent point and at the average position (§4.2.3).
//!
//! Two reference cameras sample a scene. Samples inside both frusta are projected into one camera; of those
//! that fall into one of its pixels at nearly the same depth, all but one are merged away. The paper compares
//! one number of samples for each of ten pairs of parallel cameras in two scenes. It does not say which focal
//! length the camera at the average position has. This figure counts for both sensible answers, and also for
//! pairs that are not parallel, which the paper leaves open.
//!
//! `cargo run -p camera_field --example figure_18 -- paper-out`
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "drawing takes angles and allocates; selection does not run here"
)]

mod drawing;

use core::f64::consts::TAU;
use std::path::Path;

use camera_field::double::{
    FieldLine, Intrinsics, ParallelCamera, Pose, PosedCamera, compound_field, convergent_point,
    equivalent_camera,
};
use drawing::{
    Area, Fallible, GRAY, INK, OTHER, OURS, Random, Series, curve, dot, fill, flat, graph,
    out_folder, picture, plane, save,
};
use glam::{DVec2, DVec3, dvec2, dvec3};
use plotters::chart::SeriesLabelPosition;
use plotters::style::Color;

/// Pairs of the figure, and further pairs from other seeds: ten are few to judge by.
const PAIRS: u32 = 10;
const FURTHER_PAIRS: u32 = 40;
/// Greatest turn of each camera of a pair that is not parallel; the least is a quarter of it.
const MOST_TOE_IN_DEG: f64 = 12.0;
/// Samples closer than this share of their depth are taken for one piece of surface.
const SAME_DEPTH: f64 = 0.02;
/// Shifts of the pixel grid over which counts are averaged: otherwise chance alignment of the grids decides.
const GRID_SHIFTS: u32 = 8;

/// Samples merged at the convergent point against the average position, over pairs of cameras.
#[derive(Clone, Copy, Debug)]
struct Comparison {
    pairs: usize,
    /// Pairs for which the convergent point merges fewer.
    fewer_in: usize,
    /// Per cent by which fewer merge, mean over the pairs.
    mean_fewer_percent: f64,
}

/// The comparisons of pairs in one scene: the camera at the average position has the same focal length, or
/// the same density on the plane at the mean depth.
#[derive(Clone, Copy, Debug)]
struct Comparisons {
    same_focal: Comparison,
    same_density: Comparison,
}

/// All pairs in one scene.
#[derive(Clone, Copy, Debug)]
struct SceneResult {
    name: &'static str,
    parallel: Comparisons,
    parallel_further: Comparisons,
    not_parallel: Comparisons,
    not_parallel_further: Comparisons,
}

fn main() -> Fallible {
    println!("samples merged at the convergent point against the average position");
    for scene in figure(&out_folder()?)? {
        for (name, found) in [
            ("parallel", scene.parallel),
            ("parallel, further", scene.parallel_further),
            ("not parallel", scene.not_parallel),
            ("not parallel, further", scene.not_parallel_further),
        ] {
            println!(
                "  {}, {name}: same focal length {}; same density {}",
                scene.name,
                found.same_focal.text(),
                found.same_density.text()
            );
        }
    }
    Ok(())
}

impl Comparison {
    fn new(pairs: &[Pair], average: impl Fn(&Merged) -> f64) -> Self {
        let fewer = |pair: &Pair| 100.0 * (1.0 - pair.merged.convergent / average(&pair.merged));
        let percents: Vec<f64> = pairs.iter().map(fewer).collect();
        Self {
            pairs: pairs.len(),
            fewer_in: percents.iter().filter(|&&percent| percent > 0.0).count(),
            mean_fewer_percent: percents.iter().sum::<f64>() / percents.len() as f64,
        }
    }

    fn text(&self) -> String {
        let Self {
            pairs,
            fewer_in,
            mean_fewer_percent,
        } = self;
        format!("fewer in {fewer_in} of {pairs}, mean {mean_fewer_percent:.1} % fewer")
    }
}

impl Comparisons {
    fn new(pairs: &[Pair]) -> Self {
        Self {
            same_focal: Comparison::new(pairs, |merged| merged.average_same_focal),
            same_density: Comparison::new(pairs, |merged| merged.average_same_density),
        }
    }
}

/// Draws `figure_18.svg` and returns the numbers of both scenes.
fn figure(folder: &Path) -> Fallible<[SceneResult; 2]> {
    let path = folder.join("figure_18.svg");
    let whole = picture(&path, (980, 900))?;
    let toe_in = MOST_TOE_IN_DEG.to_radians();
    let scenes = [Scene::stage(), Scene::plaza()];
    let drawn = [
        scenes[0].pairs(PAIRS, 0, 0.0),
        scenes[1].pairs(PAIRS, 0, 0.0),
    ];
    for ((area, scene), pairs) in whole.split_evenly((2, 1)).iter().zip(&scenes).zip(&drawn) {
        let (left, right) = area.split_horizontally(450);
        draw_top_view(&left, scene, pairs)?;
        draw_counts(&right, pairs)?;
    }
    save(&whole, &path)?;
    let results = scenes.iter().zip(&drawn).map(|(scene, pairs)| SceneResult {
        name: scene.name,
        parallel: Comparisons::new(pairs),
        parallel_further: Comparisons::new(&scene.pairs(FURTHER_PAIRS, 100, 0.0)),
        not_parallel: Comparisons::new(&scene.pairs(PAIRS, 0, toe_in)),
        not_parallel_further: Comparisons::new(&scene.pairs(FURTHER_PAIRS, 100, toe_in)),
    });
    let results: Vec<SceneResult> = results.collect();
    Ok([results[0], results[1]])
}

/// A solid of a scene. World space: x right, y down, z away from the reader.
#[derive(Clone, Copy, Debug)]
enum Solid {
    Sphere { center: DVec3, radius: f64 },
    Box { min: DVec3, max: DVec3 },
}

/// A scene, the point that its cameras look at, and how their headings spread.
struct Scene {
    name: &'static str,
    solids: Vec<Solid>,
    target: DVec3,
    headings: f64,
    seed: u64,
}

/// A box around a point.
fn cuboid(center: [f64; 3], size: [f64; 3]) -> Solid {
    let (center, half) = (DVec3::from(center), DVec3::from(size) * 0.5);
    Solid::Box {
        min: center - half,
        max: center + half,
    }
}

/// A ball on the floor, which is at y = 1.75.
fn ball(x: f64, z: f64, radius: f64) -> Solid {
    Solid::Sphere {
        center: dvec3(x, 1.75 - radius, z),
        radius,
    }
}

/// A column or a low box on the floor.
fn block(x: f64, z: f64, size: [f64; 3]) -> Solid {
    cuboid([x, 1.75 - 0.5 * size[1], z], size)
}

impl Scene {
    /// Columns, boxes and balls on a floor in front of a wall; cameras stand in front of them.
    fn stage() -> Self {
        let solids = vec![
            cuboid([0.0, 2.0, 10.0], [24.0, 0.5, 24.0]),
            cuboid([0.0, 0.0, 17.0], [24.0, 9.0, 0.5]),
            block(-5.45, 10.28, [0.93, 3.45, 0.88]),
            block(-3.47, 10.17, [1.31, 0.89, 0.55]),
            ball(0.41, 14.00, 0.51),
            block(5.51, 9.45, [1.19, 0.64, 0.65]),
            ball(-6.09, 10.85, 0.60),
            ball(2.20, 12.04, 0.71),
            block(4.18, 12.77, [1.32, 0.83, 1.18]),
            block(-6.16, 12.07, [0.68, 1.04, 0.62]),
            ball(6.94, 10.83, 0.71),
            block(-6.61, 13.67, [1.19, 3.39, 0.58]),
            ball(3.79, 12.50, 0.42),
            block(-4.41, 8.39, [1.34, 2.53, 0.52]),
            block(-6.27, 12.46, [1.25, 0.66, 0.97]),
            ball(-3.62, 14.62, 0.78),
        ];
        let target = dvec3(0.0, 0.2, 11.0);
        Self {
            name: "stage",
            solids,
            target,
            headings: 0.0,
            seed: 1,
        }
    }

    /// A ring of solids around a tall one; cameras look in from all sides.
    fn plaza() -> Self {
        let solids = vec![
            cuboid([0.0, 2.0, 0.0], [30.0, 0.5, 30.0]),
            cuboid([0.0; 3], [1.6, 4.0, 1.6]),
            block(3.60, 0.0, [0.87, 3.46, 1.15]),
            ball(4.21, 2.43, 0.50),
            ball(2.36, 4.09, 0.69),
            block(0.0, 4.56, [1.35, 0.73, 0.80]),
            block(-1.42, 2.46, [0.54, 0.64, 0.87]),
            ball(-4.11, 2.37, 0.93),
            block(-2.52, 0.0, [0.84, 0.97, 1.29]),
            ball(-3.37, -1.95, 0.59),
            block(-1.62, -2.80, [1.07, 2.50, 0.64]),
            block(0.0, -4.08, [0.84, 0.88, 1.04]),
            ball(2.07, -3.59, 0.40),
            ball(2.07, -1.20, 0.82),
        ];
        let target = dvec3(0.0, 0.2, 0.0);
        Self {
            name: "plaza",
            solids,
            target,
            headings: TAU,
            seed: 2,
        }
    }

    fn pairs(&self, count: u32, further_seed: u64, most_toe_in: f64) -> Vec<Pair> {
        let mut random = Random::new(self.seed + further_seed);
        (0..count)
            .map(|_| Pair::new(self, most_toe_in, &mut random))
            .collect()
    }

    /// Whether a point is at least `margin` away from every solid.
    fn is_free(&self, p: DVec3, margin: f64) -> bool {
        self.solids.iter().all(|solid| match *solid {
            Solid::Sphere { center, radius } => p.distance(center) > radius + margin,
            Solid::Box { min, max } => p.distance(p.clamp(min, max)) > margin,
        })
    }

    /// The nearest surface points that a camera sees, one ray through the middle of each pixel.
    fn samples(&self, camera: &PosedCamera) -> Vec<DVec3> {
        let image = camera.intrinsics.image_px();
        let first = camera.intrinsics.slope_min * camera.intrinsics.focal_px;
        let (columns, rows) = (image.x.round() as u32, image.y.round() as u32);
        let pixels = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let samples = pixels.filter_map(|(column, row)| {
            let pixel = first + dvec2(f64::from(column), f64::from(row)) + 0.5;
            let ray = (pixel / camera.intrinsics.focal_px).extend(1.0);
            let direction = camera.pose.world_from_camera * ray;
            let origin = camera.pose.origin;
            let distances = self
                .solids
                .iter()
                .filter_map(|solid| solid.distance(origin, direction));
            let nearest = distances.min_by(f64::total_cmp)?;
            Some(origin + direction * nearest)
        });
        samples.collect()
    }
}

impl Solid {
    /// The distance along a ray at which it enters the solid.
    fn distance(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        match *self {
            Self::Sphere { center, radius } => {
                let offset = origin - center;
                let a = direction.length_squared();
                let b = offset.dot(direction);
                let c = offset.length_squared() - radius * radius;
                // NaN if the ray misses.
                let distance = (-b - (b * b - a * c).sqrt()) / a;
                (distance > 0.0).then_some(distance)
            }
            Self::Box { min, max } => {
                let (one, other) = ((min - origin) / direction, (max - origin) / direction);
                let enter = one.min(other).max_element();
                let leave = one.max(other).min_element();
                (enter > 0.0 && enter <= leave).then_some(enter)
            }
        }
    }
}

/// Samples that merge, by the camera of the layered depth image.
#[derive(Clone, Copy, Debug)]
struct Merged {
    convergent: f64,
    average_same_focal: f64,
    average_same_density: f64,
}

/// Two reference cameras and the two positions that are compared.
struct Pair {
    references: [PosedCamera; 2],
    convergent: DVec3,
    average: DVec3,
    samples: usize,
    merged: Merged,
}

impl Pair {
    fn new(scene: &Scene, most_toe_in: f64, random: &mut Random) -> Self {
        let heading = scene.headings * random.unit();
        let target = scene.target + DVec3::X * random.between(-1.0, 1.0);
        let references = free_references(scene, target, heading, most_toe_in, random);
        let samples = references.iter().flat_map(|camera| scene.samples(camera));
        let in_both = |p: &DVec3| references.iter().all(|camera| camera.contains(*p));
        let points: Vec<DVec3> = samples.filter(in_both).collect();
        // The plane across the mean axis, at the mean depth of the samples.
        let axis = (references[0].pose.axis() + references[1].pose.axis()).normalize();
        let plane = points.iter().map(|p| p.dot(axis)).sum::<f64>() / points.len() as f64;
        let depth_from = |origin: DVec3| plane - origin.dot(axis);
        let average = (references[0].pose.origin + references[1].pose.origin) * 0.5;
        let (convergent, focal_px) = if most_toe_in > 0.0 {
            general_case(&references, &points, axis, depth_from)
        } else {
            parallel_case(&references, depth_from)
        };
        let same_density_px = focal_px * depth_from(average) / depth_from(convergent);
        let merged = Merged {
            convergent: merged(&points, convergent, axis, focal_px),
            average_same_focal: merged(&points, average, axis, focal_px),
            average_same_density: merged(&points, average, axis, same_density_px),
        };
        Self {
            references,
            convergent,
            average,
            samples: points.len(),
            merged,
        }
    }
}

/// Position and focal length by (21) and appendix v.
fn parallel_case(references: &[PosedCamera; 2], depth_from: impl Fn(DVec3) -> f64) -> (DVec3, f64) {
    let cameras = references.map(|camera| ParallelCamera {
        origin: camera.pose.origin,
        focal_px: camera.intrinsics.focal_px.x,
        depth: depth_from(camera.pose.origin),
    });
    let camera = equivalent_camera(&cameras).expect("two cameras in front of the plane");
    (camera.origin, camera.focal_px)
}

/// The least-squares convergent point, and the focal length that gives the mean density of the compound
/// field towards the axis.
fn general_case(
    references: &[PosedCamera; 2],
    points: &[DVec3],
    axis: DVec3,
    depth_from: impl Fn(DVec3) -> f64,
) -> (DVec3, f64) {
    let lines = points
        .iter()
        .filter_map(|&p| FieldLine::through(references, p));
    let origin = convergent_point(lines).expect("lines that are not parallel");
    let facing = |&p: &DVec3| -compound_field(references, p).dot(axis);
    let density = points.iter().map(facing).sum::<f64>() / points.len() as f64;
    (origin, density.sqrt() * depth_from(origin))
}

/// A pair of which no camera stands inside a solid.
fn free_references(
    scene: &Scene,
    target: DVec3,
    heading: f64,
    most_toe_in: f64,
    random: &mut Random,
) -> [PosedCamera; 2] {
    loop {
        let pair = references(target, heading, most_toe_in, random);
        if pair
            .iter()
            .all(|camera| scene.is_free(camera.pose.origin, 0.3))
        {
            return pair;
        }
    }
}

/// Two cameras side by side, one of them farther back, with one focal length.
fn references(
    target: DVec3,
    heading: f64,
    most_toe_in: f64,
    random: &mut Random,
) -> [PosedCamera; 2] {
    let axis = dvec3(heading.sin(), 0.0, heading.cos());
    let side = dvec3(axis.z, 0.0, -axis.x);
    let distance = random.between(8.0, 11.0);
    let nearer = random.between(0.0, 4.5);
    let apart = random.between(1.0, 3.5);
    let height = random.between(-0.6, 0.4);
    let toe_in = if most_toe_in > 0.0 {
        random.between(0.25, 1.0) * most_toe_in
    } else {
        0.0
    };
    let intrinsics = Intrinsics::centered(random.between(150.0, 240.0), dvec2(240.0, 180.0));
    let camera = |across: f64, back: f64, height: f64, turn: f64| {
        let origin = target - axis * back + side * across + DVec3::Y * height;
        let looks = axis * turn.cos() + side * turn.sin();
        let pose = Pose::looking_at(origin, origin + looks, DVec3::NEG_Y);
        PosedCamera { intrinsics, pose }
    };
    [
        camera(-0.5 * apart, distance, height, toe_in),
        camera(0.5 * apart, distance - nearer, -0.3 * height, -toe_in),
    ]
}

/// Samples merged away by a camera at `origin` that looks along `axis`: all but one of each pixel and depth.
fn merged(points: &[DVec3], origin: DVec3, axis: DVec3, focal_px: f64) -> f64 {
    let pose = Pose::looking_at(origin, origin + axis, DVec3::NEG_Y);
    let in_camera = points
        .iter()
        .map(|&p| pose.to_camera(p))
        .filter(|p| p.z > 0.0);
    let projected = in_camera.map(|p| (p.truncate() / p.z * focal_px).extend(p.z));
    let projected: Vec<DVec3> = projected.collect();
    // The R2 sequence (Roberts 2018) covers the pixel evenly without a period of its own.
    let shifts = (0..GRID_SHIFTS).map(|index| {
        let step = f64::from(index) + 0.5;
        dvec2(
            (step * 0.754_877_666).fract(),
            (step * 0.569_840_291).fract(),
        )
    });
    let total: usize = shifts.map(|shift| merged_on_grid(&projected, shift)).sum();
    total as f64 / f64::from(GRID_SHIFTS)
}

fn merged_on_grid(projected: &[DVec3], shift: DVec2) -> usize {
    // Row, column and depth in one key: bits of positive floats are in the order of the floats.
    let key = |p: &DVec3| {
        let pixel = [p.y + shift.y, p.x + shift.x].map(|at| u64::from(at.floor() as i16 as u16));
        pixel[0] << 48 | pixel[1] << 32 | u64::from((p.z as f32).to_bits())
    };
    let mut keys: Vec<u64> = projected.iter().map(key).collect();
    keys.sort_unstable();
    // From the nearest to the farthest of each pixel: a depth beyond the last layer's starts a new one.
    let (mut layers, mut layer) = (0, None::<(u64, f64)>);
    for key in &keys {
        let (pixel, depth) = (key >> 32, f64::from(f32::from_bits(*key as u32)));
        let is_same = layer.is_some_and(|(layer_pixel, nearest)| {
            layer_pixel == pixel && depth - nearest <= SAME_DEPTH * nearest
        });
        if !is_same {
            layers += 1;
            layer = Some((pixel, depth));
        }
    }
    keys.len() - layers
}

/// The scene from above, all cameras, and the frusta of the first pair.
fn draw_top_view(area: &Area, scene: &Scene, pairs: &[Pair]) -> Fallible {
    let title = format!(
        "{} from above; convergent points blue, averages orange",
        scene.name
    );
    let center = if scene.headings > 0.0 {
        DVec2::ZERO
    } else {
        dvec2(0.0, 8.0)
    };
    let mut chart = plane(area, &title, center, 16.0)?;
    for solid in &scene.solids {
        match *solid {
            Solid::Sphere { center, radius } => {
                dot(&mut chart, flat(center), (radius * 16.0) as i32, GRAY)?;
            }
            // The floor would cover all else.
            Solid::Box { min, max } if max.x - min.x < 20.0 || max.z - min.z < 2.0 => {
                let corners = [
                    (min.x, min.z),
                    (max.x, min.z),
                    (max.x, max.z),
                    (min.x, max.z),
                ];
                fill(&mut chart, corners.map(DVec2::from), GRAY.filled())?;
            }
            Solid::Box { .. } => {}
        }
    }
    for camera in &pairs[0].references {
        let edge = |slope: f64| flat(camera.pose.to_world(dvec3(slope, 0.0, 1.0) * 18.0));
        let (left, right) = (camera.intrinsics.slope_min.x, camera.intrinsics.slope_max.x);
        let apex = flat(camera.pose.origin);
        fill(&mut chart, [apex, edge(left), edge(right)], OURS.mix(0.12))?;
    }
    for pair in pairs {
        for camera in &pair.references {
            dot(&mut chart, flat(camera.pose.origin), 3, INK)?;
        }
        dot(&mut chart, flat(pair.average), 3, OTHER)?;
        dot(&mut chart, flat(pair.convergent), 3, OURS)?;
    }
    let [a, b] = pairs[0].references.map(|camera| flat(camera.pose.origin));
    curve(&mut chart, [a, b], GRAY)
}

/// Merged samples of each pair, in per cent of all.
fn draw_counts(area: &Area, pairs: &[Pair]) -> Fallible {
    let series = |name, color, count: fn(&Merged) -> f64| {
        let percent = |pair: &Pair| 100.0 * count(&pair.merged) / pair.samples as f64;
        let points = pairs
            .iter()
            .zip(1u8..)
            .map(|(pair, x)| dvec2(x.into(), percent(pair)));
        Series {
            name,
            color,
            points: points.collect(),
        }
    };
    let series = [
        series("at the convergent point", OURS, |merged| merged.convergent),
        series("at the average, same focal length", OTHER, |merged| {
            merged.average_same_focal
        }),
        series("at the average, same density", GRAY, |merged| {
            merged.average_same_density
        }),
    ];
    let (x, y) = (
        ("pair of cameras", 1.0..10.0),
        ("samples merged, % of all", 0.0..75.0),
    );
    graph(area, "", x, y, &series, SeriesLabelPosition::UpperRight)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The convergent point merges fewer samples in `share` of the pairs, and by `percent` in the mean.
    fn assert_fewer(comparison: Comparison, share: f64, percent: f64) {
        let pairs = comparison.pairs as f64;
        assert!(
            comparison.fewer_in as f64 >= share * pairs,
            "{comparison:?}"
        );
        assert!(comparison.mean_fewer_percent > percent, "{comparison:?}");
    }

    /// In nearly every parallel pair, and in most that are not parallel or compared at the same density.
    #[test]
    fn convergent_points_merge_fewer_samples() {
        let folder = tempfile::tempdir().unwrap();
        for scene in figure(folder.path()).unwrap() {
            assert_fewer(scene.parallel.same_focal, 0.9, 10.0);
            assert_fewer(scene.parallel.same_density, 0.9, 5.0);
            assert_fewer(scene.parallel_further.same_focal, 0.9, 10.0);
            assert_fewer(scene.parallel_further.same_density, 0.8, 5.0);
            assert_fewer(scene.not_parallel_further.same_focal, 0.6, 10.0);
            assert_fewer(scene.not_parallel_further.same_density, 0.7, 4.0);
        }
        assert!(folder.path().join("figure_18.svg").exists());
    }

    /// A camera that resamples its own image merges nothing; at half the focal length it merges three of four.
    #[test]
    fn camera_keeps_its_own_samples() {
        let pose = Pose::looking_at(DVec3::ZERO, DVec3::Z, DVec3::NEG_Y);
        let pixels = (-20..20).flat_map(|x| (-20..20).map(move |y| dvec2(x.into(), y.into())));
        let points = pixels.map(|pixel| pose.to_world(((pixel + 0.5) / 100.0).extend(1.0) * 5.0));
        let points: Vec<DVec3> = points.collect();
        assert_eq!(
            merged(&points, DVec3::ZERO, DVec3::Z, 100.0 * (1.0 + 1e-9)),
            0.0
        );
        let at_half = merged(&points, DVec3::ZERO, DVec3::Z, 50.0);
        assert!((at_half - 1200.0).abs() < 40.0, "{at_half}");
        // Depths apart are layers, not merged.
        let two = [DVec3::Z * 2.0, DVec3::Z * 3.0];
        assert_eq!(merged(&two, DVec3::ZERO, DVec3::Z, 100.0), 0.0);
    }
}
