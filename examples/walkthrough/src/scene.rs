//! What stands where: the list of placed shapes that every mode of the program shares.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Affine3A, EulerRot, Quat, Vec2, Vec3};

use crate::noise::{fbm, lerp, random};
use crate::path::CameraPath;
use crate::shapes::ShapeId;
use crate::shapes::terrain::{self, PLAZA, TEMPLE, TEMPLE_HEIGHT_IN_M, TOMB, TOMB_HEIGHT_IN_M};
use crate::woods;

/// One instance of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) shape: ShapeId,
    pub(crate) position: Vec3,
    pub(crate) rotation: Quat,
    pub(crate) scale: f32,
}

impl Placed {
    pub(crate) fn world_from_local(&self) -> Affine3A {
        let scale = Vec3::splat(self.scale);
        Affine3A::from_scale_rotation_translation(scale, self.rotation, self.position)
    }

    pub(crate) fn on_ground(shape: ShapeId, at: Vec2, facing_in_rad: f32, scale: f32) -> Self {
        Self {
            shape,
            position: Vec3::new(at.x, terrain::height(at), at.y),
            rotation: Quat::from_rotation_y(facing_in_rad),
            scale,
        }
    }
}

/// Everything in the scene, always the same.
pub(crate) fn layout() -> Vec<Placed> {
    let mut scene = vec![Placed {
        shape: ShapeId::Terrain,
        position: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        scale: 1.0,
    }];
    scene.extend(avenue());
    scene.extend(plaza());
    scene.extend(temple());
    scene.extend(tomb());
    scene.extend(fallen_drums());
    scene.extend(lamps());
    let path = CameraPath::new();
    scene.extend(rocks(&path));
    scene.extend(woods::grow(&path));
    scene
}

/// Spots beside the start of the avenue where models named on the command line stand, between the
/// columns, turned towards one who comes through the gate.
pub(crate) fn guest_spots() -> impl Iterator<Item = Placed> {
    (0..).map(|i| {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let at = Vec2::new(4.7 * side, 59.0 - 6.0 * (i / 2) as f32);
        let ground = Placed::on_ground(ShapeId::Knot, at, -0.7 * side, 1.0);
        Placed {
            position: ground.position + Vec3::Y * PLINTH_IN_M.y,
            ..ground
        }
    })
}

/// Size of the plinth below each of [`guest_spots`].
pub(crate) const PLINTH_IN_M: Vec3 = Vec3::new(2.4, 0.7, 2.4);

/// The longest side of a model named on the command line, once it stands there.
const GUEST_SIZE_IN_M: f32 = 3.0;

/// Scales a model with these bounds to its size in the scene and puts it on its feet at the origin.
pub(crate) fn fit_guest(min: Vec3, max: Vec3) -> Affine3A {
    let scale = GUEST_SIZE_IN_M / (max - min).max_element().max(f32::MIN_POSITIVE);
    let feet = Vec3::new((min.x + max.x) * 0.5, min.y, (min.z + max.z) * 0.5);
    Affine3A::from_scale(Vec3::splat(scale)) * Affine3A::from_translation(-feet)
}

fn column(at: Vec2, seed: u32, broken_share: f32) -> Placed {
    let broken = random(seed, 401) < broken_share;
    let shape = if broken {
        ShapeId::BrokenColumn
    } else {
        ShapeId::Column
    };
    // Quarter turns keep the square plinths in line.
    let quarter = (random(seed, 402) * 4.0).floor() * FRAC_PI_2;
    Placed::on_ground(shape, at, quarter, 1.0)
}

/// The gate, the colonnade, and a pair of kings at its end.
fn avenue() -> Vec<Placed> {
    let mut placed = vec![Placed::on_ground(
        ShapeId::Gate,
        Vec2::new(0.0, 70.0),
        0.0,
        1.0,
    )];
    for (pair, side) in (0..10).flat_map(|pair| [(pair, -1.0), (pair, 1.0)]) {
        let at = Vec2::new(6.0 * side, 62.0 - 6.0 * pair as f32);
        let seed = pair * 2 + u32::from(side > 0.0);
        placed.push(column(at, seed, 0.28));
    }
    for side in [-1.0, 1.0] {
        let at = Vec2::new(8.2 * side, 3.2);
        placed.push(Placed::on_ground(
            ShapeId::SeatedFigure,
            at,
            -0.25 * side,
            2.1,
        ));
    }
    placed
}

