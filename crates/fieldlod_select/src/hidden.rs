//! Visible flux: the visible shares of instances and groups, by a small depth image of the view. The CPU draws the
//! image from coarse levels of large, near instances.
//!
//! The flux of the camera-sampling field is over the *visible* surface (P.-H. Lin and T.-Y. Lee, eq. 8). Hasselgren,
//! Andersson and Akenine-Möller, "Masked Software Occlusion Culling" (2016), draw a similar image to cull. Here nothing
//! is culled: the image weighs errors, and hidden instances are drawn at their coarsest levels.
//!
//! # Conventions
//! A texel holds the *nearness* of the nearest surface: `1/z` in a perspective view, which is linear over a triangle in
//! the image, `−z` in an orthographic one; `−∞` without a surface. The front faces of an occluder fill the texels whose
//! centres they cover. This is an estimate, which may be too large or too small.
//!
//! Eight texels at once have the same bits as one at a time; `hidden/tests.rs` compares them.

mod boxes;
mod choice;
pub(crate) mod held_shares;
mod image_plane;
pub(crate) mod occluder;
mod queries;
mod screen_triangle;
pub(crate) mod shares;
pub(crate) mod surface_samples;
#[cfg(test)]
mod tests;
mod texels;
pub(crate) mod visible_shares;

use fieldlod_hierarchy::Sphere;
use glam::{Mat3, Vec3};
use wide::f32x8;

use crate::lanes::bits::{LANES, set_bits_of};
use crate::lanes::{M3, V3, bits_of};
use crate::scene::Scene;
use crate::view::View;
use choice::{ChosenOccluder, DrawnBy, OccluderChoice, camera_from_local};
use image_plane::{ImagePlane, NEAREST};
use occluder::OccluderMesh;
use screen_triangle::{Corner, parts_in_front};
use texels::Texels;

/// Elements of eight points that are drawn between two tests whether any of them is in front. Fewer elements end the
/// drawing of visible instances too early; more elements draw hidden instances longer.
const STRETCH: usize = 8;

/// The depth image of one view.
#[derive(Clone, Debug)]
pub struct OcclusionBuffer {
    view: View,
    plane: ImagePlane,
    choice: OccluderChoice,
    texels: Texels,
    /// The least nearness of each texel and its eight neighbours.
    shrunk: Vec<f32>,
    row: Vec<f32>,
    /// Corners of the occluder that is being drawn.
    corners: Vec<Corner>,
}

impl OcclusionBuffer {
    /// Draws the occluders of a scene in a view, with up to `triangles` triangles.
    #[must_use]
    pub fn new(scene: &Scene, view: &View, triangles: u32) -> Self {
        let mut buffer = Self::empty(view);
        buffer.redraw(scene, view, triangles);
        buffer
    }

    /// An empty image.
    pub(crate) fn empty(view: &View) -> Self {
        Self {
            view: *view,
            plane: ImagePlane::new(&view.image_camera),
            choice: OccluderChoice::default(),
            texels: Texels::default(),
            shrunk: Vec::new(),
            row: Vec::new(),
            corners: Vec::new(),
        }
    }

    /// Draws another view, or another state of a scene.
    pub(crate) fn redraw(&mut self, scene: &Scene, view: &View, triangles: u32) {
        self.clear(view);
        let mut choice = std::mem::take(&mut self.choice);
        choice.begin(scene, view, &self.plane);
        for index in 0..choice.candidates.len() {
            let candidate = choice.candidates[index];
            // An occluder behind other occluders hides nothing more.
            if self.covers(&scene.instances[candidate.instance as usize].sphere) {
                continue;
            }
            let chosen = choice.choose(scene, view, &self.plane, triangles, candidate);
            if let Some(occluder) = chosen {
                choice.note_points(self.draw(scene, &occluder));
            }
        }
        self.choice = choice;
        self.shrink();
    }

    fn clear(&mut self, view: &View) {
        self.view = *view;
        self.plane = ImagePlane::new(&view.image_camera);
        let texels = self.plane.width * self.plane.height;
        self.texels.clear(self.plane.width, self.plane.height);
        self.shrunk.clear();
        self.shrunk.resize(texels, f32::NEG_INFINITY);
        self.row.resize(self.plane.width, f32::NEG_INFINITY);
    }

    /// Nearness of each texel, row by row from the upper left: `1/z` in a perspective view, `−z` in an orthographic
    /// one, `−∞` without a surface.
    #[must_use]
    pub fn nearness(&self) -> &[f32] {
        &self.texels.nearness
    }

