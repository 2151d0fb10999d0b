//! The woods: noise distributes trees and undergrowth, which keep away from the paving and the camera.

use std::f32::consts::TAU;

use bevy::prelude::*;

use super::placed::{Placed, ring};
use crate::cameras::path::CameraPath;
use crate::noise::{random, smoothstep};
use crate::shapes::ShapeId;
use crate::shapes::terrain::{self, PLAZA, SIDE_IN_M, TEMPLE, TOMB};

/// Side of the squares of the tree grid; each square has at most one tree.
const TREE_SPACING_IN_M: f32 = 6.1;
/// Side of the squares of the undergrowth grid; each square has at most one bush, tuft of grass or stone.
const UNDERGROWTH_SPACING_IN_M: f32 = 2.3;
/// The distance from the avenue at which undergrowth ends.
const UNDERGROWTH_LIMIT_IN_M: f32 = 62.0;

/// A `share`, from 0 to 1, of all trees, bushes, tufts and stones. A larger share includes all objects of a smaller
/// one.
pub(crate) fn grow(path: &CameraPath, share: f32) -> Vec<Placed> {
    let camera = CameraClearance::new(path);
    let wild = squares(TREE_SPACING_IN_M, SIDE_IN_M / 2.0 - 3.0, 701).filter_map(tree);
    let low = squares(UNDERGROWTH_SPACING_IN_M, 130.0, 731).filter_map(undergrowth);
    let all = wild.chain(planted_cypresses()).chain(low);
    let free = all.filter(|placed| camera.allows(placed));
    let numbered = (0..).zip(free);
    let kept = numbered.filter(|(number, _)| random(*number, 751) <= share);
    kept.map(|(_, placed)| placed).collect()
}

/// A random point in each square of a grid around the origin, with the number of the square.
fn squares(side_in_m: f32, half_side_in_m: f32, seed: u32) -> impl Iterator<Item = (u32, Vec2)> {
    let count = (2.0 * half_side_in_m / side_in_m) as u32;
    (0..count * count).map(move |i| {
        let corner = Vec2::new((i % count) as f32, (i / count) as f32);
        let aside = Vec2::new(random(i * 2, seed), random(i * 2 + 1, seed));
        (i, (corner + aside) * side_in_m - half_side_in_m)
    })
}

/// The tree in a numbered square, if one grows there.
fn tree((index, at): (u32, Vec2)) -> Option<Placed> {
    let draw = |k: u32| random(index * 8 + k, 711);
    if draw(0) > terrain::woodland(at) || terrain::distance_to_avenue(at) < 10.0 {
        return None;
    }
    let high = smoothstep(8.0, 30.0, terrain::broad_height(at)) + 0.5 * (draw(1) - 0.5);
    let variant = u8::from(draw(2) > 0.5);
    let shape = match high {
        _ if draw(3) < 0.12 => ShapeId::Cypress,
        ..0.55 => ShapeId::Oak(variant),
        _ => ShapeId::Pine(variant),
    };
    let tree = standing(shape, at, index, f32::lerp(0.8, 1.4, draw(4)));
    let is_level = terrain::height(at) - tree.transform.translation.y < 0.4;
    is_level.then_some(tree)
}

/// A plant with a slight lean. Its foot is as low as the lowest ground around it, so that no root hangs in the air.
fn standing(shape: ShapeId, at: Vec2, seed: u32, scale: f32) -> Placed {
    let draw = |k: u32| random(seed * 4 + k, 721);
    let around =
        [Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y].map(|aside| terrain::height(at + 0.45 * aside));
    let lowest = around.into_iter().fold(terrain::height(at), f32::min);
    let lean = 0.08 * (draw(1) - 0.5);
    let leaning = Quat::from_euler(EulerRot::YXZ, draw(0) * TAU, lean, 0.5 * lean);
    Placed::at_height(shape, at, lowest, 0.0, scale).turned(leaning)
}

/// Cypresses in rows behind the columns of the avenue, and in a ring around the plaza.
fn planted_cypresses() -> impl Iterator<Item = Placed> {
    let row = (0..14).map(|i| {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        Vec2::new(13.5 * side, 65.0 - 11.0 * (i / 2) as f32)
    });
    let circle = ring(PLAZA, 30.0, 16, 0.5).map(|(_, at)| at);
    let off_the_avenue = |at: &Vec2| at.x.abs() > 12.0 || at.y < PLAZA.y;
    let spots = row.chain(circle.filter(off_the_avenue));
    // Seeds of planted trees start beyond the numbers of the squares.
    (900_000..).zip(spots).map(|(seed, at)| {
        let scale = f32::lerp(0.85, 1.1, random(seed, 727));
        standing(ShapeId::Cypress, at, seed, scale)
    })
}

