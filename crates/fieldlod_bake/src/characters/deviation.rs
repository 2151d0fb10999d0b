//! How far levels lie from their source in poses: the two-sided Hausdorff distance, measured at samples.
//!
//! A sample is a place on a triangle. It moves with the triangle's corners. The tree over a surface is built once and
//! refitted to each pose. The place that was nearest in the previous pose is a bound in the next. Most samples need no
//! search, because this bound is below the largest distance.

use glam::Vec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::character::Character;
use super::poses::Pose;
use crate::mesh::triangle_tree::triangle::nearest_point;
use crate::mesh::triangle_tree::{NearestTriangle, TriangleTree};

/// Determines the spacing of samples on all levels: about this many on the source, without corners, but at least one
/// per triangle. With half as many, CesiumMan has 3 % more triangles at equal deviation; with twice as many, all
/// characters have 1 % fewer, and bakes and measurements take 1.6 times as long.
const SAMPLES: f32 = 4096.0;
/// The largest number of sample rows on one triangle. It limits the time that a large triangle takes. With 6, CesiumMan
/// has 4 % more triangles at equal deviation; with 24, no character has fewer.
const MOST_ROWS: u32 = 12;
/// Searches end early at distances below this share of the largest. The distances of components, which decide whether a
/// small component keeps its triangles, are then upper bounds. With 0, BrainStem loses its coarsest level of 1,156
/// triangles; other levels and times stay equal. With half or double, the other characters have equal levels.
const IGNORED: f32 = 0.25;
/// Bounds below this share of the largest squared distance cannot raise it. Larger shares are within rounding errors.
const ROUNDING: f32 = 0.99;
/// A triangle is a needle if the squared sine of the angle at its first corner is smaller: its area is mostly rounding.
const NEEDLE: f32 = 1e-9;
/// The mean uses one sample in this many, because its searches cannot end early. Other searches of these samples do not
/// stop at [`IGNORED`], so that small components have some exact distances. With 4, bakes and measurements take 8 %
/// longer; with 16, 8 % less time, but the mean has fewer samples. Levels are equal.
const MEAN_STEP: usize = 8;
/// Distance between copies of a triangle while a tree is built, relative to the largest coordinate. Smaller distances
/// are lost to rounding; larger distances take copies away from their neighbours in the tree.
const COPY_STEP: f32 = 1.0 / 65_536.0;

/// A posed surface.
struct Surface {
    triangles: Vec<[u32; 3]>,
    samples: Vec<Sample>,
    /// The positions of the samples.
    places: Vec<Vec3>,
    tree: TriangleTree,
}

/// A place on a triangle.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) corners: [u32; 3],
    pub(super) weights: Vec3,
}

impl Sample {
    pub(super) fn position(&self, positions: &[Vec3]) -> Vec3 {
        let [a, b, c] = self.corners.map(|corner| positions[corner as usize]);
        a * self.weights.x + b * self.weights.y + c * self.weights.z
    }
}

impl Surface {
    /// The surface in the bind pose.
    fn of(triangles: &[[u32; 3]], character: &Character<'_>, samples: Vec<Sample>) -> Self {
        let mut surface = Self {
            samples,
            places: Vec::new(),
            tree: TriangleTree::new(distinct_corners(triangles, &character.apart)),
            triangles: triangles.to_vec(),
        };
        surface.pose(&character.mesh.positions);
        surface
    }

    /// The place on a triangle that is nearest to `point`.
    fn sample_at(&self, triangle: u32, point: Vec3, positions: &[Vec3]) -> Sample {
        let corners = self.triangles[triangle as usize];
        let places = corners.map(|corner| positions[corner as usize]);
        let weights = weights_at(nearest_point(point, places), places);
        Sample { corners, weights }
    }

    fn pose(&mut self, positions: &[Vec3]) {
        let corners = |id: u32| self.triangles[id as usize].map(|v| positions[v as usize]);
        self.tree.refit(corners);
        let places = self.samples.iter().map(|sample| sample.position(positions));
        self.places = places.collect();
    }
}

/// The largest distance of each level from its source, in both directions, over all poses. A level is a list of
/// triangles.
#[must_use]
pub fn deviations(
    character: &Character<'_>,
    poses: &[Pose],
    levels: &[impl AsRef<[[u32; 3]]> + Sync],
) -> Vec<f32> {
    let all = vec![0; character.mesh.positions.len()];
    let measured = measure(character, poses, levels, &all, false);
    measured.iter().map(|level| level.farthest[0]).collect()
}

/// For each level, the largest distance per source component, as [`deviations`]. Values far below the overall maximum
/// are upper bounds only.
pub(super) fn deviations_of_components(
    character: &Character<'_>,
    poses: &[Pose],
    levels: &[impl AsRef<[[u32; 3]]> + Sync],
) -> Vec<Vec<f32>> {
    let measured = measure(character, poses, levels, &character.component, false);
    let measured = measured.into_iter().map(|level| level.farthest);
    measured.collect()
}

