//! Generated worlds: hills with props, a street, a wood.

use std::f32::consts::TAU;

use fieldlod_bake::{MeshError, SourceMesh, fixtures};
use fieldlod_hierarchy::fixtures::Random;
use glam::{Affine3A, Quat, Vec2, Vec3};

use super::shapes::{house, tree};
use super::world::World;
use crate::eye::Eye;

/// Height of an eye above the ground, in metres.
const EYE_HEIGHT: f32 = 1.7;
/// Smallest distance from an eye to the circle that stays free around an instance, in metres. Nearer, one instance
/// would fill most of the picture.
const EYE_CLEARANCE: f32 = 2.5;

/// Frames of each world. Fewer depend more on the places of single eyes; each frame is drawn up to twelve times.
const FRAMES: usize = 6;

/// The worlds, each with frames of a size in pixels.
///
/// # Errors
/// [`MeshError`] if a mesh could not be baked.
pub fn generated_worlds(size_px: Vec2) -> Result<Vec<World>, MeshError> {
    let maker = |name, side, relief| Maker::new(name, side, relief, size_px);
    Ok(vec![
        hills(maker("hills", 240.0, 0.8)?)?,
        street(maker("street", 200.0, 0.0)?)?,
        wood(maker("wood", 120.0, 0.4)?)?,
    ])
}

/// Hills of 19 m with rocks, knots and trees.
fn hills(mut maker: Maker) -> Result<World, MeshError> {
    for seed in 0..3 {
        maker.scatter(&fixtures::rock(4, seed), true, 90, 0.4..2.4)?;
        maker.scatter(&tree(9.0, 14, seed), true, 50, 0.8..1.3)?;
    }
    maker.scatter(&fixtures::torus_knot(256, 40), false, 50, 0.5..1.0)?;
    Ok(maker.with_eyes(TAU))
}

/// Six rows of houses, 22 m apart, with trees, rocks and knots between and around them.
fn street(mut maker: Maker) -> Result<World, MeshError> {
    let sizes = [[14.0, 9.0, 9.0], [14.0, 12.5, 10.0], [14.0, 6.5, 8.0]];
    let mut houses = Vec::new();
    for size in sizes {
        houses.push(maker.world.add_mesh(&house(size.into()), false)?);
    }
    // Houses stand in rows, with a gap after every third house.
    for (row, house) in (0..6).flat_map(|row| (0..9).map(move |house| (row, house))) {
        let along = (house as f32 - 4.0) * 15.0 + (house / 3) as f32 * 6.0 - 6.0;
        let across = [-55.0, -33.0, -11.0, 11.0, 33.0, 55.0][row];
        let turn = Quat::from_rotation_y(if row % 2 == 0 { TAU / 2.0 } else { 0.0 });
        let place = Affine3A::from_rotation_translation(turn, Vec3::new(along, 0.0, across));
        let kind = houses[maker.random.index(3)];
        maker.put(kind, place, 7.5);
    }
    for seed in 0..3 {
        maker.scatter(&tree(7.0, 14, seed), true, 60, 0.8..1.2)?;
        maker.scatter(&fixtures::rock(4, seed), true, 50, 0.3..0.9)?;
    }
    maker.scatter(&fixtures::torus_knot(256, 40), false, 40, 0.3..0.5)?;
    Ok(maker.with_eyes(TAU * 0.2))
}

/// Nine hundred trees and some rocks on uneven ground.
fn wood(mut maker: Maker) -> Result<World, MeshError> {
    for seed in 0..3 {
        maker.scatter(&tree(11.0, 16, seed), true, 300, 0.7..1.3)?;
        maker.scatter(&fixtures::rock(4, seed), true, 60, 0.3..1.2)?;
    }
    Ok(maker.with_eyes(TAU))
}

/// A world in construction, with a ground.
struct Maker {
    world: World,
    random: Random,
    side: f32,
    size_px: Vec2,
    /// The mesh of the ground, a grid of `cells × cells` cells.
    ground: SourceMesh,
    cells: usize,
    /// Centers of the instances, and the radius around each that stays free.
    taken: Vec<(Vec2, f32)>,
}

impl Maker {
    /// A square ground with `relief` times the heights of a [`fixtures::height_field`].
    fn new(name: &str, side: f32, relief: f32, size_px: Vec2) -> Result<Self, MeshError> {
        let cells = 384;
        let mut ground = fixtures::height_field(cells);
        for position in &mut ground.positions {
            *position = (*position - Vec3::new(0.5, 0.0, 0.5)) * side * Vec3::new(1.0, relief, 1.0);
        }
        let ground = fixtures::with_smooth_normals(ground);
        let mut world = World::new(name);
        let number = world.add_mesh(&ground, false)?;
        world.place(number, Affine3A::IDENTITY);
        Ok(Self {
            world,
            random: Random::new(side as u64),
            side,
            size_px,
            ground,
            cells: cells as usize,
            taken: Vec::new(),
        })
    }

    fn height(&self, at: Vec2) -> f32 {
        let cell = ((at / self.side + 0.5) * self.cells as f32).round();
        let [i, j] = cell
            .to_array()
            .map(|it| (it.max(0.0) as usize).min(self.cells));
        self.ground.positions[i * (self.cells + 1) + j].y
    }

    fn put(&mut self, mesh: usize, place: Affine3A, radius: f32) {
        self.world.place(mesh, place);
        let at = place.translation;
        self.taken.push((Vec2::new(at.x, at.z), radius));
    }

    /// A random place with no instance within `distance`, or any place after 100 tries. `share` is the used part of
    /// each side of the ground.
    fn free_place(&mut self, share: f32, distance: f32) -> Vec2 {
        let mut at = Vec2::ZERO;
        for _ in 0..100 {
            at = Vec2::new(self.random.signed(), self.random.signed()) * (self.side * 0.5 * share);
            let mut taken = self.taken.iter();
            if taken.all(|(other, radius)| other.distance(at) > distance + radius) {
                break;
            }
        }
        at
    }

    /// Scatters `count` instances of a mesh over the ground.
    fn scatter(
        &mut self,
        mesh: &SourceMesh,
        as_a_whole: bool,
        count: usize,
        scales: std::ops::Range<f32>,
    ) -> Result<(), MeshError> {
        let number = self.world.add_mesh(mesh, as_a_whole)?;
        for _ in 0..count {
            let scale = scales.start + (scales.end - scales.start) * self.random.unit();
            let at = self.free_place(0.95, 0.3);
            let place = Affine3A::from_scale_rotation_translation(
                Vec3::splat(scale),
                Quat::from_rotation_y(self.random.unit() * TAU),
                Vec3::new(at.x, self.height(at), at.y),
            );
            self.put(number, place, scale * 0.5);
        }
        Ok(())
    }

    /// Adds eyes at the height of a pedestrian. They look along +x and −x in turn, off by at most half of `spread`.
    fn with_eyes(mut self, spread: f32) -> World {
        for frame in 0..FRAMES {
            // Eyes keep away from the border of the ground, beyond which nothing is drawn.
            let at = self.free_place(0.6, EYE_CLEARANCE);
            let from = Vec3::new(at.x, self.height(at) + EYE_HEIGHT, at.y);
            let angle = (self.random.unit() - 0.5) * spread + (frame % 2) as f32 * TAU * 0.5;
            let to = Vec3::new(angle.cos(), -0.03, angle.sin());
            let eye = Eye::perspective(60.0, self.size_px, 0.1);
            self.world.look(eye.looking_at(from, from + to));
        }
        self.world
    }
}
