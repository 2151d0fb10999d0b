//! Figure 15: a model drawn as splats (§4.1.1), beside its triangles.
//!
//! Splats are drawn in two passes: depth first, then the colours of all splats near that depth, weighted by a
//! Gaussian and normalised.
//!
//! `cargo run -p camera_field --example figure_15 -- paper-out`
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "drawing takes angles and allocates; selection does not run here"
)]

mod drawing;

use core::f64::consts::{PI, TAU};

use camera_field::double::{Intrinsics, Pose, PosedCamera, SplatKernel, Surfel};
use drawing::{Fallible, Random, out_folder};
use glam::{DVec2, DVec3, dvec2, dvec3};
use image::RgbImage;

/// The point of the unit disk at a pixel.
type Unmap = fn(&SplatKernel, DVec2) -> Option<DVec2>;

/// The paper's ellipse, our kernel of second order, and the projected disk.
const KERNELS: [(&str, Unmap); 3] = [
    ("Paper", |kernel, pixel| Some(kernel.unmap_affine(pixel))),
    ("Sheared", SplatKernel::unmap_sheared),
    ("Exact", |kernel, pixel| Some(kernel.unmap_exact(pixel))),
];
const SIDE: usize = 400;
const SAMPLES: u32 = 9000;

fn main() -> Fallible {
    let (reference, splats) = draw_all();
    println!("kernel     RMSE    to exact splats, of 255    missing px    extra px");
    for ((name, _), image) in KERNELS.iter().zip(&splats) {
        let [rmse, to_exact] = [&reference, &splats[2]].map(|other| rmse_of_255(other, image));
        let (missing, extra) = (reference.only(image), image.only(&reference));
        println!("{name:7}{rmse:>8.2}{to_exact:>27.2}{missing:>14}{extra:>12}");
    }
    save(&reference, &splats)
}

/// Triangles, and splats with each of [`KERNELS`].
fn draw_all() -> (Image, [Image; 3]) {
    // A close and wide camera has strong perspective.
    let camera = PosedCamera {
        intrinsics: Intrinsics::centered(190.0, DVec2::splat(SIDE as f64)),
        pose: Pose::looking_at(dvec3(0.2, -0.5, -2.05), DVec3::ZERO, DVec3::NEG_Y),
    };
    let triangles = torus_knot();
    let (samples, stratum) = sample_surface(&triangles, &mut Random::new(15));
    // Disks of eight strata leave few gaps between random samples.
    let radius = (8.0 * stratum / PI).sqrt();
    let splats = KERNELS.map(|(_, unmap)| draw_splats(&camera, &samples, radius, unmap));
    (draw_triangles(&camera, &triangles), splats)
}

/// Draws triangles, and splats with the paper's kernel and with the sheared kernel, side by side.
fn save(reference: &Image, [paper, sheared, _]: &[Image; 3]) -> Fallible {
    let mut picture = RgbImage::new(3 * SIDE as u32, SIDE as u32);
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let panel = [reference, paper, sheared][x as usize / SIDE];
        let color = panel.color[y as usize * SIDE + x as usize % SIDE];
        let levels = color.clamp(DVec3::ZERO, DVec3::ONE) * 255.0;
        pixel.0 = levels.to_array().map(|level| level as u8);
    }
    let path = out_folder()?.join("figure_15.png");
    let saved = picture.save(&path);
    saved.map_err(|error| format!("could not write {}: {error}", path.display()))?;
    Ok(())
}

/// Root mean squared difference of colour, on a scale of 255, over the pixels that both cover.
fn rmse_of_255(one: &Image, other: &Image) -> f64 {
    let both = (0..SIDE * SIDE).filter(|&index| one.covers(index) && other.covers(index));
    let square = |index: usize| (one.color[index] - other.color[index]).length_squared() / 3.0;
    let (sum, count) = both.fold((0.0, 0.0), |(sum, count), index| {
        (sum + square(index), count + 1.0)
    });
    255.0 * (sum / f64::max(count, 1.0)).sqrt()
}

/// A square image with depth. Pixel 0 is the upper left.
#[derive(Clone, Debug)]
struct Image {
    color: Vec<DVec3>,
    /// Depth along the axis. Infinite for uncovered pixels.
    depth: Vec<f64>,
}

impl Image {
    fn new() -> Self {
        Self {
            color: vec![DVec3::ONE; SIDE * SIDE],
            depth: vec![f64::INFINITY; SIDE * SIDE],
        }
    }

    fn covers(&self, index: usize) -> bool {
        self.depth[index].is_finite()
    }

    /// Number of pixels that only this image covers.
    fn only(&self, other: &Self) -> usize {
        let indices = 0..SIDE * SIDE;
        let only = indices.filter(|&index| self.covers(index) && !other.covers(index));
        only.count()
    }
}