/// The root mean square of each level's distances, in the pose and the direction where it is largest.
pub(super) fn mean_distances(
    character: &Character<'_>,
    poses: &[Pose],
    levels: &[impl AsRef<[[u32; 3]]> + Sync],
) -> Vec<f32> {
    let all = vec![0; character.mesh.positions.len()];
    let measured = measure(character, poses, levels, &all, true);
    measured.iter().map(|level| level.rms).collect()
}

/// Measures levels. `group` has the group of each vertex. If `is_exact`, all searches are exact, but only one sample in
/// [`MEAN_STEP`] is searched. Otherwise, searches end early at the largest distance of their group, or at [`IGNORED`].
fn measure(
    character: &Character<'_>,
    poses: &[Pose],
    levels: &[impl AsRef<[[u32; 3]]> + Sync],
    group: &[u32],
    is_exact: bool,
) -> Vec<Measured> {
    let positions = &character.mesh.positions;
    let spacing = spacing(character);
    let surface = |triangles: &[[u32; 3]]| {
        let mut samples = samples_of(triangles, positions, spacing);
        if is_exact {
            samples = samples.into_iter().step_by(MEAN_STEP).collect();
        }
        Surface::of(triangles, character, samples)
    };
    let mut source = surface(character.triangles());
    let groups = group.iter().max().map_or(1, |last| *last as usize + 1);
    let measured = |level: &_| {
        let surface = surface(AsRef::as_ref(level));
        Measured {
            from_source: vec![None; source.samples.len()],
            from_level: vec![None; surface.samples.len()],
            surface,
            farthest: vec![0.0; groups],
            rms: 0.0,
        }
    };
    let mut levels: Vec<Measured> = levels.par_iter().map(measured).collect();
    // Poses come one after the other, and levels in parallel: each search starts from the result of the previous pose.
    for pose in poses {
        let positions = pose.positions(character);
        source.pose(&positions);
        levels
            .par_iter_mut()
            .for_each(|level| level.measure(&source, &positions, group, is_exact));
    }
    levels
}

/// The samples of source and level in the bind pose, each with the nearest place on the other.
pub(super) fn nearest_pairs(character: &Character<'_>, level: &[[u32; 3]]) -> Vec<[Sample; 2]> {
    let positions = &character.mesh.positions;
    let surface = |triangles| {
        let samples = samples_of(triangles, positions, spacing(character));
        Surface::of(triangles, character, samples)
    };
    let (source, level) = (surface(character.triangles()), surface(level));
    let pairs = [(&source, &level), (&level, &source)].map(|(from, to)| {
        let pair = |(sample, place): (&Sample, &Vec3)| {
            let nearest = to.tree.nearest(*place)?;
            Some([*sample, to.sample_at(nearest.triangle, *place, positions)])
        };
        let samples = from.samples.iter().zip(&from.places);
        samples.filter_map(pair).collect::<Vec<_>>()
    });
    pairs.concat()
}

fn spacing(character: &Character<'_>) -> f32 {
    (character.area() / SAMPLES).sqrt()
}

/// The result of a sample's last search.
type Near = Option<(NearestTriangle, Sample)>;

struct Measured {
    surface: Surface,
    /// For each sample, the place that its last search found.
    from_source: Vec<Near>,
    from_level: Vec<Near>,
    /// The largest distance of each group.
    farthest: Vec<f32>,
    /// The root mean square if searches are exact.
    rms: f32,
}

impl Measured {
    fn measure(&mut self, source: &Surface, positions: &[Vec3], group: &[u32], is_exact: bool) {
        self.surface.pose(positions);
        let own = &self.surface;
        let sides = [
            (source, own, &mut self.from_source),
            (own, source, &mut self.from_level),
        ];
        for (from, to, near) in sides {
            let ignored = self.farthest.iter().copied().fold(0.0, f32::max) * IGNORED;
            let mut sum = 0.0f64;
            let samples = from.samples.iter().zip(&from.places).zip(near).enumerate();
            for (index, ((sample, &place), near)) in samples {
                let farthest = &mut self.farthest[group[sample.corners[0] as usize] as usize];
                let bound = near.map(|(_, at)| at.position(positions).distance_squared(place));
                let raised = farthest.powi(2) * ROUNDING;
                if !is_exact && bound.is_some_and(|bound| bound <= raised) {
                    continue;
                }
                let floor = if index % MEAN_STEP == 0 { 0.0 } else { ignored };
                let enough = if is_exact { 0.0 } else { farthest.max(floor) };
                let start = near.map(|(found, _)| found);
                let Some(found) = to.tree.near_enough(place, enough * enough, start) else {
                    // Only a surface without triangles has no nearest place.
                    break;
                };
                *near = Some((found, to.sample_at(found.triangle, place, positions)));
                *farthest = farthest.max(found.distance_squared.sqrt());
                sum += f64::from(found.distance_squared);
            }
            let mean = sum / from.samples.len().max(1) as f64;
            self.rms = self.rms.max(mean.sqrt() as f32);
        }
    }
}

