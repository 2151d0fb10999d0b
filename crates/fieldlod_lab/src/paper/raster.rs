//! A colour and depth image, and triangles drawn into it.

use camera_field::double::PosedCamera;
use glam::{DVec2, DVec3, dvec2};

use super::model::Vertex;

/// A square image with depth. Pixel (0, 0) is the upper left.
#[derive(Clone, Debug)]
pub(super) struct Image {
    pub(super) side: usize,
    pub(super) color: Vec<DVec3>,
    /// Depth along the axis; infinite where nothing was drawn.
    pub(super) depth: Vec<f64>,
}

impl Image {
    pub(super) fn new(side: usize) -> Self {
        Self {
            side,
            color: vec![DVec3::ONE; side * side],
            depth: vec![f64::INFINITY; side * side],
        }
    }

    pub(super) fn covered(&self, index: usize) -> bool {
        self.depth[index].is_finite()
    }

    /// Indices and positions, from the principal point, of the pixels in a box around `middle_px`.
    pub(super) fn pixels_near(
        &self,
        middle_px: DVec2,
        reach: DVec2,
    ) -> impl Iterator<Item = (usize, DVec2)> + use<> {
        let side = self.side;
        let half = 0.5 * side as f64;
        // Columns and rows whose middles lie in the box, within the image.
        let range = |middle: f64, reach: f64| {
            let least = (middle - reach + half - 0.5).ceil().max(0.0) as usize;
            let end = (middle + reach + half + 0.5)
                .floor()
                .clamp(0.0, side as f64) as usize;
            least..end.max(least)
        };
        let columns = range(middle_px.x, reach.x);
        range(middle_px.y, reach.y).flat_map(move |row| {
            columns.clone().map(move |column| {
                let pixel = dvec2(column as f64, row as f64) + 0.5 - half;
                (row * side + column, pixel)
            })
        })
    }
}

/// Draws triangles with a depth test and per-pixel light.
pub(super) fn draw_triangles(
    camera: &PosedCamera,
    triangles: &[[Vertex; 3]],
    side: usize,
) -> Image {
    let mut image = Image::new(side);
    for triangle in triangles {
        draw_triangle(&mut image, camera, triangle);
    }
    image
}

fn draw_triangle(image: &mut Image, camera: &PosedCamera, triangle: &[Vertex; 3]) {
    // Only fronts before the camera.
    let corners = triangle.map(|vertex| camera.pose.to_camera(vertex.position));
    let [p0, p1, p2] = corners;
    let volume = p0.dot((p1 - p0).cross(p2 - p0));
    if volume >= 0.0 || corners.iter().any(|p| p.z <= 0.0) {
        return;
    }
    // The pixels around the triangle.
    let pixels = corners.map(|p| camera.intrinsics.project_px(p));
    let least = pixels[0].min(pixels[1]).min(pixels[2]);
    let greatest = pixels[0].max(pixels[1]).max(pixels[2]);
    let reach = (greatest - least) * 0.5;
    for (index, pixel) in image.pixels_near(least + reach, reach) {
        let ray = (pixel / camera.intrinsics.focal_px).extend(1.0);
        // The point of the plane at depth 1/Σw, with barycentric weights w/Σw.
        let weights = [(p1, p2), (p2, p0), (p0, p1)].map(|(a, b)| ray.dot(a.cross(b)) / volume);
        let depth = 1.0 / weights.iter().sum::<f64>();
        let inside = weights.iter().all(|&weight| weight >= 0.0);
        if inside && depth > 0.0 && depth < image.depth[index] {
            image.depth[index] = depth;
            image.color[index] =
                Vertex::mix(triangle, weights.map(|weight| weight * depth)).color();
        }
    }
}
