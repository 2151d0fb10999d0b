//! The woods over the hills: trees and undergrowth, strewn by noise, clear of ways and walkers.

use std::f32::consts::TAU;

use glam::{EulerRot, Quat, Vec2, Vec3};

use crate::noise::{lerp, random, smoothstep};
use crate::path::CameraPath;
use crate::scene::Placed;
use crate::shapes::ShapeId;
use crate::shapes::terrain::{self, PLAZA, SIDE_IN_M, TEMPLE, TOMB};

/// Side of the squares in each of which one tree may stand.
const TREE_SPACING_IN_M: f32 = 6.1;
/// The same for bushes, grass and stones, which grow near the ways only.
const UNDERGROWTH_SPACING_IN_M: f32 = 2.3;
/// Undergrowth further off the avenue than this is not seen.
const UNDERGROWTH_REACH_IN_M: f32 = 62.0;

/// All trees, bushes, tufts and stones.
pub(crate) fn grow(path: &CameraPath) -> Vec<Placed> {
    let walker = Walker::new(path);
    let wild = squares(TREE_SPACING_IN_M, SIDE_IN_M / 2.0 - 3.0, 701).filter_map(tree);
    let trees = wild.chain(planted_cypresses());
    let low = squares(UNDERGROWTH_SPACING_IN_M, 130.0, 731).filter_map(undergrowth);
    trees
        .chain(low)
        .filter(|placed| walker.passes(placed))
        .collect()
}

/// A point in each square of the ground, with a number of its own.
fn squares(side_in_m: f32, reach_in_m: f32, seed: u32) -> impl Iterator<Item = (u32, Vec2)> {
    let count = (2.0 * reach_in_m / side_in_m) as u32;
    (0..count * count).map(move |i| {
        let corner = Vec2::new((i % count) as f32, (i / count) as f32);
        let aside = Vec2::new(random(i * 2, seed), random(i * 2 + 1, seed));
        (i, (corner + aside) * side_in_m - reach_in_m)
    })
}

fn tree((index, at): (u32, Vec2)) -> Option<Placed> {
    let draw = |k: u32| random(index * 8 + k, 711);
    if draw(0) > terrain::woodland(at) || terrain::distance_to_way(at) < 10.0 {
        return None;
    }
    let high = smoothstep(8.0, 30.0, terrain::broad_height(at)) + 0.5 * (draw(1) - 0.5);
    let variant = u8::from(draw(2) > 0.5);
    let shape = match high {
        _ if draw(3) < 0.12 => ShapeId::Cypress,
        ..0.55 => ShapeId::Oak(variant),
        _ => ShapeId::Pine(variant),
    };
    let tree = standing(shape, at, index, lerp(0.8, 1.4, draw(4)));
    let is_level = terrain::height(at) - tree.position.y < 0.4;
    is_level.then_some(tree)
}

/// A tree upright but for a slight lean, its foot as low as the ground around it.
fn standing(shape: ShapeId, at: Vec2, seed: u32, scale: f32) -> Placed {
    let draw = |k: u32| random(seed * 4 + k, 721);
    let around =
        [Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y].map(|aside| terrain::height(at + 0.45 * aside));
    let lowest = around.into_iter().fold(terrain::height(at), f32::min);
    let lean = 0.08 * (draw(1) - 0.5);
    Placed {
        shape,
        position: Vec3::new(at.x, lowest, at.y),
        rotation: Quat::from_euler(EulerRot::YXZ, draw(0) * TAU, lean, 0.5 * lean),
        scale,
    }
}

/// Rows behind the columns of the avenue, and a ring around the plaza.
fn planted_cypresses() -> impl Iterator<Item = Placed> {
    let row = (0..14).map(|i| {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        Vec2::new(13.5 * side, 65.0 - 11.0 * (i / 2) as f32)
    });
    let ring = (0..16).map(|i| PLAZA + Vec2::from_angle(TAU * (i as f32 + 0.5) / 16.0) * 30.0);
    let off_the_avenue = |at: &Vec2| at.x.abs() > 12.0 || at.y < PLAZA.y;
    let spots = row.chain(ring.filter(off_the_avenue)).enumerate();
    spots.map(|(i, at)| {
        let seed = 900_000 + i as u32;
        standing(
            ShapeId::Cypress,
            at,
            seed,
            lerp(0.85, 1.1, random(seed, 727)),
        )
    })
}

fn undergrowth((index, at): (u32, Vec2)) -> Option<Placed> {
    let draw = |k: u32| random(index * 8 + k, 741);
    let off_the_way = terrain::distance_to_way(at);
    let near = 1.0 - smoothstep(0.0, UNDERGROWTH_REACH_IN_M, off_the_way);
    if terrain::distance_to_paving(at) < 0.9 || draw(0) > 0.62 * near {
        return None;
    }
    let (shape, scale) = match draw(1) + 0.25 * terrain::woodland(at) {
        ..0.68 => (ShapeId::Tuft, lerp(0.8, 1.7, draw(2))),
        ..0.84 => (ShapeId::Stone, lerp(0.09, 0.30, draw(2) * draw(3))),
        _ if off_the_way < 4.0 => (ShapeId::Tuft, lerp(1.2, 1.9, draw(2))),
        _ => (ShapeId::Bush, lerp(0.7, 1.6, draw(2))),
    };
    Some(standing(shape, at, 500_000 + index, scale))
}

