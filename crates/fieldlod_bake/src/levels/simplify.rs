//! Simplification of one group, on a copy of its vertices.

use std::sync::OnceLock;

use meshopt::{SimplifyOptions, SimplifyVertex};
use rustc_hash::FxHashSet;

use crate::config::BakeConfig;
use crate::levels::vertices::uv_ranges::UvRanges;
use crate::levels::vertices::{LevelVertices, Piece};
use crate::mesh::adapter;
use crate::mesh::components::{Component, components_of};

/// Groups with at most this many triangles never use `Sloppy`, which has the largest visible loss. A coarsest level of
/// this size is small enough, see [`BakeReport::MOST_COARSEST`](crate::BakeReport::MOST_COARSEST).
const SLOPPY_ABOVE_TRIANGLES: usize = 512;
/// The simplifier returns unmoved vertices with rounding errors of up to this, in scaled units.
const ROUNDING: f32 = 1e-6;

/// Methods of simplification, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    /// Like `Moved`, but loose elements such as leaves keep their area.
    Elements,
    /// Like `Elements`, for the pieces of a kit: the error is at least the radius of each pruned piece.
    Pieces,
    /// Vertices and attributes move to reduce the error. Topology and seams are kept.
    Moved,
    /// Vertices stay in place.
    Kept,
    /// Like `Moved`, but texture seams may tear. The error contains the difference of the texture coordinates.
    Torn,
    /// Vertices are merged on a grid.
    Sloppy,
}

/// A part of the surface to simplify.
pub(crate) struct Task<'a> {
    pub(crate) vertices: &'a LevelVertices,
    pub(crate) config: &'a BakeConfig,
    pub(crate) piece: Piece,
    /// For each own vertex, the first own vertex at the same position.
    pub(crate) same_position: Vec<u32>,
    /// For each own vertex, whether it must stay: other groups use its position, or it stays at all levels.
    pub(crate) is_locked: Vec<bool>,
    /// Computed on first use; `None` without texture coordinates.
    pub(crate) uv_ranges: OnceLock<Option<UvRanges>>,
    /// Share of the triangles to keep.
    pub(crate) ratio: f32,
    /// Method for loose elements: `Elements` or `Pieces`.
    pub(crate) loose: Method,
    /// Whether this is the only group of its level.
    pub(crate) is_whole: bool,
    /// Factor for the areas of simplified elements. It corrects the covered area.
    pub(crate) area_gain: f32,
    /// For each own vertex, the number of pixels in which it is visible; only for plants.
    pub(crate) visible_px: Option<Vec<f32>>,
}

/// The result of a simplification.
pub(crate) struct Simplified {
    /// Three own vertices per triangle, never empty.
    pub(crate) corners: Vec<u32>,
    pub(crate) error_in_scaled: f32,
    /// Lower bound for the stated deviation, in scaled units: see [`Task::longest_torn_edge`].
    pub(crate) least_deviation_in_scaled: f32,
    pub(crate) method: Method,
    /// Whether components were removed.
    pub(crate) is_pruned: bool,
    /// Positions and attribute rows of all own vertices.
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) rows: Vec<f32>,
    /// For each own vertex, whether its position or attributes changed.
    pub(crate) is_new: Vec<bool>,
}

