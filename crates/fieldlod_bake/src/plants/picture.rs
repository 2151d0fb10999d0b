//! Small orthographic pictures of a level, rasterized on the CPU with a depth buffer.
//!
//! The albedo is the vertex colour, or gray, times the texture if it is known. Light comes from above and from the eye.
//! Triangles are two-sided. Transparent texels are skipped. Triangles with an unknown surface are opaque or have a
//! given opacity.

use fieldlod_hierarchy::Sphere;
use glam::{Vec2, Vec3, Vec4};

use crate::mesh::edges::hash_of;
use crate::mesh::surface::Surface;
use crate::mesh::surfaces::picture_color;

/// Background colour in linear light.
const BACKGROUND: f32 = 0.2;
/// Cosine between a normal and the eye direction below which the normal is flipped. Smooth normals near a silhouette
/// may point slightly away from the eye.
const FLIP_BELOW: f32 = -0.15;

/// A square picture in row order. Each pixel is a colour in linear light and the covered share.
#[derive(Clone)]
pub(crate) struct Picture {
    pub(crate) side: usize,
    pub(crate) pixels: Vec<Vec4>,
}

/// The axes of a view.
#[derive(Clone, Copy)]
pub(crate) struct Viewpoint {
    /// Directions towards the eye, to the right and upwards.
    eye: Vec3,
    right: Vec3,
    up: Vec3,
}

/// Vertices and surfaces to draw.
pub(crate) struct Model<'a> {
    pub(crate) positions: &'a [Vec3],
    /// One per position, or empty.
    pub(crate) normals: &'a [Vec3],
    pub(crate) colors: &'a [Vec4],
    /// Known surfaces and the texture coordinates that they use: one per position, or empty. A triangle uses the
    /// surface of its first corner.
    pub(crate) surfaces: &'a [Option<&'a Surface>],
    pub(crate) uvs: &'a [Vec2],
    /// Alpha of the vertex colours: one per position, or empty.
    pub(crate) alphas: &'a [f32],
    /// The sphere that fits the picture.
    pub(crate) sphere: Sphere,
    /// Factor for vertex colours.
    pub(crate) exposure: f32,
}

impl Viewpoint {
    /// One of `count` directions on a spiral from pole to pole.
    pub(crate) fn around(index: usize, count: usize) -> Self {
        let y = 1.0 - 2.0 * (index as f32 + 0.5) / count as f32;
        let across = (1.0 - y * y).max(0.0).sqrt();
        // Rotation by the golden angle. Sines would differ between machines.
        let turn = Vec2::new(-0.737_368_9, 0.675_490_3);
        let at = (0..index).fold(Vec2::X, |at, _| at.rotate(turn).normalize_or(Vec2::X));
        let eye = Vec3::new(across * at.x, y, across * at.y);
        let right = Vec3::Y.cross(eye).normalize_or(Vec3::X);
        Self {
            eye,
            right,
            up: eye.cross(right),
        }
    }
}