/// Indices and positions, from the principal point, of the pixels in a box around `middle_px`.
fn pixels_near(middle_px: DVec2, reach: DVec2) -> impl Iterator<Item = (usize, DVec2)> {
    let half = 0.5 * SIDE as f64;
    let range = |middle: f64, reach: f64| {
        let least = (middle - reach + half - 0.5).ceil().max(0.0) as usize;
        let end = (middle + reach + half + 0.5)
            .floor()
            .clamp(0.0, SIDE as f64) as usize;
        least..end.max(least)
    };
    let columns = range(middle_px.x, reach.x);
    let rows = range(middle_px.y, reach.y);
    let pixels = rows.flat_map(move |row| columns.clone().map(move |column| (row, column)));
    pixels.map(move |(row, column)| {
        let pixel = dvec2(column as f64, row as f64) + 0.5 - half;
        (row * SIDE + column, pixel)
    })
}

/// A point of the model's surface.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    position: DVec3,
    normal: DVec3,
    /// Unlit colour.
    albedo: DVec3,
}

impl Vertex {
    /// A point of a torus knot with stripes. `along` the knot and `around` its tube are from 0 to 1.
    fn on_knot(along: f64, around: f64) -> Self {
        let knot = |turn: f64| {
            let radius = 1.0 + 0.45 * (3.0 * turn).cos();
            let (sin, cos) = (2.0 * turn).sin_cos();
            dvec3(radius * cos, radius * sin, 0.6 * (3.0 * turn).sin())
        };
        let turn = along * TAU;
        let tangent = (knot(turn + 1e-4) - knot(turn - 1e-4)).normalize();
        let side = tangent.cross(DVec3::Z).normalize();
        let angle = around * TAU;
        let normal = side * angle.cos() + side.cross(tangent) * angle.sin();
        let stripe = (0.5 + 2.0 * (20.0 * turn + 3.0 * angle).sin()).clamp(0.0, 1.0);
        Self {
            position: knot(turn) + normal * 0.3,
            normal,
            albedo: dvec3(0.86, 0.55, 0.28).lerp(dvec3(0.20, 0.42, 0.62), stripe),
        }
    }

    /// Colour under a fixed light.
    fn color(&self) -> DVec3 {
        let light = dvec3(-0.4, -0.7, -0.6).normalize();
        self.albedo * (0.25 + 0.75 * self.normal.normalize().dot(light).max(0.0))
    }

    /// The point of a triangle with these barycentric weights.
    fn mix(triangle: &[Self; 3], weights: [f64; 3]) -> Self {
        let sum = |part: fn(&Self) -> DVec3| {
            let weighted = triangle.iter().zip(weights);
            weighted.map(|(vertex, weight)| part(vertex) * weight).sum()
        };
        Self {
            position: sum(|vertex| vertex.position),
            normal: sum(|vertex| vertex.normal),
            albedo: sum(|vertex| vertex.albedo),
        }
    }
}

/// The triangles of the model. Their fronts are outside.
fn torus_knot() -> Vec<[Vertex; 3]> {
    const ALONG: u32 = 720;
    const AROUND: u32 = 80;
    let at = |along: u32, around: u32| {
        let share = |step: u32, count: u32| f64::from(step % count) / f64::from(count);
        Vertex::on_knot(share(along, ALONG), share(around, AROUND))
    };
    let quads = (0..ALONG).flat_map(|along| (0..AROUND).map(move |around| (along, around)));
    let triangles = quads.flat_map(|(along, around)| {
        let (here, across) = (at(along, around), at(along + 1, around + 1));
        [
            [here, at(along + 1, around), across],
            [here, across, at(along, around + 1)],
        ]
    });
    triangles.collect()
}

/// One point in each of [`SAMPLES`] strata of equal area, and the area of a stratum.
fn sample_surface(triangles: &[[Vertex; 3]], random: &mut Random) -> (Vec<Vertex>, f64) {
    let area = |triangle: &[Vertex; 3]| {
        let [a, b, c] = triangle.map(|vertex| vertex.position);
        0.5 * (b - a).cross(c - a).length()
    };
    let stratum = triangles.iter().map(area).sum::<f64>() / f64::from(SAMPLES);
    let mut next = stratum * random.unit();
    let (mut index, mut passed, mut samples) = (0u32, 0.0, Vec::new());
    for triangle in triangles {
        passed += area(triangle);
        while next < passed {
            // Folding the unit square gives a uniform distribution over the triangle.
            let (u, v) = (random.unit(), random.unit());
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            samples.push(Vertex::mix(triangle, [1.0 - u - v, u, v]));
            index += 1;
            next = stratum * (f64::from(index) + random.unit());
        }
    }
    (samples, stratum)
}