/// What must stay free for the one who walks.
struct Walker {
    eyes: Vec<Vec3>,
    /// Looks through the telescope: origin and direction.
    looks: Vec<(Vec3, Vec3)>,
}

impl Walker {
    fn new(path: &CameraPath) -> Self {
        let poses: Vec<_> = (0..600).map(|i| path.pose(i as f32 / 600.0)).collect();
        let through_the_telescope = poses.iter().filter(|pose| pose.fov_in_rad < 0.4);
        Self {
            eyes: poses.iter().map(|pose| pose.eye).collect(),
            looks: through_the_telescope
                .map(|pose| (pose.eye, (pose.target - pose.eye).normalize()))
                .collect(),
        }
    }

    /// Whether something may stand there.
    fn passes(&self, placed: &Placed) -> bool {
        let (reach, top) = extent(placed);
        let at = Vec2::new(placed.position.x, placed.position.z);
        let is_small = top < 2.0 * placed.scale;
        let off_the_temples = [(TEMPLE, 17.0), (TOMB, 13.0)]
            .into_iter()
            .all(|(temple, radius)| is_small || at.distance(temple) > radius + 0.3 * reach);
        let off_the_path = self.eyes.iter().all(|eye| {
            at.distance(Vec2::new(eye.x, eye.z)) > reach + if is_small { 0.9 } else { 2.5 }
        });
        let out_of_sight = |(eye, along): &(Vec3, Vec3)| {
            let flat = Vec2::new(along.x, along.z);
            let distance = (at - Vec2::new(eye.x, eye.z)).dot(flat) / flat.length_squared();
            let on_the_line = *eye + *along * distance.max(0.0);
            let aside = at.distance(Vec2::new(on_the_line.x, on_the_line.z));
            let wide = 1.0 + 0.03 * distance.max(0.0);
            aside > reach + wide || placed.position.y + top < on_the_line.y - 0.7 * wide
        };
        off_the_temples && off_the_path && self.looks.iter().all(out_of_sight)
    }
}

/// The radius around the upright axis and the height of what grows here, at its scale.
fn extent(placed: &Placed) -> (f32, f32) {
    let (reach, top) = match placed.shape {
        ShapeId::Oak(_) => (4.3, 7.3),
        ShapeId::Pine(_) => (4.9, 9.2),
        ShapeId::Cypress => (1.3, 9.4),
        ShapeId::Bush => (0.95, 1.1),
        _ => (1.35, 1.2),
    };
    (reach * placed.scale, top * placed.scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extents_hold_the_shapes() {
        let shapes = crate::shapes::generated();
        let kinds = [
            ShapeId::Oak(0),
            ShapeId::Oak(1),
            ShapeId::Pine(0),
            ShapeId::Pine(1),
            ShapeId::Cypress,
            ShapeId::Bush,
            ShapeId::Tuft,
            ShapeId::Stone,
        ];
        for id in kinds {
            let placed = standing(id, Vec2::ZERO, 1, 1.0);
            let (reach, top) = extent(&placed);
            let tallest = shapes[&id]
                .positions
                .iter()
                .map(|p| p.y)
                .fold(0.0, f32::max);
            let widest = shapes[&id].reach();
            assert!(
                (0.5 * reach..=reach).contains(&widest) || widest < 1.35,
                "{id:?}: {widest} m wide"
            );
            assert!(tallest <= top, "{id:?}: {tallest} m tall");
        }
    }

    #[test]
    fn trees_stand_on_the_ground_and_off_the_ways() {
        for placed in grow(&CameraPath::new()) {
            let at = Vec2::new(placed.position.x, placed.position.z);
            let ground = terrain::height(at);
            assert!(
                (-0.45..=0.0).contains(&(placed.position.y - ground)),
                "{placed:?}"
            );
            assert!(terrain::distance_to_paving(at) > 0.8, "{placed:?}");
        }
    }

    #[test]
    fn the_telescope_sees_the_round_temple() {
        let path = CameraPath::new();
        let tops: Vec<_> = grow(&path)
            .iter()
            .map(|placed| (placed.position, extent(placed)))
            .collect();
        let looks = (0..1000)
            .map(|i| path.pose(i as f32 / 1000.0))
            .filter(|pose| pose.fov_in_rad < 0.2);
        let mut count = 0;
        for pose in looks {
            count += 1;
            let end = Vec3::new(TOMB.x, terrain::height(TOMB) + 4.0, TOMB.y);
            let looked = (pose.target - pose.eye).angle_between(end - pose.eye);
            assert!(looked < 0.3 * pose.fov_in_rad, "{looked} rad aside");
            for i in 1..200 {
                let p = pose.eye.lerp(end, i as f32 / 200.0);
                let at = Vec2::new(p.x, p.z);
                assert!(p.y > terrain::height(at) + 0.5, "the ground at {p}");
                let hidden = |&(foot, (reach, top)): &(Vec3, (f32, f32))| {
                    at.distance(Vec2::new(foot.x, foot.z)) < reach && p.y < foot.y + top
                };
                assert!(!tops.iter().any(hidden), "a tree at {p}");
            }
        }
        assert!(count > 20, "{count}");
    }
}