/// The great knot, a circle of statues and a ring of columns around it.
fn plaza() -> Vec<Placed> {
    let mut placed = vec![Placed::on_ground(ShapeId::Knot, PLAZA, 0.35, 2.3)];
    for i in 0..6 {
        let angle = TAU * (i as f32 + 0.5) / 6.0;
        let at = PLAZA + Vec2::from_angle(angle) * 14.5;
        let (shape, scale) = if i % 2 == 0 {
            (ShapeId::SeatedFigure, 1.25)
        } else {
            (ShapeId::Knot, 0.9)
        };
        placed.push(Placed::on_ground(shape, at, facing(at, PLAZA), scale));
    }
    for i in 0..22 {
        let angle = TAU * i as f32 / 22.0;
        let at = PLAZA + Vec2::from_angle(angle) * 20.5;
        let on_the_way = at.x.abs() < 7.5 && at.y > PLAZA.y;
        let before_the_exit = at.distance(Vec2::new(-18.5, -32.5)) < 4.5;
        if !on_the_way && !before_the_exit {
            placed.push(column(at, 100 + i, 0.35));
        }
    }
    placed
}

/// The turn about Y that makes a shape at `from` look at `to`; shapes look along +Z.
fn facing(from: Vec2, to: Vec2) -> f32 {
    let along = to - from;
    along.x.atan2(along.y)
}

/// A small temple on its terrace: columns around a king.
fn temple() -> Vec<Placed> {
    let mut placed = Vec::new();
    for (i, j) in (0..6).flat_map(|i| (0..4).map(move |j| (i, j))) {
        if (1..5).contains(&i) && (1..3).contains(&j) {
            continue;
        }
        let at = TEMPLE + Vec2::new(3.3 * (j as f32 - 1.5), 3.1 * (i as f32 - 2.5));
        placed.push(column(at, 200 + i * 4 + j, 0.2));
    }
    placed.push(Placed {
        position: Vec3::new(TEMPLE.x, TEMPLE_HEIGHT_IN_M - 0.1, TEMPLE.y),
        ..Placed::on_ground(ShapeId::SeatedFigure, TEMPLE, FRAC_PI_2, 1.7)
    });
    placed
}

/// A round temple in the far hills: a ring of columns around a knot.
fn tomb() -> Vec<Placed> {
    let at_height = |shape, at: Vec2, facing_in_rad, scale| Placed {
        position: Vec3::new(at.x, TOMB_HEIGHT_IN_M + 0.1, at.y),
        ..Placed::on_ground(shape, at, facing_in_rad, scale)
    };
    let ring = (0..9).map(|i| {
        let at = TOMB + Vec2::from_angle(TAU * i as f32 / 9.0) * 5.4;
        let shape = column(at, 300 + i, 0.25).shape;
        at_height(shape, at, facing(at, TOMB), 1.0)
    });
    let knot = at_height(ShapeId::Knot, TOMB, -FRAC_PI_2, 1.5);
    ring.chain([knot]).collect()
}

/// Fire bowls beside the way; by night they burn.
pub(crate) fn lamps() -> impl Iterator<Item = Placed> {
    let spots = [(3.9, 47.0), (-3.9, 23.0), (8.8, -9.0), (-8.6, -27.5)];
    spots
        .into_iter()
        .map(|(x, z)| Placed::on_ground(ShapeId::Lamp, Vec2::new(x, z), 0.0, 1.0))
}

/// Stumps lying beside the avenue and on the plaza.
fn fallen_drums() -> Vec<Placed> {
    let spots = [
        (9.6, 51.0),
        (-9.8, 44.0),
        (-9.2, 27.0),
        (9.9, 21.0),
        (12.5, -1.0),
        (-13.0, 0.5),
        (16.5, -15.0),
        (-1.5, -38.5),
        (-38.0, 36.0),
        (13.0, 76.0),
    ];
    let lie = |(i, (x, z)): (usize, (f32, f32))| {
        let at = Vec2::new(x, z);
        let turn = random(i as u32, 431) * TAU;
        let upright = Placed::on_ground(ShapeId::BrokenColumn, at, 0.0, 0.9);
        Placed {
            position: upright.position + Vec3::Y * 0.5,
            rotation: Quat::from_euler(EulerRot::YXZ, turn, FRAC_PI_2 * 0.97, turn * 3.0),
            ..upright
        }
    };
    spots.into_iter().enumerate().map(lie).collect()
}

const ROCKS: usize = 165;

