//! Figure 18: layered depth images at the convergent point and at the average position (§4.2.3).
//!
//! Two reference cameras sample a scene. Samples inside both frusta are projected into one camera. Samples in
//! one pixel with nearly the same depth are merged. The paper compares the numbers for ten pairs of parallel
//! cameras in two scenes. It does not give the focal length at the average position, so this figure uses two
//! focal lengths. It also compares pairs that are not parallel.
//!
//! `cargo run -p camera_field --example figure_18 -- paper-out`
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "drawing takes angles and allocates; selection does not run here"
)]

mod drawing;

use core::f64::consts::TAU;

use camera_field::double::{
    FieldLine, Intrinsics, ParallelCamera, Pose, PosedCamera, compound_field, convergent_point,
    equivalent_camera,
};
use drawing::{Area, Fallible, GRAY, OTHER, OURS, RGBColor, Random, Series, draw, graph};
use glam::{DVec2, DVec3, dvec2, dvec3};

/// Largest angle between a camera of a pair that is not parallel and the common axis. The smallest is a quarter of it.
const MAX_TOE_IN_DEG: f64 = 12.0;
/// Samples merge if their depths differ by less than this share. Smaller shares keep copies of one surface; larger
/// shares merge different surfaces.
const SAME_DEPTH: f64 = 0.02;
/// Number of shifts of the pixel grid. Counts are averaged over them, because those of a single alignment are noisy.
const GRID_SHIFTS: u32 = 8;

fn main() -> Fallible {
    let scenes = [Scene::stage(), Scene::plaza()];
    println!("samples merged at the convergent point, compared to the average position");
    for scene in &scenes {
        for (kind, parallel) in [("parallel", true), ("not parallel", false)] {
            for (more, further) in [("", false), (", further", true)] {
                let texts = compare(&scene.pairs(parallel, further)).map(|percents| {
                    let (fewer, mean) = (fewer_in(&percents), mean(&percents));
                    let count = percents.len();
                    format!("fewer in {fewer} of {count}, mean {mean:.1} % fewer")
                });
                let [same_focal, same_density] = texts;
                let name = scene.name;
                println!(
                    "  {name}, {kind}{more}: same focal length {same_focal}; same density {same_density}"
                );
            }
        }
    }
    draw("figure_18.svg", (980, 450), |whole| {
        for (area, scene) in whole.split_evenly((1, 2)).iter().zip(&scenes) {
            draw_counts(area, scene.name, &scene.pairs(true, false))?;
        }
        Ok(())
    })
}

/// For each pair, the reduction of merged samples at the convergent point, in per cent of two cameras at the average
/// position. The first has the same focal length, the second has the same density on the plane at the mean depth.
fn compare(pairs: &[Merged]) -> [Vec<f64>; 2] {
    let average: [fn(&Merged) -> f64; 2] = [|m| m.average_same_focal, |m| m.average_same_density];
    average.map(|average| {
        let fewer = |merged: &Merged| 100.0 * (1.0 - merged.convergent / average(merged));
        pairs.iter().map(fewer).collect()
    })
}

/// Number of pairs for which the convergent point merges fewer samples.
fn fewer_in(percents: &[f64]) -> usize {
    percents.iter().filter(|&&percent| percent > 0.0).count()
}

fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

/// A solid of a scene. World space: x right, y down, z away from the reader.
#[derive(Clone, Copy, Debug)]
enum Solid {
    Sphere { center: DVec3, radius: f64 },
    Box { min: DVec3, max: DVec3 },
}