impl Model<'_> {
    /// Draws triangles into a square of `side` pixels.
    pub(crate) fn draw(&self, triangles: &[[u32; 3]], view: &Viewpoint, side: usize) -> Picture {
        let mut canvas = Canvas::new(side);
        for triangle in triangles {
            let Some(raster) = self.raster(triangle, view, side) else {
                continue;
            };
            // Colours of the corners are computed only if a pixel is drawn.
            let mut colors = None;
            let surface = self.surface(triangle);
            raster.each_pixel(|index, shares, near| {
                canvas.draw(index, near, || {
                    let tint = match surface {
                        Some(surface) => {
                            let alpha = self.alpha_at(triangle, shares);
                            (surface.opacity_of_vertex(alpha) > 0.0).then_some(())?;
                            surface.drawn_at(self.uv_at(triangle, shares))?
                        }
                        None => Vec3::ONE,
                    };
                    let colors = colors
                        .get_or_insert_with(|| triangle.map(|v| self.color(v, triangle, view)));
                    let [a, b, c] = *colors;
                    Some((a * shares.x + b * shares.y + c * shares.z) * tint)
                });
            });
        }
        canvas.picture
    }

    /// Number of pixels that triangles cover together. `opacity` applies to triangles with an opaque or unknown
    /// surface.
    pub(crate) fn covered(
        &self,
        triangles: &[[u32; 3]],
        view: &Viewpoint,
        side: usize,
        opacity: impl Fn(&[u32; 3]) -> f32,
    ) -> f32 {
        // Transmittance of each pixel. Products need no order of depth.
        let mut clear = vec![1.0f32; side * side];
        for triangle in triangles {
            let Some(raster) = self.raster(triangle, view, side) else {
                continue;
            };
            if let Some(opacity) = self.opacity(triangle, raster.area()) {
                raster.each_pixel(|index, shares, _| clear[index] *= 1.0 - opacity(shares));
                continue;
            }
            let left = 1.0 - opacity(triangle);
            raster.each_pixel(|index, _, _| clear[index] *= left);
        }
        clear.iter().map(|clear| 1.0 - clear).sum()
    }

    /// Number of pixels in which each triangle is visible. Opacities are the same as in [`Self::covered`].
    pub(crate) fn visible_px(
        &self,
        triangles: &[[u32; 3]],
        view: &Viewpoint,
        side: usize,
        opacity: impl Fn(&[u32; 3]) -> f32,
    ) -> Vec<u32> {
        let mut nearest = vec![(f32::NEG_INFINITY, u32::MAX); side * side];
        for (at, triangle) in triangles.iter().enumerate() {
            let Some(raster) = self.raster(triangle, view, side) else {
                continue;
            };
            let of_surface = self.opacity(triangle, raster.area());
            let whole = opacity(triangle);
            let own = (hash_of(at as u32) >> 32) as u32;
            raster.each_pixel(|index, shares, near| {
                if near <= nearest[index].0 {
                    return;
                }
                // A half transparent triangle hides half of the pixels behind it, chosen by a hash per triangle.
                let opacity = match &of_surface {
                    Some(opacity) => opacity(shares),
                    None => whole,
                };
                if opacity >= 1.0 || random_unit(index as u32 ^ own) < opacity {
                    nearest[index] = (near, at as u32);
                }
            });
        }
        // Pixels that no triangle covers have an index that is out of range.
        let mut visible_px = vec![0; triangles.len()];
        for (_, at) in nearest {
            if let Some(visible_px) = visible_px.get_mut(at as usize) {
                *visible_px += 1;
            }
        }
        visible_px
    }

    fn surface(&self, triangle: &[u32; 3]) -> Option<&Surface> {
        *self.surfaces.get(triangle[0] as usize)?
    }

    /// A function from weights of the corners to the opacity of a triangle of `area_px` pixels. `None` if it is opaque
    /// or unknown.
    fn opacity(&self, triangle: &[u32; 3], area_px: f32) -> Option<impl Fn(Vec3) -> f32> {
        let surface = self.surface(triangle)?;
        let has_alpha = surface.uses_alpha() && !self.alphas.is_empty();
        (has_alpha || !surface.is_opaque()).then(|| {
            let (triangle, at_uv) = (*triangle, surface.opacity(self.uvs_of(triangle), area_px));
            move |shares| {
                let of_vertex = surface.opacity_of_vertex(self.alpha_at(&triangle, shares));
                at_uv(self.uv_at(&triangle, shares)) * of_vertex
            }
        })
    }

    fn alpha_at(&self, triangle: &[u32; 3], shares: Vec3) -> f32 {
        let alphas = triangle.map(|v| self.alphas.get(v as usize).copied().unwrap_or(1.0));
        Vec3::from(alphas).dot(shares)
    }

    /// Texture coordinates of the corners.
    fn uvs_of(&self, triangle: &[u32; 3]) -> [Vec2; 3] {
        triangle.map(|v| self.uvs.get(v as usize).copied().unwrap_or_default())
    }

    fn uv_at(&self, triangle: &[u32; 3], shares: Vec3) -> Vec2 {
        let [a, b, c] = self.uvs_of(triangle);
        a * shares.x + b * shares.y + c * shares.z
    }

    /// Column, row and nearness of a point in the picture.
    fn place(&self, point: Vec3, view: &Viewpoint, side: usize) -> Vec3 {
        let middle = side as f32 * 0.5;
        let scale = middle / self.sphere.radius.max(f32::MIN_POSITIVE);
        let p = point - self.sphere.center;
        let at = Vec2::new(p.dot(view.right), -p.dot(view.up)) * scale + middle;
        at.extend(p.dot(view.eye))
    }

    /// A triangle in the coordinates of the picture.
    fn raster(&self, triangle: &[u32; 3], view: &Viewpoint, side: usize) -> Option<Raster> {
        let corners = triangle.map(|v| self.place(self.positions[v as usize], view, side));
        Raster::of(corners, side)
    }

    /// Light from a vertex towards the eye.
    fn color(&self, vertex: u32, triangle: &[u32; 3], view: &Viewpoint) -> Vec3 {
        let flat = || {
            let [a, b, c] = triangle.map(|v| self.positions[v as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let normal = self.normals.get(vertex as usize).copied();
        let albedo = picture_color(self.colors.get(vertex as usize)) * self.exposure;
        albedo * brightness(normal.unwrap_or_else(flat), view)
    }
}

/// A pseudo-random number from 0 to below 1.
fn random_unit(seed: u32) -> f32 {
    // An `f32` holds 24 bits exactly.
    (hash_of(seed) >> 40) as f32 / (1u32 << 24) as f32
}

/// Share of the light that is reflected towards the eye.
fn brightness(mut normal: Vec3, view: &Viewpoint) -> f32 {
    if normal.dot(view.eye) < FLIP_BELOW {
        normal = -normal;
    }
    // Ambient light keeps surfaces that face down or away from being black, so that their colours are compared as well.
    let sky = 0.5 + 0.5 * normal.y;
    let lamp = normal.dot(view.eye).max(0.0);
    0.15 + 0.55 * sky + 0.5 * lamp
}

/// A picture and its depth buffer.
struct Canvas {
    picture: Picture,
    nearness: Vec<f32>,
}

impl Canvas {
    fn new(side: usize) -> Self {
        let nothing = Vec3::splat(BACKGROUND).extend(0.0);
        Self {
            picture: Picture {
                side,
                pixels: vec![nothing; side * side],
            },
            nearness: vec![f32::NEG_INFINITY; side * side],
        }
    }

    /// Draws a pixel unless a nearer pixel is drawn or `color` returns `None`.
    fn draw(&mut self, index: usize, near: f32, color: impl FnOnce() -> Option<Vec3>) {
        if near > self.nearness[index]
            && let Some(color) = color()
        {
            self.nearness[index] = near;
            self.picture.pixels[index] = color.extend(1.0);
        }
    }
}

/// A triangle to rasterize.
pub(crate) struct Raster {
    side: usize,
    columns: [usize; 2],
    rows: [usize; 2],
    corners: [Vec3; 3],
    /// The inverse of twice the signed area. The sign makes weights positive inside for both windings.
    per_area: f32,
}

impl Raster {
    pub(crate) fn of(corners: [Vec3; 3], side: usize) -> Option<Self> {
        let [a, b, c] = corners.map(Vec3::truncate);
        let per_area = (b - a).perp_dot(c - a).recip();
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        // Pixels whose centre may be inside.
        let range = |min: f32, max: f32| {
            let first = (min - 0.5).max(0.0).ceil() as usize;
            let end = (max + 0.5).max(0.0).floor() as usize;
            [first, end.min(side)]
        };
        let raster = Self {
            side,
            columns: range(min.x, max.x),
            rows: range(min.y, max.y),
            corners,
            per_area,
        };
        // A triangle without area covers no pixel.
        per_area.is_finite().then_some(raster)
    }

    /// Area in pixels.
    fn area(&self) -> f32 {
        0.5 * self.per_area.recip().abs()
    }

    /// Calls `draw` with the index of each pixel inside, the weights of the corners and the nearness.
    pub(crate) fn each_pixel(&self, mut draw: impl FnMut(usize, Vec3, f32)) {
        let [a, b, c] = self.corners.map(Vec3::truncate);
        let near = Vec3::new(self.corners[0].z, self.corners[1].z, self.corners[2].z);
        for row in self.rows[0]..self.rows[1] {
            for column in self.columns[0]..self.columns[1] {
                let p = Vec2::new(column as f32 + 0.5, row as f32 + 0.5);
                let shares = Vec3::new(
                    (c - b).perp_dot(p - b),
                    (a - c).perp_dot(p - c),
                    (b - a).perp_dot(p - a),
                ) * self.per_area;
                if shares.min_element() >= 0.0 {
                    draw(row * self.side + column, shares, shares.dot(near));
                }
            }
        }
    }
}

impl Picture {
    /// The picture at half the size: each pixel is the mean of four.
    pub(crate) fn halved(&self) -> Self {
        let side = self.side / 2;
        let pixel = |index: usize| {
            let first = index / side * 2 * self.side + index % side * 2;
            let rows = [first, first + self.side];
            let pairs = rows.map(|at| self.pixels[at] + self.pixels[at + 1]);
            (pairs[0] + pairs[1]) * 0.25
        };
        Self {
            side,
            pixels: (0..side * side).map(pixel).collect(),
        }
    }

    /// The picture with gamma 2: about the brightness that an eye perceives.
    pub(crate) fn encoded(&self) -> Self {
        let root = |p: &Vec4| Vec4::new(p.x.sqrt(), p.y.sqrt(), p.z.sqrt(), p.w);
        Self {
            side: self.side,
            pixels: self.pixels.iter().map(root).collect(),
        }
    }

    /// The picture blurred with the weights 1/4, 1/2, 1/4 along each axis.
    pub(crate) fn blurred(&self) -> Self {
        let side = self.side;
        let across = blurred_along(&self.pixels, 1, side, |index| index % side);
        Self {
            side,
            pixels: blurred_along(&across, side, side, |index| index / side),
        }
    }
}

/// Blurs along one axis with neighbours that are `step` apart; borders repeat their pixel.
fn blurred_along(
    pixels: &[Vec4],
    step: usize,
    side: usize,
    place: impl Fn(usize) -> usize,
) -> Vec<Vec4> {
    let pixel = |index: usize| {
        let before = if place(index) > 0 {
            index - step
        } else {
            index
        };
        let is_last = place(index) + 1 == side;
        let after = if is_last { index } else { index + step };
        pixels[index] * 0.5 + (pixels[before] + pixels[after]) * 0.25
    };
    (0..pixels.len()).map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;
    use crate::mesh::srgb::linear_of;

    #[test]
    fn nearer_opaque_triangles_hide_others() {
        // The z axis points towards the eye.
        let at = |z: f32| {
            [
                Vec3::new(-1.0, -1.0, z),
                Vec3::new(1.0, -1.0, z),
                Vec3::new(0.0, 1.0, z),
            ]
        };
        let positions = [at(0.0), at(0.5)].concat();
        let model = Model {
            positions: &positions,
            normals: &[],
            colors: &[],
            surfaces: &[],
            uvs: &[],
            alphas: &[],
            sphere: Sphere {
                center: Vec3::ZERO,
                radius: 1.5,
            },
            exposure: 1.0,
        };
        let view = Viewpoint {
            eye: Vec3::Z,
            right: Vec3::X,
            up: Vec3::Y,
        };
        let triangles = [[0, 1, 2], [3, 4, 5]];
        let visible_px = |opacity: f32| model.visible_px(&triangles, &view, 96, |_| opacity);
        let whole = 96.0f32 * 96.0 * 2.0 / 9.0;
        let [hidden, all] = visible_px(1.0)[..] else {
            panic!("expected two triangles")
        };
        assert_eq!(hidden, 0);
        assert!((all as f32 / whole - 1.0).abs() < 0.03, "{all} of {whole}");
        // The front triangle shows in half of the pixels, the back one in half of the rest.
        let [behind, before] = visible_px(0.5)[..] else {
            panic!("expected two triangles")
        };
        assert!((before as f32 / whole - 0.5).abs() < 0.05, "{before}");
        assert!((behind as f32 / whole - 0.25).abs() < 0.05, "{behind}");
    }

    #[test]
    fn pictures_show_opaque_texels_only() {
        let plane = fixtures::plane(1);
        let draw = |surface: Option<&Surface>| {
            let model = Model {
                positions: &plane.positions,
                normals: &plane.normals,
                colors: &[],
                surfaces: &vec![surface; plane.positions.len()],
                uvs: &plane.uvs,
                alphas: &[],
                sphere: Sphere::around(plane.positions.iter().copied()),
                exposure: 1.0,
            };
            let (triangles, _) = plane.indices.as_chunks();
            model.draw(triangles, &Viewpoint::around(0, 12), 64)
        };
        let covered = |picture: &Picture| picture.pixels.iter().map(|pixel| pixel.w).sum::<f32>();
        let whole = draw(None);
        let cut = draw(Some(&fixtures::cut_out(|uv| uv.x < 0.25)));
        let share = covered(&cut) / covered(&whole);
        assert!((share - 0.25).abs() < 0.02, "{share}");
        for (cut, whole) in cut
            .pixels
            .iter()
            .zip(&whole.pixels)
            .filter(|(cut, _)| cut.w > 0.0)
        {
            let tint = cut.truncate() / whole.truncate();
            let expected = Vec3::from([60, 120, 30].map(linear_of));
            assert!(tint.abs_diff_eq(expected, 1e-3), "{tint}");
        }
    }
}