/// Boulders in the wild, gathered in drifts, clear of the paving and of the path.
fn rocks(path: &CameraPath) -> Vec<Placed> {
    let eyes: Vec<_> = (0..400).map(|i| path.pose(i as f32 / 400.0).eye).collect();
    let free = |rock: &Placed| {
        let at = Vec2::new(rock.position.x, rock.position.z);
        let off_the_avenue = at.x.abs() > 8.2 + 1.3 * rock.scale || at.y > 92.0;
        let off_the_plaza = at.distance(PLAZA) > 23.0 + 1.3 * rock.scale;
        let off_the_temple = (at - TEMPLE).abs().max_element() > 10.0 + 1.3 * rock.scale;
        let off_the_path = eyes
            .iter()
            .all(|eye| eye.distance(rock.position) > 3.0 + 1.4 * rock.scale);
        off_the_avenue && off_the_plaza && off_the_temple && off_the_path
    };
    (0..).filter_map(rock).filter(free).take(ROCKS).collect()
}

fn rock(seed: u32) -> Option<Placed> {
    let draw = |k: u32| random(seed * 8 + k, 501);
    let at = Vec2::from_angle(draw(0) * TAU) * lerp(10.0, 108.0, draw(1).sqrt());
    let drift = fbm(Vec3::new(at.x, 5.0, at.y) * 0.045, 2, 511);
    if drift < draw(2) * 0.9 - 0.25 {
        return None;
    }
    let scale = lerp(0.35, 1.1, draw(3)) + 2.6 * draw(4).powi(4);
    let upright = Placed::on_ground(ShapeId::Rock((seed % 3) as u8), at, 0.0, scale);
    Some(Placed {
        position: upright.position - Vec3::Y * 0.22 * scale,
        rotation: Quat::from_euler(
            EulerRot::YXZ,
            draw(5) * TAU,
            (draw(6) - 0.5) * 0.7,
            (draw(7) - 0.5) * PI,
        ),
        ..upright
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scene_has_thousands_of_instances_and_more_than_a_hundred_million_triangles() {
        let shapes = crate::shapes::generated();
        let scene = layout();
        let triangles: u64 = scene
            .iter()
            .map(|p| shapes[&p.shape].triangle_count())
            .sum();
        assert!((3_000..=6_000).contains(&scene.len()), "{}", scene.len());
        assert!(triangles > 100_000_000, "{triangles}");
    }

    #[test]
    fn guests_are_scaled_to_the_same_size_and_stand_on_their_feet() {
        let (min, max) = (Vec3::new(10.0, 20.0, 30.0), Vec3::new(70.0, 50.0, 60.0));
        let fit = fit_guest(min, max);
        let (low, high) = (fit.transform_point3(min), fit.transform_point3(max));
        assert!((high - low).max_element() - GUEST_SIZE_IN_M < 1e-5);
        assert!(low.y.abs() < 1e-5 && (low.x + high.x).abs() < 1e-5);
    }

    #[test]
    fn the_camera_path_touches_nothing() {
        let shapes = crate::shapes::generated();
        let path = CameraPath::new();
        for placed in layout() {
            if matches!(placed.shape, ShapeId::Terrain | ShapeId::Gate) {
                continue; // The ground has its own test; the gate is walked through.
            }
            let reach = shapes[&placed.shape].reach() * placed.scale;
            for i in 0..1000 {
                let eye = path.pose(i as f32 / 1000.0).eye;
                let aside = Vec2::new(eye.x, eye.z)
                    .distance(Vec2::new(placed.position.x, placed.position.z));
                let above = eye.y - placed.position.y;
                let tallest = match placed.shape {
                    ShapeId::Rock(_) | ShapeId::Stone | ShapeId::Bush | ShapeId::Tuft => 1.5,
                    ShapeId::Oak(_) | ShapeId::Pine(_) | ShapeId::Cypress => 10.0,
                    _ => 7.5,
                };
                let clear = aside > reach + 0.5 || above > tallest * placed.scale + 0.5;
                assert!(clear, "{placed:?} at round {}, {eye}", i as f32 / 1000.0);
            }
        }
    }

    #[test]
    fn the_path_goes_through_the_middle_of_the_gate() {
        let path = CameraPath::new();
        let crossings = (0..2000).map(|i| path.pose(i as f32 / 2000.0).eye);
        let inside = crossings.filter(|eye| (eye.z - 70.0).abs() < 1.5 && eye.x.abs() < 6.0);
        let widest = inside.map(|eye| eye.x.abs()).fold(0.0, f32::max);
        assert!((0.0001..1.2).contains(&widest), "{widest} m off the middle");
    }
}
