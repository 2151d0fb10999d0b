//! The furthest of many points from a surface.

use glam::Vec3A;

use crate::surface::{Hit, Surface};

/// A point whose walk ends further than this times the largest distance (both squared) is measured
/// at once.
const AT_ONCE: f32 = 2.25;
/// How many points may wait to be measured.
const MOST_WAITING: usize = 256;

/// Keeps the largest distance of the points seen.
///
/// Where a walk over the surface ends above a triangle, it says how far a point is at most. To
/// search for something nearer costs a hundred times as much, so points that may be further than
/// all before are remembered, and searched for from the furthest on: the first few settle it.
pub(super) struct Furthest<'a> {
    pub(super) surface: &'a Surface<'a>,
    /// The largest distance so far, as a square.
    pub(super) squared: f32,
    waiting: Vec<Waiting>,
}

struct Waiting {
    at_most: Hit,
    point: Vec3A,
}

impl<'a> Furthest<'a> {
    pub(super) fn from(surface: &'a Surface<'a>, squared: f32) -> Self {
        Self {
            surface,
            squared,
            waiting: Vec::new(),
        }
    }

    /// How far `point` is at most, as far as that is above `floor` (squared): no better is asked for
    /// below. `guess` is a triangle near by.
    pub(super) fn see(&mut self, point: Vec3A, guess: u32, floor: f32) -> Hit {
        let (hit, is_above) = self.surface.walk(point, floor, guess);
        self.weigh(point, hit, is_above, floor)
    }

    /// As [`Self::see`], from where a walk ended.
    pub(super) fn weigh(&mut self, point: Vec3A, hit: Hit, is_above: bool, floor: f32) -> Hit {
        if hit.distance_squared <= floor {
            // `floor` may be what another point is at most, and the furthest nearer than that.
            self.remember(point, hit);
            return hit;
        }
        if !is_above || hit.distance_squared > self.squared.max(floor) * AT_ONCE {
            let hit = self.surface.search(point, floor, hit);
            if hit.distance_squared > floor {
                self.squared = self.squared.max(hit.distance_squared);
            } else {
                // The search ended here, though something may be nearer.
                self.remember(point, hit);
            }
            return hit;
        }
        self.remember(point, hit);
        hit
    }

    /// Keeps a point for later that is so far at most, if that may matter.
    fn remember(&mut self, point: Vec3A, at_most: Hit) {
        if at_most.distance_squared > self.squared {
            self.waiting.push(Waiting { at_most, point });
            if self.waiting.len() > MOST_WAITING {
                self.settle();
            }
        }
    }

    /// Measures what waits, as far as it may matter, and returns the largest distance squared.
    pub(super) fn settle(&mut self) -> f32 {
        let mut waiting = std::mem::take(&mut self.waiting);
        waiting.sort_by(|a, b| {
            let furthest_first = b.at_most.distance_squared;
            furthest_first.total_cmp(&a.at_most.distance_squared)
        });
        for Waiting { at_most, point } in waiting {
            if at_most.distance_squared <= self.squared {
                break;
            }
            let hit = self.surface.search(point, self.squared, at_most);
            self.squared = self.squared.max(hit.distance_squared);
        }
        self.squared
    }

    /// Takes over what others have seen of the same surface.
    pub(super) fn join(&mut self, others: impl IntoIterator<Item = Self>) {
        for other in others {
            self.squared = self.squared.max(other.squared);
            self.waiting.extend(other.waiting);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::fixtures;
    use crate::surface::NONE;
    use crate::triangle::Triangle;

    /// A place beside the mesh, where the walk to it starts, and the floor.
    fn seen() -> impl Strategy<Value = ([f32; 3], u32, f32)> {
        let coordinates = prop::array::uniform3(-1.5f32..1.5);
        (coordinates, 0..320u32, 0.0f32..2.0)
    }

    proptest! {
        /// Whatever the floors, against all triangles one by one.
        #[test]
        fn the_furthest_is_never_missed_nor_made_up(
            all_seen in prop::collection::vec(seen(), 1..400),
            squared in 0.0f32..0.5,
        ) {
            let mesh = fixtures::rock(2, 5);
            let positions: Vec<[f32; 3]> = mesh.positions.iter().map(glam::Vec3::to_array).collect();
            let (corners, _) = mesh.indices.as_chunks::<3>();
            let mut last_edge = vec![NONE; positions.len()];
            let surface = Surface::of(&positions, corners.to_vec(), &mut last_edge);
            let triangles = corners.iter().map(|c| c.map(|v| mesh.positions[v as usize]));
            let triangles: Vec<Triangle> = triangles.map(Triangle::new).collect();

            let mut furthest = Furthest::from(&surface, squared);
            let mut expected = squared;
            for (place, guess, floor) in all_seen {
                let point = Vec3A::from_array(place);
                furthest.see(point, guess, floor);
                let each = triangles.iter().map(|t| t.distance_squared(point));
                expected = expected.max(each.fold(f32::INFINITY, f32::min));
            }
            let found = furthest.settle();
            prop_assert!((found - expected).abs() <= 1e-5 * expected, "{found} for {expected}");
        }
    }
}