/// A scene, the point that its cameras look at, and the range of their headings.
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
    /// Columns, boxes and balls on a floor in front of a wall. All cameras are on one side.
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
        Self {
            name: "stage",
            solids,
            target: dvec3(0.0, 0.2, 11.0),
            headings: 0.0,
            seed: 1,
        }
    }

    /// A ring of solids around a tall one. Cameras are on all sides.
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
        Self {
            name: "plaza",
            solids,
            target: dvec3(0.0, 0.2, 0.0),
            headings: TAU,
            seed: 2,
        }
    }

    /// Merged samples of ten pairs, `parallel` or not. If `further`, 40 other pairs.
    fn pairs(&self, parallel: bool, further: bool) -> Vec<Merged> {
        let (count, seed) = if further { (40, 100) } else { (10, 0) };
        let max_toe_in = if parallel { 0.0 } else { MAX_TOE_IN_DEG };
        let mut random = Random::new(self.seed + seed);
        let pair = |_| Merged::of_pair(self, max_toe_in.to_radians(), &mut random);
        (0..count).map(pair).collect()
    }

    /// Returns `true` if a point is at least `margin` away from every solid.
    fn is_free(&self, p: DVec3, margin: f64) -> bool {
        self.solids.iter().all(|solid| match *solid {
            Solid::Sphere { center, radius } => p.distance(center) > radius + margin,
            Solid::Box { min, max } => p.distance(p.clamp(min, max)) > margin,
        })
    }

    /// The nearest surface point on the ray through the middle of each pixel.
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
            let solids = self.solids.iter();
            let distances = solids.filter_map(|solid| solid.distance(origin, direction));
            Some(origin + direction * distances.min_by(f64::total_cmp)?)
        });
        samples.collect()
    }
}

