//! A model drawn from splats in two passes, as in §4.1.1: depth first, then the colours of all
//! splats near that depth, weighted by a Gaussian and normalised.

use camera_field::double::{PosedCamera, SplatKernel, Surfel};
use glam::{DVec2, DVec3};

use super::model::Vertex;
use super::raster::Image;

/// The kernel that a splat is drawn with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SplatMode {
    /// The paper's ellipse.
    Paper,
    /// Ours, sheared to second order.
    Sheared,
    /// The projected disk.
    Exact,
}

/// A surfel as the camera sees it.
struct Splat {
    kernel: SplatKernel,
    surfel: Surfel,
    color: DVec3,
}

impl Splat {
    /// `None` for surfels that face away.
    fn new(camera: &PosedCamera, sample: &Vertex, radius: f64) -> Option<Self> {
        let surfel = Surfel {
            center: camera.pose.to_camera(sample.position),
            normal: camera.pose.direction_to_camera(sample.normal.normalize()),
            radius,
        };
        let faces = surfel.normal.dot(surfel.center) < 0.0 && surfel.center.z > radius;
        faces.then(|| Self {
            kernel: SplatKernel::new(&camera.intrinsics, &surfel),
            surfel,
            color: sample.color(),
        })
    }

    /// The point of the unit disk that a kernel has at a pixel, if there is one.
    fn at(&self, mode: SplatMode, pixel: DVec2) -> Option<DVec2> {
        let e = match mode {
            SplatMode::Paper => Some(self.kernel.unmap_affine(pixel)),
            SplatMode::Sheared => self.kernel.unmap_sheared(pixel),
            SplatMode::Exact => Some(self.kernel.unmap_exact(pixel)),
        };
        e.filter(|e| e.length_squared() <= 1.0)
    }

    /// Depth of the kernel's point `e`.
    fn depth(&self, e: DVec2) -> f64 {
        self.surfel.center.z * (1.0 + self.kernel.keystone.dot(e))
    }

    fn pixels(&self, image: &Image) -> impl Iterator<Item = (usize, DVec2)> + use<> {
        let (middle_px, [a, b]) = self.kernel.ellipse();
        let paper = self.kernel.axes_px[0].abs() + self.kernel.axes_px[1].abs();
        let offset = (middle_px - self.kernel.center_px).abs();
        image.pixels_near(middle_px, (a.abs() + b.abs()).max(paper) + offset)
    }
}

/// Draws surfels of one radius.
pub(super) fn draw_splats(
    camera: &PosedCamera,
    samples: &[Vertex],
    radius: f64,
    mode: SplatMode,
    side: usize,
) -> Image {
    let splats: Vec<Splat> = samples
        .iter()
        .filter_map(|sample| Splat::new(camera, sample, radius))
        .collect();
    // First the depth of the nearest surface.
    let mut image = Image::new(side);
    for splat in &splats {
        draw_depth(&mut image, splat, mode);
    }
    // Then the colours near it.
    let mut sums = vec![(DVec3::ZERO, 0.0); side * side];
    for splat in &splats {
        add_color(&mut sums, &image, splat, mode, radius);
    }
    for (color, (sum, weight)) in image.color.iter_mut().zip(sums) {
        if weight > 0.0 {
            *color = sum / weight;
        }
    }
    image
}

fn draw_depth(image: &mut Image, splat: &Splat, mode: SplatMode) {
    for (index, pixel) in splat.pixels(image) {
        if let Some(e) = splat.at(mode, pixel) {
            image.depth[index] = image.depth[index].min(splat.depth(e));
        }
    }
}

/// Adds a splat's colour where it is at most one radius behind the nearest surface.
fn add_color(
    sums: &mut [(DVec3, f64)],
    image: &Image,
    splat: &Splat,
    mode: SplatMode,
    radius: f64,
) {
    for (index, pixel) in splat.pixels(image) {
        // Only where the kernel covers the pixel.
        let Some(e) = splat.at(mode, pixel) else {
            continue;
        };
        if splat.depth(e) <= image.depth[index] + radius {
            // A Gaussian over the disk.
            let weight = (-4.0 * e.length_squared()).exp();
            sums[index].0 += splat.color * weight;
            sums[index].1 += weight;
        }
    }
}
