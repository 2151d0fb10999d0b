//! Brute-force deviations: every sample against every triangle.
//!
//! A slow reference for tests. It uses only the finished hierarchy.

use fieldlod_hierarchy::Hierarchy;
use glam::DVec3;

use crate::mesh::triangle_tree::triangle::exact_distance;

/// A triangle of a surface, and the group that produced it.
struct Piece {
    corners: [DVec3; 3],
    produced_by: Option<u32>,
}

/// Deviations of each group, in local units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deviations {
    /// From the source to the simplified surface. Each sample belongs to the group whose triangle is nearest, in the
    /// cut with all groups up to the level of this group simplified.
    ///
    /// At a border between two groups, a sample may be assigned to the wrong group. Only the largest value of a level,
    /// or of its only group, is a lower bound for the stated deviations.
    pub from_source: Vec<f64>,
    /// From the simplified surface to the source: a lower bound for each group.
    pub from_simplified: Vec<f64>,
}

impl Deviations {
    /// For each group, the larger of both deviations, and at least the deviations of its finer groups. Infinite for a
    /// terminal group.
    #[must_use]
    pub fn in_both_directions(&self, hierarchy: &Hierarchy) -> Vec<f64> {
        let mut farthest: Vec<f64> = Vec::with_capacity(hierarchy.groups.len());
        // Finer groups come before coarser groups.
        for (index, group) in hierarchy.groups.iter().enumerate() {
            let finer = hierarchy.finer_groups(group).iter();
            let below = finer.map(|&finer| farthest[finer as usize]);
            let own = self.from_source[index].max(self.from_simplified[index]);
            let terminal = if group.is_terminal() {
                f64::INFINITY
            } else {
                0.0
            };
            farthest.push(below.fold(own.max(terminal), f64::max));
        }
        farthest
    }
}

/// Measures every group of `hierarchy`.
///
/// Samples form a regular grid on each triangle of either surface, with `rows` steps along each edge. Results never
/// exceed the true deviations, and approach them with more rows.
#[must_use]
pub fn deviations(hierarchy: &Hierarchy, rows: u32) -> Deviations {
    let source = cut_below(hierarchy, 0);
    let zeros = vec![0.0f64; hierarchy.groups.len()];
    let mut found = Deviations {
        from_source: zeros.clone(),
        from_simplified: zeros,
    };
    for level in 0..hierarchy.level_count() {
        // From the source to the cut with all groups up to this level simplified.
        let cut = cut_below(hierarchy, level + 1);
        let of_level = |group: &u32| hierarchy.groups[*group as usize].level == level;
        for sample in samples_on(&source, rows) {
            let (distance, group) = nearest(&cut, sample);
            // Samples nearest to a finer group were measured at the level of that group.
            if let Some(group) = group.filter(of_level) {
                let farthest = &mut found.from_source[group as usize];
                *farthest = farthest.max(distance);
            }
        }
        // From the simplified triangles of this level to the source.
        for piece in &cut {
            if let Some(group) = piece.produced_by.filter(of_level) {
                let samples = samples_on(std::slice::from_ref(piece), rows);
                let distances = samples.map(|sample| nearest(&source, sample).0);
                let farthest = &mut found.from_simplified[group as usize];
                *farthest = distances.fold(*farthest, f64::max);
            }
        }
    }
    found
}

/// The surface with all groups below `level` simplified.
fn cut_below(hierarchy: &Hierarchy, level: u32) -> Vec<Piece> {
    let position = |v: u32| hierarchy.vertices.positions[v as usize].as_dvec3();
    let units = hierarchy.units_at_level(level).into_iter();
    let pieces = units.map(|unit| &hierarchy.units[unit]).flat_map(|unit| {
        let triangles = hierarchy.triangles_of(unit);
        triangles.map(move |triangle| Piece {
            corners: triangle.map(position),
            produced_by: unit.producer(),
        })
    });
    pieces.collect()
}

/// Samples on a regular grid of each triangle, with `rows` steps along each edge.
fn samples_on(pieces: &[Piece], rows: u32) -> impl Iterator<Item = DVec3> + '_ {
    let shares = (0..=rows).flat_map(move |row| {
        (0..=rows - row).map(move |column| {
            let [b, c] = [row, column].map(|steps| f64::from(steps) / f64::from(rows));
            [1.0 - b - c, b, c]
        })
    });
    pieces.iter().flat_map(move |piece| {
        let [a, b, c] = piece.corners;
        let sample = move |[at_a, at_b, at_c]: [f64; 3]| a * at_a + b * at_b + c * at_c;
        shares.clone().map(sample)
    })
}

/// Distance of the nearest triangle, and its group.
fn nearest(pieces: &[Piece], sample: DVec3) -> (f64, Option<u32>) {
    let distance_to = |piece: &Piece| (exact_distance(sample, piece.corners), piece.produced_by);
    pieces
        .iter()
        .map(distance_to)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or((f64::INFINITY, None))
}
