//! Denser samples on triangles that may hold a place farther than all samples so far.

use glam::Vec3;

use crate::mesh::triangle_tree::{NearestTriangle, TriangleTree};

/// Margin for places between the samples.
pub(super) const SAMPLING_MARGIN: f32 = 1.05;
/// The same for aggregates: elements that have grown are large beside the distances between places. Of 204
/// bakes of game assets one lay a tenth farther from its source than it said with the other margin.
pub(super) const AGGREGATE_MARGIN: f32 = 1.2;
/// Parts that lie within this times the farthest, squared, are within the margin.
pub(super) const WITHIN: f32 = SAMPLING_MARGIN * SAMPLING_MARGIN;
/// Parts that rise no higher than this share of the farthest, squared, are not looked at more closely
const LOW: f32 = 0.7;
/// if their middle stands as near as the next share beside what is nearest: it is not above a gap.
const BESIDE: f32 = 0.06;

/// A surface from which distances are measured.
pub(super) struct Target {
    pub(super) surface: TriangleTree,
    /// The surface that a group consumes, if that is not the source, and how far from it a place may
    /// lie for which the group stands: others stand for what is further.
    pub(super) consumed: Option<TriangleTree>,
    pub(super) reach_in_scaled: f32,
}

/// A triangle that may hold the farthest place.
pub(super) struct Candidate {
    pub(super) corners: [Vec3; 3],
    /// How far such a place may be, squared: a bound for triangles of the source, a guess for others.
    pub(super) priority: f32,
    /// The nearest triangle to one of its places.
    pub(super) start: Option<NearestTriangle>,
}

impl Target {
    /// How much too far a place lies for the group to stand for it, 0 or less if it does.
    fn beyond_reach(&self, place: Vec3) -> f32 {
        let nearest = self.consumed.as_ref().and_then(|tree| tree.nearest(place));
        nearest.map_or(0.0, |near| {
            near.distance_squared.sqrt() - self.reach_in_scaled
        })
    }
}

/// Raises the largest squared distance by samples on the triangles that may hold a further place; for
/// `splits` see [`look_at_part`].
pub(super) fn look_closely(
    target: &Target,
    mut candidates: Vec<Candidate>,
    splits: [u32; 2],
    farthest: &mut f32,
) {
    let order = |a: &Candidate, b: &Candidate| b.priority.total_cmp(&a.priority);
    candidates.sort_by(order);
    for candidate in &candidates {
        look_at_part(target, candidate.corners, candidate.start, splits, farthest);
    }
}

/// Looks at a part of a triangle, and at quarters of it up to `splits` times over: the last `free` of
/// these only as long as its corners rise high above the plane of what is nearest to its middle.
fn look_at_part(
    target: &Target,
    corners: [Vec3; 3],
    start: Option<NearestTriangle>,
    [splits, free]: [u32; 2],
    farthest: &mut f32,
) {
    let [a, b, c] = corners;
    let middle = (a + b + c) / 3.0;
    let surface = &target.surface;
    let Some(near) = surface.near_enough(middle, *farthest * BESIDE, start) else {
        return;
    };
    if near.distance_squared > *farthest {
        let beyond = target.beyond_reach(middle);
        if beyond <= 0.0 {
            *farthest = near.distance_squared;
        } else if corners
            .iter()
            .all(|c| c.distance_squared(middle) < beyond * beyond)
        {
            return;
        }
    }
    if splits == 0 || surface.bound_squared(near, corners) <= *farthest * WITHIN {
        return;
    }
    // What is nearest to the middle may be far from a corner, so that some quarters are always looked
    // at.
    let is_low = || {
        let beside = near.distance_squared - surface.height_squared(near, [middle; 3]);
        beside <= *farthest * BESIDE && surface.height_squared(near, corners) <= *farthest * LOW
    };
    if splits <= free && is_low() {
        return;
    }
    let [ab, bc, ca] = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
    for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
        look_at_part(target, part, Some(near), [splits - 1, free], farthest);
    }
}
