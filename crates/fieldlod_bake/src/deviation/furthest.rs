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

    /// How far `point` is at most, and no nearer than that unless below `floor` (squared). Points
    /// below it never count. `guess` is a triangle near by.
    pub(super) fn see(&mut self, point: Vec3A, guess: u32, floor: f32) -> Hit {
        let (hit, is_above) = self.surface.walk(point, floor, guess);
        self.weigh(point, hit, is_above, floor)
    }

    /// As [`Self::see`], from where a walk ended.
    pub(super) fn weigh(&mut self, point: Vec3A, hit: Hit, is_above: bool, floor: f32) -> Hit {
        if hit.distance_squared <= floor {
            return hit;
        }
        if !is_above || hit.distance_squared > self.squared.max(floor) * AT_ONCE {
            let hit = self.surface.search(point, floor, hit);
            self.squared = self.squared.max(hit.distance_squared);
            return hit;
        }
        if hit.distance_squared > self.squared {
            let at_most = hit;
            self.waiting.push(Waiting { at_most, point });
            if self.waiting.len() > MOST_WAITING {
                self.settle();
            }
        }
        hit
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