    /// Whether nearer surfaces fill all texels around a sphere.
    fn covers(&self, sphere: &Sphere) -> bool {
        let from_eye = sphere.center - self.view.eye_in_world;
        let center = self.view.camera_from_world * from_eye;
        let Some(place) = self.plane.rectangle(center, sphere.radius) else {
            return false;
        };
        let mut rows = place.rows.map(|row| self.texels.row(row));
        rows.all(|row| {
            let mut columns = row[place.columns.clone()].iter();
            columns.all(|&nearness| nearness > place.nearest)
        })
    }

    /// Draws one instance. Returns the number of points that this took.
    fn draw(&mut self, scene: &Scene, occluder: &ChosenOccluder) -> usize {
        let (table, owner) = (scene.table(occluder.mesh), occluder.instance);
        let placement = &scene.instances[owner as usize].world_from_local;
        let (linear, origin) = camera_from_local(&self.view, placement);
        match occluder.drawn_by {
            DrawnBy::Level(level) => {
                self.draw_mesh(&table.occluders[level], &linear, origin, owner);
                0
            }
            DrawnBy::Points(count) => {
                let points = table.samples.of_mesh(count);
                self.draw_points(points, &linear, origin, owner)
            }
        }
    }

    /// Draws one level of an instance.
    fn draw_mesh(&mut self, mesh: &OccluderMesh, linear: &Mat3, origin: Vec3, owner: u32) {
        let (plane, is_mirrored) = (self.plane, linear.determinant() < 0.0);
        for part in mesh.parts_in_view(&plane, linear, origin) {
            for triangle in part.placed_triangles(&plane, linear, origin, &mut self.corners) {
                parts_in_front(&plane, triangle, is_mirrored, NEAREST, |part| {
                    self.texels.draw(part, owner);
                });
            }
        }
    }

    /// Draws an instance by points of one texel each, until none of [`STRETCH`] elements is in front. Returns the
    /// number of points.
    fn draw_points(
        &mut self,
        points: &[V3<f32x8>],
        linear: &Mat3,
        origin: Vec3,
        owner: u32,
    ) -> usize {
        let (linear, origin) = (M3::splat(linear), V3::splat(origin));
        let mut drawn = 0;
        for stretch in points.chunks(STRETCH) {
            let mut is_in_front = false;
            for point in stretch {
                is_in_front |= self.draw_eight(linear.of(*point).plus(origin), owner);
            }
            drawn += stretch.len() * LANES;
            if !is_in_front {
                break;
            }
        }
        drawn
    }

    /// Draws eight points of camera space. Returns `true` if any point is the nearest of its texel.
    #[inline(always)]
    fn draw_eight(&mut self, point: V3<f32x8>, owner: u32) -> bool {
        let at = self.plane.project(point);
        let has_place = self.plane.has_place(at, point.z);
        let texels = self.plane.texels_at(at, has_place);
        let nearness = at.z.to_array();
        let mut is_in_front = false;
        for lane in set_bits_of(bits_of(has_place)) {
            is_in_front |= self
                .texels
                .keep_nearer(texels[lane] as usize, nearness[lane], owner);
        }
        is_in_front
    }

    /// Computes the least nearness of each texel and its neighbours.
    fn shrink(&mut self) {
        let (width, height) = (self.plane.width, self.plane.height);
        // The least of three in each row, then of three rows.
        for row in 0..height {
            least_of_three(
                self.texels.row(row),
                &mut self.shrunk[row * width..][..width],
            );
        }
        let mut above = std::mem::take(&mut self.row);
        above.copy_from_slice(&self.shrunk[..width]);
        for row in 0..height {
            let (now, below) = self.shrunk[row * width..].split_at_mut(width);
            let below = if row + 1 < height {
                &below[..width]
            } else {
                &[]
            };
            for column in 0..width {
                let own = now[column];
                let least = smaller(above[column], own);
                now[column] = below
                    .get(column)
                    .map_or(least, |&below| smaller(least, below));
                above[column] = own;
            }
        }
        self.row = above;
    }
}

/// The centres of the first eight texels of a row.
const CENTRES: f32x8 = f32x8::new([0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5]);

fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The least of each number and its two neighbours.
fn least_of_three(from: &[f32], to: &mut [f32]) {
    let last = from.len() - 1;
    to[0] = smaller(from[0], from[last.min(1)]);
    to[last] = smaller(from[last], from[last.saturating_sub(1)]);
    for (to, from) in to[1..].iter_mut().zip(from.windows(3)) {
        *to = smaller(smaller(from[0], from[1]), from[2]);
    }
}
