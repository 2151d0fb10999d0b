//! The layout of the scene: the list of placed shapes.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use bevy::prelude::*;

use super::placed::{Placed, ring};
use super::woods;
use crate::cameras::path::CameraPath;
use crate::noise::{fbm, random};
use crate::shapes::ShapeId;
use crate::shapes::terrain::{self, PLAZA, TEMPLE, TEMPLE_HEIGHT_IN_M, TOMB, TOMB_HEIGHT_IN_M};

/// All objects of the scene, equal on every call. `vegetation` is the share of plants and stones to keep.
pub(crate) fn place_all(vegetation: f32) -> Vec<Placed> {
    let path = CameraPath::new();
    let terrain = Placed::at_height(ShapeId::Terrain, Vec2::ZERO, 0.0, 0.0, 1.0);
    let mut scene = vec![terrain];
    scene.extend(avenue());
    scene.extend(plaza());
    scene.extend(temple());
    scene.extend(tomb());
    scene.extend(fallen_drums());
    scene.extend(rocks(&path));
    scene.extend(woods::grow(&path, vegetation));
    scene
}

/// Size of the plinth below each of [`model_spots`].
pub(crate) const PLINTH_IN_M: Vec3 = Vec3::new(2.4, 0.7, 2.4);

/// The longest side of a user's model in the scene.
const MODEL_SIZE_IN_M: f32 = 3.0;

/// Spots for models of the user: between the columns at the start of the avenue. The models face the gate.
pub(crate) fn model_spots() -> impl Iterator<Item = Transform> {
    (0..).map(|i| {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let at = Vec2::new(4.7 * side, 59.0 - 6.0 * (i / 2) as f32);
        Transform::from_xyz(at.x, terrain::height(at) + PLINTH_IN_M.y, at.y)
            .with_rotation(Quat::from_rotation_y(-0.7 * side))
    })
}

/// Scales a model with these bounds to [`MODEL_SIZE_IN_M`] and moves the middle of its foot to the origin.
pub(crate) fn fit_model(min: Vec3, max: Vec3) -> Transform {
    let scale = MODEL_SIZE_IN_M / (max - min).max_element().max(f32::MIN_POSITIVE);
    let feet = min.midpoint(max).with_y(min.y);
    Transform::from_translation(-feet * scale).with_scale(Vec3::splat(scale))
}

/// A column. `broken_share` is the probability that it is broken.
fn column(at: Vec2, seed: u32, broken_share: f32) -> Placed {
    let shape = if random(seed, 401) < broken_share {
        ShapeId::BrokenColumn
    } else {
        ShapeId::Column
    };
    // Only quarter turns are used, so that the square plinths stay in line.
    let quarter = (random(seed, 402) * 4.0).floor() * FRAC_PI_2;
    Placed::on_ground(shape, at, quarter, 1.0)
}

/// The gate, the columns of the avenue, and two kings at its end.
fn avenue() -> impl Iterator<Item = Placed> {
    let gate = Placed::on_ground(ShapeId::Gate, Vec2::new(0.0, 70.0), 0.0, 1.0);
    let columns = (0..20).map(|i| {
        let side = if i % 2 == 0 { -1.0 } else { 1.0 };
        column(Vec2::new(6.0 * side, 62.0 - 6.0 * (i / 2) as f32), i, 0.28)
    });
    let kings = [-1.0, 1.0].map(|side| {
        let at = Vec2::new(8.2 * side, 3.2);
        Placed::on_ground(ShapeId::SeatedFigure, at, -0.25 * side, 2.1)
    });
    [gate].into_iter().chain(columns).chain(kings)
}

