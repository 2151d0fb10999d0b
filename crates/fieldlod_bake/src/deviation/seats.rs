//! Which simplified triangle each source vertex stands above.

use std::sync::Mutex;

use rayon::prelude::*;

use super::furthest::Furthest;
use super::output::Output;
use super::places::Seats;
use crate::patch::Rider;
use crate::surface::NONE;

/// Riders that are seated together.
const RIDERS_PER_TASK: usize = 2048;

/// Seats for as many groups as are measured at a time: they are as many as the places of the
/// whole source, and cost more to clear than a group takes.
pub(super) struct SeatPool {
    empty: Mutex<Vec<Seats>>,
    vertex_count: usize,
}

impl SeatPool {
    pub(super) fn new(vertex_count: usize) -> Self {
        Self {
            empty: Mutex::default(),
            vertex_count,
        }
    }

    pub(super) fn take(&self) -> Seats {
        let pooled = self.empty.lock().ok().and_then(|mut empty| empty.pop());
        pooled.unwrap_or_else(|| vec![NONE; self.vertex_count])
    }

    /// Clears the seats of `vertices` and of the corners of `output`: all that were taken.
    pub(super) fn give_back(&self, mut seats: Seats, vertices: Vec<u32>, output: &Output<'_>) {
        let corners = output.surface.corners().iter().flatten().copied();
        for vertex in vertices.into_iter().chain(corners) {
            seats[vertex as usize] = NONE;
        }
        if let Ok(mut empty) = self.empty.lock() {
            empty.push(seats);
        }
    }
}

/// Seats vertices, and keeps the largest distance.
pub(super) struct Seating<'a> {
    seats: &'a mut Seats,
    output: &'a Output<'a>,
    furthest: Furthest<'a>,
}

impl<'a> Seating<'a> {
    /// Corners of the simplified surface are seated to begin with.
    pub(super) fn new(output: &'a Output<'a>, seats: &'a mut Seats, furthest: f32) -> Self {
        let surface = &output.surface;
        for (triangle, corners) in surface.corners().iter().enumerate() {
            for &vertex in corners {
                seats[vertex as usize] = triangle as u32;
            }
        }
        Self {
            seats,
            output,
            furthest: Furthest::from(surface, furthest),
        }
    }

    /// Seats the corners of what was simplified, each beside a neighbour that is seated already.
    /// Returns those that were removed.
    pub(super) fn seat_corners(&mut self, inputs: &[[u32; 3]]) -> Vec<u32> {
        let mut removed = Vec::new();
        loop {
            let before = removed.len();
            for triangle in inputs {
                let seats = triangle.map(|vertex| self.seats[vertex as usize]);
                let Some(&guess) = seats.iter().find(|&&seat| seat != NONE) else {
                    continue;
                };
                for &vertex in triangle {
                    self.seat_removed(vertex, guess, &mut removed);
                }
            }
            if removed.len() == before {
                break;
            }
        }
        // Pieces of which nothing is left.
        for &vertex in inputs.iter().flatten() {
            self.seat_removed(vertex, 0, &mut removed);
        }
        self.furthest.settle();
        removed
    }

    fn seat_removed(&mut self, vertex: u32, guess: u32, removed: &mut Vec<u32>) {
        if self.seats[vertex as usize] == NONE {
            self.seats[vertex as usize] = seat(&mut self.furthest, self.output, vertex, guess);
            removed.push(vertex);
        }
    }

    /// Seats vertices that are beside corners of what was simplified. Returns the largest distance
    /// of all.
    pub(super) fn seat_riders(mut self, riders: &[Rider]) -> f32 {
        let (output, squared, seats) = (self.output, self.furthest.squared, &self.seats);
        let tasks = riders.par_chunks(RIDERS_PER_TASK).map(|riders| {
            let mut furthest = Furthest::from(&output.surface, squared);
            let beside = |rider: &Rider| seats[rider.on as usize];
            let riders = riders.iter();
            let seated =
                riders.map(|rider| seat(&mut furthest, output, rider.vertex, beside(rider)));
            let seated: Vec<u32> = seated.collect();
            (seated, furthest)
        });
        let (seated, furthest): (Vec<Vec<u32>>, Vec<Furthest<'_>>) = tasks.unzip();
        for (rider, seat) in riders.iter().zip(seated.into_iter().flatten()) {
            self.seats[rider.vertex as usize] = seat;
        }
        self.furthest.join(furthest);
        self.furthest.settle()
    }
}

fn seat(furthest: &mut Furthest<'_>, output: &Output<'_>, vertex: u32, guess: u32) -> u32 {
    let (point, floor) = (output.surface.position(vertex), furthest.squared);
    let (below, is_above) = output.surface.walk(point, floor, guess);
    output.mark_tall(below.triangle, below.distance_squared, floor);
    furthest.weigh(point, below, is_above, floor).triangle
}