/// Draws triangles with a depth test and light per pixel.
fn draw_triangles(camera: &PosedCamera, triangles: &[[Vertex; 3]]) -> Image {
    let mut image = Image::new();
    for triangle in triangles {
        let corners = triangle.map(|vertex| camera.pose.to_camera(vertex.position));
        let [p0, p1, p2] = corners;
        let volume = p0.dot((p1 - p0).cross(p2 - p0));
        if volume >= 0.0 || corners.iter().any(|p| p.z <= 0.0) {
            continue;
        }
        let pixels = corners.map(|p| camera.intrinsics.project_px(p));
        let least = pixels[0].min(pixels[1]).min(pixels[2]);
        let reach = (pixels[0].max(pixels[1]).max(pixels[2]) - least) * 0.5;
        for (index, pixel) in pixels_near(least + reach, reach) {
            let ray = (pixel / camera.intrinsics.focal_px).extend(1.0);
            // The point of the plane has the depth 1/Σw and the barycentric weights w/Σw.
            let weights = [(p1, p2), (p2, p0), (p0, p1)].map(|(a, b)| ray.dot(a.cross(b)) / volume);
            let depth = 1.0 / weights.iter().sum::<f64>();
            let is_inside = weights.iter().all(|&weight| weight >= 0.0);
            if is_inside && depth > 0.0 && depth < image.depth[index] {
                let weights = weights.map(|weight| weight * depth);
                image.depth[index] = depth;
                image.color[index] = Vertex::mix(triangle, weights).color();
            }
        }
    }
    image
}

/// A projected surfel.
struct Splat {
    kernel: SplatKernel,
    depth: f64,
    color: DVec3,
}

impl Splat {
    /// Returns `None` if the surfel faces away, or if its depth is at most its radius.
    fn new(camera: &PosedCamera, sample: &Vertex, radius: f64) -> Option<Self> {
        let center = camera.pose.to_camera(sample.position);
        let normal = camera.pose.direction_to_camera(sample.normal.normalize());
        let faces_camera = normal.dot(center) < 0.0 && center.z > radius;
        let surfel = Surfel {
            center,
            normal,
            radius,
        };
        faces_camera.then(|| Self {
            kernel: SplatKernel::new(&camera.intrinsics, &surfel),
            depth: center.z,
            color: sample.color(),
        })
    }

    /// The covered pixels, with their points of the unit disk and their depths.
    fn pixels(&self, unmap: Unmap) -> impl Iterator<Item = (usize, DVec2, f64)> {
        let (middle_px, [a, b]) = self.kernel.ellipse();
        let affine = self.kernel.axes_px[0].abs() + self.kernel.axes_px[1].abs();
        let reach = (a.abs() + b.abs()).max(affine) + (middle_px - self.kernel.center_px).abs();
        pixels_near(middle_px, reach).filter_map(move |(index, pixel)| {
            let e = unmap(&self.kernel, pixel).filter(|e| e.length_squared() <= 1.0)?;
            Some((index, e, self.depth * (1.0 + self.kernel.keystone.dot(e))))
        })
    }
}

/// Draws surfels of one radius.
fn draw_splats(camera: &PosedCamera, samples: &[Vertex], radius: f64, unmap: Unmap) -> Image {
    let splats = samples
        .iter()
        .filter_map(|sample| Splat::new(camera, sample, radius));
    let splats: Vec<Splat> = splats.collect();
    let mut image = Image::new();
    for splat in &splats {
        for (index, _, depth) in splat.pixels(unmap) {
            image.depth[index] = image.depth[index].min(depth);
        }
    }
    // Blends colours up to one radius behind the nearest surface.
    let mut sums = vec![(DVec3::ZERO, 0.0); SIDE * SIDE];
    for splat in &splats {
        for (index, e, depth) in splat.pixels(unmap) {
            if depth <= image.depth[index] + radius {
                let weight = (-4.0 * e.length_squared()).exp();
                sums[index].0 += splat.color * weight;
                sums[index].1 += weight;
            }
        }
    }
    for (color, (sum, weight)) in image.color.iter_mut().zip(sums) {
        if weight > 0.0 {
            *color = sum / weight;
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheared_splats_are_nearer_to_exact_splats() {
        let (reference, splats) = draw_all();
        let to_exact = splats
            .each_ref()
            .map(|image| rmse_of_255(&splats[2], image));
        assert!(to_exact[1] < 0.5 * to_exact[0], "{to_exact:?}");
        let rmse = splats
            .each_ref()
            .map(|image| rmse_of_255(&reference, image));
        assert!(rmse[1] < rmse[0], "{rmse:?}");
        assert_eq!((reference.only(&splats[1]), to_exact[2]), (0, 0.0));
    }
}