/// The great knot with a circle of statues and a ring of columns around it.
fn plaza() -> impl Iterator<Item = Placed> {
    let knot = Placed::on_ground(ShapeId::Knot, PLAZA, 0.35, 2.3);
    let statues = ring(PLAZA, 14.5, 6, 0.5).map(|(i, at)| {
        let (shape, scale) = match i % 2 {
            0 => (ShapeId::SeatedFigure, 1.25),
            _ => (ShapeId::Knot, 0.9),
        };
        Placed::on_ground(shape, at, facing(at, PLAZA), scale)
    });
    // The ring of columns has gaps where the avenue enters and where the camera leaves.
    let is_free = |(_, at): &(u32, Vec2)| {
        let on_the_avenue = at.x.abs() < 7.5 && at.y > PLAZA.y;
        !on_the_avenue && at.distance(Vec2::new(-18.5, -32.5)) >= 4.5
    };
    let columns = ring(PLAZA, 20.5, 22, 0.0).filter(is_free);
    let columns = columns.map(|(i, at)| column(at, 100 + i, 0.35));
    [knot].into_iter().chain(statues).chain(columns)
}

/// The turn around Y that makes a shape at `from` look at `to`. Shapes look along +Z.
fn facing(from: Vec2, to: Vec2) -> f32 {
    let along = to - from;
    along.x.atan2(along.y)
}

/// A small temple on its terrace: columns around a king.
fn temple() -> impl Iterator<Item = Placed> {
    let places = (0..6).flat_map(|i| (0..4).map(move |j| (i, j)));
    let outer = places.filter(|(i, j)| !(1..5).contains(i) || !(1..3).contains(j));
    let columns = outer.map(|(i, j)| {
        let aside = Vec2::new(3.3 * (j as f32 - 1.5), 3.1 * (i as f32 - 2.5));
        column(TEMPLE + aside, 200 + i * 4 + j, 0.2)
    });
    let height = TEMPLE_HEIGHT_IN_M - 0.1;
    let king = Placed::at_height(ShapeId::SeatedFigure, TEMPLE, height, FRAC_PI_2, 1.7);
    columns.chain([king])
}

/// A round temple in the far hills: a ring of columns around a knot.
fn tomb() -> impl Iterator<Item = Placed> {
    let height = TOMB_HEIGHT_IN_M + 0.1;
    let columns = ring(TOMB, 5.4, 9, 0.0).map(move |(i, at)| {
        let shape = column(at, 300 + i, 0.25).shape;
        Placed::at_height(shape, at, height, facing(at, TOMB), 1.0)
    });
    let knot = Placed::at_height(ShapeId::Knot, TOMB, height, -FRAC_PI_2, 1.5);
    columns.chain([knot])
}

const FALLEN_DRUMS: [Vec2; 10] = [
    Vec2::new(9.6, 51.0),
    Vec2::new(-9.8, 44.0),
    Vec2::new(-9.2, 27.0),
    Vec2::new(9.9, 21.0),
    Vec2::new(12.5, -1.0),
    Vec2::new(-13.0, 0.5),
    Vec2::new(16.5, -15.0),
    Vec2::new(-1.5, -38.5),
    Vec2::new(-38.0, 36.0),
    Vec2::new(13.0, 76.0),
];

/// Stumps lying beside the avenue, on the plaza and near the temple.
fn fallen_drums() -> impl Iterator<Item = Placed> {
    (0..).zip(FALLEN_DRUMS).map(|(i, at)| {
        let turn = random(i, 431) * TAU;
        let lying = Quat::from_euler(EulerRot::YXZ, turn, FRAC_PI_2 * 0.97, turn * 3.0);
        let upright = Placed::on_ground(ShapeId::BrokenColumn, at, 0.0, 0.9);
        // The radius of the scaled shaft is 0.5 m, so the stump touches the ground.
        upright.raised(0.5).turned(lying)
    })
}

const ROCKS: usize = 165;