/// The corners of triangles, with copies of a triangle shifted. A tree keeps only one of several equal triangles, but
/// poses may separate them. [`Surface::pose`] undoes the shift.
fn distinct_corners(triangles: &[[u32; 3]], positions: &[Vec3]) -> Vec<[Vec3; 3]> {
    let coordinates = positions.iter().map(|p| p.abs().max_element());
    let step = coordinates.fold(f32::MIN_POSITIVE, f32::max) * COPY_STEP;
    let mut copies: FxHashMap<[[u32; 3]; 3], u32> = FxHashMap::default();
    let shifted = triangles.iter().map(|triangle| {
        let corners = triangle.map(|vertex| positions[vertex as usize]);
        // Adding zero turns −0 into +0, so that both have the same bits.
        let bits = corners.map(|corner| corner.to_array().map(|x| (x + 0.0).to_bits()));
        let copy = copies.entry(bits).or_default();
        let shift = Vec3::X * (*copy as f32 * step);
        *copy += 1;
        corners.map(|corner| corner + shift)
    });
    shifted.collect()
}

/// Barycentric weights of a place on a triangle. The area of a needle is mostly rounding, so a place on a needle is
/// expressed by the two corners of its nearest edge.
fn weights_at(place: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, place - a);
    let normal = ab.cross(ac);
    let area_squared = normal.length_squared();
    if area_squared > NEEDLE * ab.length_squared() * ac.length_squared() {
        let y = ap.cross(ac).dot(normal) / area_squared;
        let z = ab.cross(ap).dot(normal) / area_squared;
        return Vec3::new(1.0 - y - z, y, z).clamp(Vec3::ZERO, Vec3::ONE);
    }
    let edges = [
        (a, b, Vec3::X, Vec3::Y),
        (b, c, Vec3::Y, Vec3::Z),
        (c, a, Vec3::Z, Vec3::X),
    ];
    let on_edges = edges.map(|(from, to, at_from, at_to)| {
        let along = to - from;
        let share = (place - from).dot(along) / along.length_squared();
        // NaN for an edge without length.
        let share = if share > 0.0 { share.min(1.0) } else { 0.0 };
        let distance = place.distance_squared(from + along * share);
        (distance, at_from.lerp(at_to, share))
    });
    let nearest = on_edges.into_iter().min_by(|x, y| x.0.total_cmp(&y.0));
    nearest.map_or(Vec3::X, |(_, weights)| weights)
}

/// The corners of triangles, and places between them about `spacing` apart in the bind pose.
fn samples_of(triangles: &[[u32; 3]], positions: &[Vec3], spacing: f32) -> Vec<Sample> {
    let mut samples = Vec::new();
    let mut is_seen = vec![false; positions.len()];
    for &corners in triangles {
        let [a, b, c] = corners.map(|vertex| positions[vertex as usize]);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let rows = ((longest / spacing) as u32).clamp(1, MOST_ROWS);
        for (vertex, weights) in corners.iter().zip(Vec3::AXES) {
            if !std::mem::replace(&mut is_seen[*vertex as usize], true) {
                samples.push(Sample { corners, weights });
            }
        }
        // Rows divide the triangle into rows² small triangles. The centre of each upright one is a sample.
        for row in 0..rows {
            for column in 0..rows - row {
                let x = (row as f32 + 1.0 / 3.0) / rows as f32;
                let y = (column as f32 + 1.0 / 3.0) / rows as f32;
                let weights = Vec3::new(x, y, 1.0 - x - y);
                samples.push(Sample { corners, weights });
            }
        }
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_on_needles_reproduce_the_place() {
        for corners in [
            [Vec3::ZERO, Vec3::X, Vec3::X * 0.5],
            [Vec3::ZERO, Vec3::X * 1e3, Vec3::new(500.0, 1e-6, 0.0)],
            [Vec3::ONE, Vec3::ONE, Vec3::ZERO],
            [Vec3::ONE; 3],
        ] {
            let [a, b, c] = corners;
            for place in [a, b, c, a.lerp(b, 0.3), b.lerp(c, 0.6)] {
                let weights = weights_at(place, corners);
                let found = a * weights.x + b * weights.y + c * weights.z;
                assert!(
                    found.distance(place) < 1e-3,
                    "{corners:?} {place} {weights}"
                );
                assert!(weights.min_element() >= 0.0, "{weights}");
            }
        }
    }
}