impl Task<'_> {
    /// Tries all methods, best first. Yields results that progress enough and open no edge.
    ///
    /// Loose parts of a machine often have a smaller error as surfaces than as elements: then `Moved` comes first.
    pub(crate) fn attempts(&self) -> impl Iterator<Item = Simplified> + '_ {
        // If the wanted ratio is not reachable, a smaller step may be.
        let wanted = self.ratio;
        let less = (wanted + self.config.stuck_ratio) * 0.5;
        let closed = |(method, ratio)| {
            let simplified = self.attempt(method, ratio)?;
            self.opens_no_edge(&simplified).then_some(simplified)
        };
        let mut first = [(self.loose, wanted), (Method::Moved, wanted)].map(closed);
        if let [Some(elements), Some(moved)] = &first
            && moved.error_in_scaled < elements.error_in_scaled
            && self.keeps_parts(moved)
        {
            first.reverse();
        }
        let regular = [
            (Method::Kept, wanted),
            (Method::Moved, less),
            (Method::Kept, less),
        ];
        // Opened parts keep all their triangles here, so regular attempts come first.
        let in_parts = move || self.restore_opened(self.attempt(Method::Moved, wanted)?, less);
        let in_parts = std::iter::once_with(in_parts);
        // Only for the single group of a level: other groups are retried on the next level, with other neighbours.
        let last_resort = [(Method::Torn, wanted), (Method::Sloppy, wanted)];
        let last_resort = last_resort.into_iter().filter(|_| self.is_whole);
        let first = first.into_iter().flatten();
        first
            .chain(regular.into_iter().filter_map(closed))
            .chain(
                in_parts
                    .flatten()
                    .filter(|simplified| self.keeps_parts(simplified)),
            )
            .chain(last_resort.filter_map(closed))
    }

    /// Tries one method. Returns `None` if the method does not apply, or leaves too many or too few triangles.
    fn attempt(&self, method: Method, ratio: f32) -> Option<Simplified> {
        let triangles = self.piece.triangle_count();
        if method == Method::Sloppy && triangles <= SLOPPY_ABOVE_TRIANGLES {
            return None;
        }
        let target = ((triangles as f32 * ratio) as usize).max(1) * 3;
        let mut simplified = match method {
            Method::Elements | Method::Pieces => self.simplify_aggregate(ratio)?,
            _ => self.simplify_by(method, target),
        };
        let most = (triangles as f32 * self.config.stuck_ratio) as usize * 3;
        // `simplify_aggregate` has already chosen which elements to remove.
        if simplified.corners.len() > most && method != self.loose {
            self.prune(&mut simplified, target);
        }
        // An empty result gets one triangle. A small group with a single triangle left counts as stuck.
        if simplified.corners.is_empty() {
            simplified.corners.extend(&self.piece.corners[..3]);
        }
        let is_too_small = simplified.corners.len() <= 3 && triangles <= SLOPPY_ABOVE_TRIANGLES;
        if simplified.corners.len() > most || is_too_small {
            return None;
        }
        if matches!(method, Method::Moved | Method::Torn) {
            self.mark_new_vertices(&mut simplified);
        }
        simplified.least_deviation_in_scaled = self.longest_torn_edge(&simplified);
        if method == Method::Sloppy {
            // The error of `Sloppy` contains positions only.
            simplified.error_in_scaled = simplified
                .error_in_scaled
                .max(simplified.least_deviation_in_scaled);
        }
        Some(simplified)
    }

    /// The piece itself, with no error.
    pub(crate) fn unchanged(&self, method: Method) -> Simplified {
        Simplified {
            corners: self.piece.corners.clone(),
            error_in_scaled: 0.0,
            least_deviation_in_scaled: 0.0,
            method,
            is_pruned: false,
            positions: self.piece.positions.clone(),
            rows: self.rows(),
            is_new: vec![false; self.piece.vertices.len()],
        }
    }

    /// The connected components of triangles of own vertices.
    pub(crate) fn components(&self, corners: &[u32], positions: &[[f32; 3]]) -> Vec<Component> {
        components_of(corners, positions, &self.same_position, &self.is_locked)
    }

    /// Whether an own vertex is on a border of the source.
    pub(crate) fn is_border(&self, own: u32) -> bool {
        self.vertices.is_border[self.piece.vertices[own as usize] as usize]
    }

    fn simplify_by(&self, method: Method, target: usize) -> Simplified {
        let mut simplified = self.unchanged(method);
        let mut error = 0.0f32;
        let count = match method {
            Method::Moved | Method::Torn => {
                self.simplify_moving(&mut simplified, target, f32::MAX, &mut error)
            }
            _ => {
                simplified.corners = self.simplify_keeping(method, target, &mut error);
                simplified.corners.len()
            }
        };
        simplified.corners.truncate(count);
        simplified.error_in_scaled = if error.is_finite() {
            error.max(0.0)
        } else {
            f32::MAX
        };
        simplified
    }

    pub(crate) fn simplify_moving(
        &self,
        simplified: &mut Simplified,
        target: usize,
        most_error: f32,
        error: &mut f32,
    ) -> usize {
        let layout = &self.vertices.layout;
        meshopt::simplify_with_update(
            &mut simplified.corners,
            &mut simplified.positions,
            &mut simplified.rows,
            &layout.weights,
            layout.width() * size_of::<f32>(),
            Some(&self.locks(simplified.method)),
            target,
            most_error,
            options(),
            Some(error),
        )
    }

    fn simplify_keeping(&self, method: Method, target: usize, error: &mut f32) -> Vec<u32> {
        let layout = &self.vertices.layout;
        let corners = &self.piece.corners;
        let vertices = adapter(&self.piece.positions);
        let locks = self.locks(method);
        if method == Method::Sloppy {
            let left = meshopt::simplify_sloppy_with_locks(
                corners,
                &vertices,
                &locks,
                target,
                f32::MAX,
                Some(error),
            );
            *error *= meshopt::simplify_scale(&vertices);
            return left;
        }
        if layout.width() == 0 {
            let (most, options) = (f32::MAX, options());
            return meshopt::simplify_with_locks(
                corners,
                &vertices,
                &locks,
                target,
                most,
                options,
                Some(error),
            );
        }
        meshopt::simplify_with_attributes_and_locks(
            corners,
            &vertices,
            &self.rows(),
            &layout.weights,
            layout.width() * size_of::<f32>(),
            &locks,
            target,
            f32::MAX,
            options(),
            Some(error),
        )
    }

    /// Attributes of the own vertices.
    fn rows(&self) -> Vec<f32> {
        let own = self.piece.vertices.iter();
        own.flat_map(|&vertex| self.vertices.row(vertex))
            .copied()
            .collect()
    }

    fn locks(&self, method: Method) -> Vec<SimplifyVertex> {
        let keeps_seams = !matches!(method, Method::Torn | Method::Sloppy);
        let own = self.piece.vertices.iter().zip(&self.is_locked);
        own.map(|(&vertex, &is_locked)| {
            let mut lock = SimplifyVertex::empty();
            lock.set(SimplifyVertex::Lock, is_locked);
            if keeps_seams {
                lock |= self.vertices.protection[vertex as usize];
            }
            lock
        })
        .collect()
    }

    /// Removes the smallest components without locked vertices until few enough triangles are left. The largest
    /// component stays.
    fn prune(&self, simplified: &mut Simplified, target: usize) {
        let mut components = self.components(&simplified.corners, &self.piece.positions);
        let radius = |component: &Component| component.radius;
        components.sort_by(|a, b| radius(a).total_cmp(&radius(b)));
        let Some(largest) = components.pop() else {
            return;
        };
        let mut left = simplified.corners.len();
        simplified.corners.clear();
        for component in components {
            if left <= target || component.is_locked {
                simplified.corners.extend(component.corners());
                continue;
            }
            left -= component.triangles.len() * 3;
            simplified.error_in_scaled = simplified.error_in_scaled.max(component.radius);
            simplified.is_pruned = true;
        }
        simplified.corners.extend(largest.corners());
    }

    /// Marks new vertices. Movements within rounding are undone, and vertices on a border of the source stay.
    pub(crate) fn mark_new_vertices(&self, simplified: &mut Simplified) {
        let layout = &self.vertices.layout;
        let width = layout.width();
        let ranges = self
            .uv_ranges
            .get_or_init(|| UvRanges::of(&self.piece, self.vertices));
        // Vertices at one position must move together.
        let mut has_moved = vec![false; self.piece.vertices.len()];
        for &own in &simplified.corners {
            let own = own as usize;
            let (before, after) = (self.piece.positions[own], simplified.positions[own]);
            let moved = (0..3).any(|k| (before[k] - after[k]).abs() > ROUNDING);
            let is_finite = after.iter().all(|x| x.is_finite());
            has_moved[self.same_position[own] as usize] |=
                moved && is_finite && !self.is_border(own as u32) && !self.is_locked[own];
        }
        for &own in &simplified.corners {
            let own = own as usize;
            let moved = has_moved[self.same_position[own] as usize];
            if !moved {
                simplified.positions[own] = self.piece.positions[own];
            }
            let before = self.vertices.row(self.piece.vertices[own]);
            let row = &mut simplified.rows[own * width..][..width];
            // Already marked by an earlier triangle.
            if simplified.is_new[own] {
                continue;
            }
            if !moved && layout.is_same(row, before) {
                row.copy_from_slice(before);
                continue;
            }
            layout.make_valid(row, before);
            if let Some(ranges) = ranges {
                ranges.clamp(own, row, layout);
            }
            simplified.is_new[own] = true;
        }
    }

    /// Length of the longest edge of a new or moved triangle if textures may be torn; otherwise 0. It is a lower bound
    /// for the deviation. With a guarantee, torn triangles are drawn only if they are smaller than the allowed
    /// deviation.
    fn longest_torn_edge(&self, simplified: &Simplified) -> f32 {
        let tears = matches!(simplified.method, Method::Torn | Method::Sloppy);
        if !tears || !self.vertices.layout.has_uvs() {
            return 0.0;
        }
        let position = |own: u32| glam::Vec3::from(simplified.positions[own as usize]);
        let unchanged: FxHashSet<&[u32; 3]> =
            self.piece.corners.as_chunks::<3>().0.iter().collect();
        let triangles = simplified.corners.as_chunks::<3>().0.iter();
        let is_new =
            |triangle: &[u32; 3]| triangle.iter().any(|&own| simplified.is_new[own as usize]);
        let torn = triangles.filter(|triangle| is_new(triangle) || !unchanged.contains(triangle));
        let edges = torn.flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let lengths = edges.map(|(from, to)| position(from).distance(position(to)));
        lengths.fold(0.0, f32::max)
    }
}

fn options() -> SimplifyOptions {
    // Absolute: errors of groups of different sizes are compared. Clamped: without it, attributes that vary strongly
    // give errors far above any distance. Permissive: seams of normals may collapse; `locks` protects texture seams.
    SimplifyOptions::ErrorAbsolute | SimplifyOptions::ErrorClamped | SimplifyOptions::Permissive
}