/// Boulders in groups, which keep away from the paving and from the camera's path.
fn rocks(path: &CameraPath) -> Vec<Placed> {
    let eyes: Vec<_> = (0..400).map(|i| path.pose(i as f32 / 400.0).eye).collect();
    let is_free = |rock: &Placed| {
        let (at, radius) = (rock.at(), 1.3 * rock.scale());
        let off_the_avenue = at.x.abs() > 8.2 + radius || at.y > 92.0;
        let off_the_plaza = at.distance(PLAZA) > 23.0 + radius;
        let off_the_temple = (at - TEMPLE).abs().max_element() > 10.0 + radius;
        let foot = rock.transform.translation;
        let near_the_path = |eye: &Vec3| eye.distance(foot) <= 3.0 + 1.4 * rock.scale();
        off_the_avenue && off_the_plaza && off_the_temple && !eyes.iter().any(near_the_path)
    };
    (0..).filter_map(rock).filter(is_free).take(ROCKS).collect()
}

/// The boulder of a seed; `None` outside of the groups.
fn rock(seed: u32) -> Option<Placed> {
    let draw = |k: u32| random(seed * 8 + k, 501);
    let at = Vec2::from_angle(draw(0) * TAU) * f32::lerp(10.0, 108.0, draw(1).sqrt());
    let density = fbm(Vec3::new(at.x, 5.0, at.y) * 0.045, 2, 511);
    if density < draw(2) * 0.9 - 0.25 {
        return None;
    }
    // The fourth power makes large boulders rare.
    let scale = f32::lerp(0.35, 1.1, draw(3)) + 2.6 * draw(4).powi(4);
    let (yaw, pitch, roll) = (draw(5) * TAU, (draw(6) - 0.5) * 0.7, (draw(7) - 0.5) * PI);
    let tilted = Quat::from_euler(EulerRot::YXZ, yaw, pitch, roll);
    let upright = Placed::on_ground(ShapeId::Rock((seed % 3) as u8), at, 0.0, scale);
    // The foot is in the ground, so that no gap shows on a slope.
    Some(upright.raised(-0.22 * scale).turned(tilted))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scene_has_over_a_hundred_million_triangles() {
        let shapes = crate::shapes::generated();
        let scene = place_all(1.0);
        let triangles: u64 = scene
            .iter()
            .map(|p| shapes[&p.shape].triangle_count())
            .sum();
        assert!((3_000..=6_000).contains(&scene.len()), "{}", scene.len());
        assert!(triangles > 100_000_000, "{triangles}");
    }

    #[test]
    fn reduced_vegetation_keeps_other_objects() {
        let grows = |placed: &Placed| {
            matches!(
                placed.shape,
                ShapeId::Oak(_)
                    | ShapeId::Pine(_)
                    | ShapeId::Cypress
                    | ShapeId::Bush
                    | ShapeId::Tuft
                    | ShapeId::Stone
            )
        };
        let [full, half]: [(Vec<_>, Vec<_>); 2] =
            [1.0, 0.5].map(|share| place_all(share).into_iter().partition(grows));
        assert!((0.45..0.55).contains(&(half.0.len() as f32 / full.0.len() as f32)));
        assert!(half.0.iter().all(|placed| full.0.contains(placed)));
        assert_eq!(half.1, full.1);
    }

    #[test]
    fn camera_path_touches_no_object() {
        let shapes = crate::shapes::generated();
        let path = CameraPath::new();
        for placed in place_all(1.0) {
            if matches!(placed.shape, ShapeId::Terrain | ShapeId::Gate) {
                continue; // The ground has its own test, and the camera walks through the gate.
            }
            let radius = shapes[&placed.shape].radius() * placed.scale();
            for i in 0..1000 {
                let eye = path.pose(i as f32 / 1000.0).eye;
                let aside = eye.xz().distance(placed.at());
                let above = eye.y - placed.transform.translation.y;
                let tallest = match placed.shape {
                    ShapeId::Rock(_) | ShapeId::Stone | ShapeId::Bush | ShapeId::Tuft => 1.5,
                    ShapeId::Oak(_) | ShapeId::Pine(_) | ShapeId::Cypress => 10.0,
                    _ => 7.5,
                };
                let clear = aside > radius + 0.5 || above > tallest * placed.scale() + 0.5;
                assert!(clear, "{placed:?} at round {}, {eye}", i as f32 / 1000.0);
            }
        }
    }
}
