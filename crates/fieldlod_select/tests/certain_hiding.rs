//! What is hidden for certain changes no pixel, however coarse it is drawn.

mod common;

use common::{hierarchies, look, perspective};
use fieldlod_select::{InstanceId, LodSettings, Scene, Selector, View, VisibleFlux};
use glam::{Affine3A, Mat4, Vec3};

const WIDTH: usize = 960;
const HEIGHT: usize = 540;
const FOV_Y: f32 = 1.0;
/// The tangent of half of that.
const SLOPE: f32 = 0.546_302_5;

/// Which unit of which instance each pixel shows.
struct Picture {
    pixels: Vec<(f32, u32, u32)>,
    camera_from_world: Mat4,
}

impl Picture {
    fn new(camera_from_world: Mat4) -> Self {
        Self {
            pixels: vec![(0.0, u32::MAX, 0); WIDTH * HEIGHT],
            camera_from_world,
        }
    }

    /// Draws the units of an instance.
    fn draw(&mut self, mesh: usize, placement: &Affine3A, owner: u32, units: &[u32]) {
        let hierarchy = &hierarchies()[mesh];
        let camera_from_local = self.camera_from_world * Mat4::from(*placement);
        for &unit in units {
            for triangle in hierarchy.triangles_of(&hierarchy.units[unit as usize]) {
                let corners = triangle.map(|vertex| {
                    let at = hierarchy.vertices.positions[vertex as usize];
                    camera_from_local.transform_point3(at)
                });
                // The scenes of this file lie ahead of the eye.
                if corners.iter().all(|corner| corner.z < -0.01) {
                    self.fill(corners.map(in_pixels), owner, unit);
                }
            }
        }
    }

    fn fill(&mut self, [a, b, c]: [Vec3; 3], owner: u32, unit: u32) {
        let cross = |u: Vec3, v: Vec3| u.x * v.y - u.y * v.x;
        let area = cross(b - a, c - a);
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        for y in min.y.max(0.0) as usize..(max.y.max(0.0) as usize + 1).min(HEIGHT) {
            for x in min.x.max(0.0) as usize..(max.x.max(0.0) as usize + 1).min(WIDTH) {
                let at = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 0.0);
                let weights = [
                    cross(c - b, at - b),
                    cross(a - c, at - c),
                    cross(b - a, at - a),
                ];
                let weights = weights.map(|weight| weight / area);
                let nearness = weights[0] * a.z + weights[1] * b.z + weights[2] * c.z;
                let pixel = &mut self.pixels[y * WIDTH + x];
                if weights.iter().all(|&weight| weight >= 0.0) && nearness > pixel.0 {
                    *pixel = (nearness, owner, unit);
                }
            }
        }
    }
}

/// A place in pixels, and how near it is.
fn in_pixels(at: Vec3) -> Vec3 {
    let focal_px = HEIGHT as f32 * 0.5 / SLOPE;
    let nearness = -1.0 / at.z;
    Vec3::new(
        WIDTH as f32 * 0.5 + at.x * focal_px * nearness,
        HEIGHT as f32 * 0.5 - at.y * focal_px * nearness,
        nearness,
    )
}

/// Numbers from 0 to 1.
struct Random(u32);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 24) as f32
    }

    fn place(&mut self, from: Vec3, to: Vec3) -> Vec3 {
        from + Vec3::new(self.next(), self.next(), self.next()) * (to - from)
    }
}

/// Walls and rocks, and many small things behind them.
fn placements(seed: u32) -> Vec<(usize, Affine3A)> {
    let mut random = Random(seed);
    let mut placed = Vec::new();
    let placement =
        |at: Vec3, scale: Vec3| Affine3A::from_translation(at) * Affine3A::from_scale(scale);
    for _ in 0..4 {
        let at = random.place(Vec3::new(-5.0, -1.0, -9.0), Vec3::new(5.0, 1.0, -6.0));
        let size = 1.0 + random.next() * 2.0;
        placed.push((0, placement(at, Vec3::new(size, size, 0.3 + random.next()))));
    }
    for _ in 0..60 {
        let at = random.place(Vec3::new(-10.0, -1.5, -40.0), Vec3::new(10.0, 1.5, -11.0));
        placed.push((0, placement(at, Vec3::splat(0.2 + random.next() * 0.5))));
    }
    placed
}

/// How many pixels differ between the cuts with what is hidden for certain and without, and how many
/// triangles both draw.
fn compare(seed: u32, settings: &LodSettings) -> (usize, [u64; 2]) {
    let placed = placements(seed);
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(&hierarchies()[0]);
    let ids: Vec<InstanceId> = placed
        .iter()
        .map(|(_, placement)| scene.add_instance(mesh, *placement, 1.0))
        .collect();
    scene.update();
    let eye = Vec3::new(0.3, 0.2, 0.0);
    let target = Vec3::new(0.0, 0.0, -12.0);
    let view: View = look(perspective(FOV_Y), eye, target);
    let camera_from_world = Mat4::look_at_rh(eye, target, Vec3::new(0.1, 1.0, 0.05));
    let plain = LodSettings {
        visible_flux: None,
        ..*settings
    };
    let [with, without] = [*settings, plain].map(|settings| {
        let mut selector = Selector::default();
        selector.select(&scene, &view, &settings);
        let mut picture = Picture::new(camera_from_world);
        for (owner, (id, (mesh, placement))) in (0..).zip(ids.iter().zip(&placed)) {
            picture.draw(*mesh, placement, owner, selector.units(&scene, *id));
        }
        (picture, selector.triangle_count())
    });
    let pixels = with.0.pixels.iter().zip(&without.0.pixels);
    let different = pixels.filter(|(a, b)| a != b).count();
    (different, [with.1, without.1])
}

#[test]
fn no_pixel_changes_by_what_is_hidden_for_certain() {
    let mut triangles = [0, 0];
    for displacement_px in [0.5, 1.0, 3.0] {
        let settings = LodSettings {
            visible_flux: Some(VisibleFlux::default()),
            ..LodSettings::guaranteed(displacement_px)
        };
        let mut drawn = [0, 0];
        for seed in 1..5 {
            let (different, [with, without]) = compare(seed, &settings);
            assert_eq!(different, 0, "scene {seed} at {displacement_px} px");
            drawn = [drawn[0] + with, drawn[1] + without];
        }
        println!("{displacement_px} px: {drawn:?} triangles with and without hiding");
        triangles = [triangles[0] + drawn[0], triangles[1] + drawn[1]];
    }
    assert!(triangles[0] * 100 < triangles[1] * 85, "{triangles:?}");
}
