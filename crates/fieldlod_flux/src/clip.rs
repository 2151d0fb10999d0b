//! Clips triangles to a guard band around the image.
//!
//! `f32` would lose the depths of a triangle that reaches far beyond the image. A ground 1,000 m wide below the camera
//! has corners a hundred million texels away. These triangles are clipped in `f64`. Each texel then has the nearness of
//! the surface within a twentieth of a texel of its centre.

use glam::{DVec3, Vec3};

use crate::image_plane::ImagePlane;

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    in_camera: Vec3,
    /// Texel coordinates and nearness, if the corner is in front of the camera.
    in_image: Vec3,
    is_in_guard_band: bool,
}

impl Corner {
    #[inline(always)]
    pub(crate) fn new(plane: &ImagePlane, in_camera: Vec3) -> Self {
        let in_image = plane.project(in_camera);
        Self {
            in_camera,
            in_image,
            is_in_guard_band: plane.is_in_guard_band(in_image, in_camera.z),
        }
    }
}

/// Calls `draw` with the image corners of a triangle, or of each part of a clipped triangle.
#[inline(always)]
pub(crate) fn clipped_parts(
    plane: &ImagePlane,
    corners: [Corner; 3],
    is_mirrored: bool,
    mut draw: impl FnMut([Vec3; 3]),
) {
    let [a, b, c] = corners;
    let corners = if is_mirrored { [a, c, b] } else { corners };
    // Nearly all triangles are not clipped.
    if corners.iter().all(|corner| corner.is_in_guard_band) {
        return draw(corners.map(|corner| corner.in_image));
    }
    let polygon = clip(plane, corners);
    // A fan from the first corner.
    for last in 2..polygon.len() {
        draw([0, last - 1, last].map(|index| polygon[index].in_image));
    }
}

/// A corner of a clipped triangle.
#[derive(Clone, Copy)]
struct Vertex {
    /// As in [`ImagePlane::homogeneous`].
    at: DVec3,
    in_image: Vec3,
}

/// The part of a triangle in the guard band: a convex polygon.
#[cold]
fn clip(plane: &ImagePlane, corners: [Corner; 3]) -> Vec<Vertex> {
    let vertex = |corner: Corner| Vertex {
        at: plane.homogeneous(corner.in_camera),
        in_image: corner.in_image,
    };
    let mut polygon = Vec::from(corners.map(vertex));
    for side in 0..ImagePlane::GUARD_SIDES {
        let inside_by = |vertex: &Vertex| plane.inside_guard_band(vertex.at)[side];
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (index, from) in polygon.iter().enumerate() {
            let to = &polygon[(index + 1) % polygon.len()];
            let [is_from_in, is_to_in] = [from, to].map(|vertex| inside_by(vertex) >= 0.0);
            if is_from_in {
                kept.push(*from);
            }
            if is_from_in != is_to_in {
                // Cut from the inner end: both triangles at an edge then cut it at the same point.
                let (inner, outer) = if is_from_in { (from, to) } else { (to, from) };
                let share = inside_by(inner) / (inside_by(inner) - inside_by(outer));
                let at = inner.at + (outer.at - inner.at) * share;
                let in_image = plane.of_homogeneous(at);
                kept.push(Vertex { at, in_image });
            }
        }
        polygon = kept;
    }
    polygon
}