impl Solid {
    /// The multiple of `direction` at which a ray enters the solid.
    fn distance(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        match *self {
            Self::Sphere { center, radius } => {
                let offset = origin - center;
                let a = direction.length_squared();
                let b = offset.dot(direction);
                let c = offset.length_squared() - radius * radius;
                // The distance is NaN if the ray misses.
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

/// Merged samples of a pair of reference cameras, for each camera of the layered depth image.
#[derive(Clone, Copy, Debug)]
struct Merged {
    samples: f64,
    convergent: f64,
    average_same_focal: f64,
    average_same_density: f64,
}

impl Merged {
    fn of_pair(scene: &Scene, max_toe_in: f64, random: &mut Random) -> Self {
        let heading = scene.headings * random.unit();
        let target = scene.target + DVec3::X * random.between(-1.0, 1.0);
        // A pair with a camera in or near a solid is replaced by another random pair.
        let is_free = |camera: &PosedCamera| scene.is_free(camera.pose.origin, 0.3);
        let references = loop {
            let references = references(target, heading, max_toe_in, random);
            if references.iter().all(is_free) {
                break references;
            }
        };
        let samples = references.iter().flat_map(|camera| scene.samples(camera));
        let in_both = |p: &DVec3| references.iter().all(|camera| camera.contains(*p));
        let points: Vec<DVec3> = samples.filter(in_both).collect();
        // The plane is perpendicular to the mean axis, at the mean depth of the samples.
        let axis = (references[0].pose.axis() + references[1].pose.axis()).normalize();
        let plane = points.iter().map(|p| p.dot(axis)).sum::<f64>() / points.len() as f64;
        let depth_from = |origin: DVec3| plane - origin.dot(axis);
        let average = (references[0].pose.origin + references[1].pose.origin) * 0.5;
        let (convergent, focal_px) = if max_toe_in > 0.0 {
            general_case(&references, &points, axis, depth_from)
        } else {
            parallel_case(&references, depth_from)
        };
        let same_density_px = focal_px * depth_from(average) / depth_from(convergent);
        Self {
            samples: points.len() as f64,
            convergent: merged(&points, convergent, axis, focal_px),
            average_same_focal: merged(&points, average, axis, focal_px),
            average_same_density: merged(&points, average, axis, same_density_px),
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

/// The least-squares convergent point, and the focal length with the mean density of the compound field
/// along the axis.
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

/// Two cameras side by side with the same focal length. One of them is farther back.
fn references(
    target: DVec3,
    heading: f64,
    max_toe_in: f64,
    random: &mut Random,
) -> [PosedCamera; 2] {
    let axis = dvec3(heading.sin(), 0.0, heading.cos());
    let side = dvec3(axis.z, 0.0, -axis.x);
    let distance = random.between(8.0, 11.0);
    let nearer = random.between(0.0, 4.5);
    let apart = random.between(1.0, 3.5);
    let height = random.between(-0.6, 0.4);
    // Parallel pairs take no random number for the angle.
    let toe_in = match max_toe_in {
        0.0 => 0.0,
        most => random.between(0.25, 1.0) * most,
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

/// Number of samples that merge in a camera at `origin` that looks along `axis`. One sample per pixel and layer stays.
fn merged(points: &[DVec3], origin: DVec3, axis: DVec3, focal_px: f64) -> f64 {
    let pose = Pose::looking_at(origin, origin + axis, DVec3::NEG_Y);
    let in_camera = points.iter().map(|&p| pose.to_camera(p));
    let in_front = in_camera.filter(|p| p.z > 0.0);
    let projected = in_front.map(|p| (p.truncate() / p.z * focal_px).extend(p.z));
    let projected: Vec<DVec3> = projected.collect();
    // The shifts are from the R2 sequence (Roberts 2018), which covers the pixel evenly.
    let shifts = (0..GRID_SHIFTS).map(|index| {
        let step = f64::from(index) + 0.5;
        dvec2(step * 0.754_877_666, step * 0.569_840_291).fract()
    });
    let total: usize = shifts.map(|shift| merged_on_grid(&projected, shift)).sum();
    total as f64 / f64::from(GRID_SHIFTS)
}

fn merged_on_grid(projected: &[DVec3], shift: DVec2) -> usize {
    // A key has row, column and depth. The bits of positive floats have the same order as the floats.
    let key = |p: &DVec3| {
        let pixel = [p.y + shift.y, p.x + shift.x].map(|at| u64::from(at.floor() as i16 as u16));
        pixel[0] << 48 | pixel[1] << 32 | u64::from((p.z as f32).to_bits())
    };
    let mut keys: Vec<u64> = projected.iter().map(key).collect();
    keys.sort_unstable();
    // Keys are sorted by pixel and depth. A depth beyond `SAME_DEPTH` starts a new layer.
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

/// Draws the merged samples of each pair, in per cent of all samples.
fn draw_counts(area: &Area, title: &str, pairs: &[Merged]) -> Fallible {
    const NAMES: [&str; 2] = [
        "at the average, same focal length",
        "at the average, same density",
    ];
    let curves: [(&str, RGBColor, fn(&Merged) -> f64); 3] = [
        ("at the convergent point", OURS, |m| m.convergent),
        (NAMES[0], OTHER, |m| m.average_same_focal),
        (NAMES[1], GRAY, |m| m.average_same_density),
    ];
    let series = curves.map(|(name, color, count)| {
        let percent = |(m, x): (&Merged, u8)| dvec2(x.into(), 100.0 * count(m) / m.samples);
        Series {
            name,
            color,
            points: pairs.iter().zip(1..).map(percent).collect(),
        }
    });
    let x = ("pair of cameras", 1.0..10.0);
    let y = ("samples merged, % of all", 0.0..75.0);
    graph(area, title, x, y, &series)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn convergent_points_merge_fewer_samples() {
        for scene in [Scene::stage(), Scene::plaza()] {
            // Least share of pairs, and least mean reduction in per cent, for both cameras at the average.
            for (parallel, further, least) in [
                (true, false, [(0.9, 10.0), (0.9, 5.0)]),
                (true, true, [(0.9, 10.0), (0.8, 5.0)]),
                (false, true, [(0.6, 10.0), (0.7, 4.0)]),
            ] {
                let found = compare(&scene.pairs(parallel, further));
                for (percents, (share, percent)) in found.iter().zip(least) {
                    let needed = share * percents.len() as f64;
                    assert!(fewer_in(percents) as f64 >= needed, "{percents:?}");
                    assert!(mean(percents) > percent, "{percents:?}");
                }
            }
        }
    }
}