/// The bush, tuft or stone in a numbered square, if there is one.
fn undergrowth((index, at): (u32, Vec2)) -> Option<Placed> {
    let draw = |k: u32| random(index * 8 + k, 741);
    let off_the_avenue = terrain::distance_to_avenue(at);
    let near = 1.0 - smoothstep(0.0, UNDERGROWTH_LIMIT_IN_M, off_the_avenue);
    if terrain::distance_to_paving(at) < 0.9 || draw(0) > 0.62 * near {
        return None;
    }
    let (shape, scale) = match draw(1) + 0.25 * terrain::woodland(at) {
        ..0.68 => (ShapeId::Tuft, f32::lerp(0.8, 1.7, draw(2))),
        ..0.84 => (ShapeId::Stone, f32::lerp(0.09, 0.30, draw(2) * draw(3))),
        _ if off_the_avenue < 4.0 => (ShapeId::Tuft, f32::lerp(1.2, 1.9, draw(2))),
        _ => (ShapeId::Bush, f32::lerp(0.7, 1.6, draw(2))),
    };
    // The offset keeps the seeds apart from those of the trees.
    Some(standing(shape, at, 500_000 + index, scale))
}

/// The space to keep free for the camera.
struct CameraClearance {
    eyes: Vec<Vec2>,
    /// Origins and directions of views through the telescope.
    telescope: Vec<(Vec3, Vec3)>,
}

impl CameraClearance {
    fn new(path: &CameraPath) -> Self {
        let poses: Vec<_> = (0..600).map(|i| path.pose(i as f32 / 600.0)).collect();
        let narrow = poses.iter().filter(|pose| pose.fov_in_rad < 0.4);
        Self {
            eyes: poses.iter().map(|pose| pose.eye.xz()).collect(),
            telescope: narrow
                .map(|pose| (pose.eye, (pose.target - pose.eye).normalize()))
                .collect(),
        }
    }

    /// Returns `true` if an object leaves the space free.
    fn allows(&self, placed: &Placed) -> bool {
        let (radius, height) = extent(placed);
        let at = placed.at();
        let is_small = height < 2.0 * placed.scale();
        // Large plants keep away from the temples.
        let temples = [(TEMPLE, 17.0), (TOMB, 13.0)];
        let hides_temple = |(temple, clearing): (Vec2, f32)| {
            !is_small && at.distance(temple) <= clearing + 0.3 * radius
        };
        // Plants keep away from the camera's path.
        let margin = if is_small { 0.9 } else { 2.5 };
        let is_in_the_way = |eye: &Vec2| at.distance(*eye) <= radius + margin;
        // Plants stay outside or below the view of the telescope.
        let top = placed.transform.translation.y + height;
        let hides_view = |&(eye, along): &(Vec3, Vec3)| {
            let distance = (at - eye.xz()).dot(along.xz()) / along.xz().length_squared();
            let on_the_line = eye + along * distance.max(0.0);
            let wide = 1.0 + 0.03 * distance.max(0.0);
            at.distance(on_the_line.xz()) <= radius + wide && top >= on_the_line.y - 0.7 * wide
        };
        !temples.into_iter().any(hides_temple)
            && !self.eyes.iter().any(is_in_the_way)
            && !self.telescope.iter().any(hides_view)
    }
}

/// The radius around the upright axis and the height of a scaled plant.
fn extent(placed: &Placed) -> (f32, f32) {
    let (radius, height) = match placed.shape {
        ShapeId::Oak(_) => (4.3, 7.3),
        ShapeId::Pine(_) => (4.9, 9.2),
        ShapeId::Cypress => (1.3, 9.4),
        ShapeId::Bush => (0.95, 1.1),
        _ => (1.35, 1.2),
    };
    (radius * placed.scale(), height * placed.scale())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plants_are_on_the_ground_and_off_the_paving() {
        for placed in grow(&CameraPath::new(), 1.0) {
            let at = placed.at();
            let ground = terrain::height(at);
            assert!(
                (-0.45..=0.0).contains(&(placed.transform.translation.y - ground)),
                "{placed:?}"
            );
            assert!(terrain::distance_to_paving(at) > 0.8, "{placed:?}");
        }
    }
}
