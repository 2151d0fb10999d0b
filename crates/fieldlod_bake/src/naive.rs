//! Deviations measured the plain way: every sample against every triangle.
//!
//! The slow reference for the bake's measurement, for tests. It uses only the finished hierarchy.

use fieldlod_hierarchy::Hierarchy;
use glam::DVec3;

use crate::mesh::triangle_tree::triangle::exact_distance;

/// A triangle of a surface and the group whose simplification it is.
struct Piece {
    corners: [DVec3; 3],
    produced_by: Option<u32>,
}

/// How far the surfaces of each group lie apart, in local units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deviations {
    /// From the source, at places that the group's triangles are nearest to where all groups up to
    /// its level are simplified and none above.
    ///
    /// Beside a border between two groups, that may be the neighbour of the group that the place
    /// belongs to. Only over the groups of a level, or where it has but one, is this a bound from
    /// below of what a hierarchy must state.
    pub from_source: Vec<f64>,
    /// From the simplified surface: a bound from below for each group.
    pub from_simplified: Vec<f64>,
}

impl Deviations {
    /// The larger of both for each group, and no less than those of its finer groups; infinite for
    /// a group that is not simplified.
    #[must_use]
    pub fn in_both_directions(&self, hierarchy: &Hierarchy) -> Vec<f64> {
        let mut farthest: Vec<f64> = Vec::with_capacity(hierarchy.groups.len());
        // Groups come finer before coarser.
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
/// Each triangle of either surface is sampled at its corners and at `rows` rows of places between,
/// so that what is found is never more than what is true, and gets there as `rows` grows.
#[must_use]
pub fn deviations(hierarchy: &Hierarchy, rows: u32) -> Deviations {
    let source = cut_below(hierarchy, 0);
    let none = vec![0.0f64; hierarchy.groups.len()];
    let mut found = Deviations {
        from_source: none.clone(),
        from_simplified: none,
    };
    for level in 0..hierarchy.level_count() {
        // From the source to the cut in which all groups up to this level are simplified.
        let cut = cut_below(hierarchy, level + 1);
        let of_level = |group: &u32| hierarchy.groups[*group as usize].level == level;
        for place in places_on(&source, rows) {
            let (distance, group) = nearest(&cut, place);
            if let Some(group) = group.filter(of_level) {
                let farthest = &mut found.from_source[group as usize];
                *farthest = farthest.max(distance);
            }
        }
        // And from what the groups of this level were simplified to, to the source.
        for piece in &cut {
            if let Some(group) = piece.produced_by.filter(of_level) {
                let places = places_on(std::slice::from_ref(piece), rows);
                let distances = places.map(|place| nearest(&source, place).0);
                let farthest = &mut found.from_simplified[group as usize];
                *farthest = distances.fold(*farthest, f64::max);
            }
        }
    }
    found
}

/// The surface with all groups below `level` simplified.
fn cut_below(hierarchy: &Hierarchy, level: u32) -> Vec<Piece> {
    let mut refined: Vec<bool> = hierarchy.groups.iter().map(|g| g.level >= level).collect();
    hierarchy.close_refinement(&mut refined);
    let position = |v: u32| hierarchy.vertices.positions[v as usize].as_dvec3();
    let units = hierarchy
        .drawn_units(&refined)
        .map(|unit| &hierarchy.units[unit]);
    let pieces = units.flat_map(|unit| {
        let triangles = hierarchy.triangles_of(unit);
        triangles.map(move |triangle| Piece {
            corners: triangle.map(position),
            produced_by: unit.producer(),
        })
    });
    pieces.collect()
}

fn places_on(pieces: &[Piece], rows: u32) -> impl Iterator<Item = DVec3> + '_ {
    let shares = (0..=rows).flat_map(move |row| {
        (0..=rows - row).map(move |column| {
            let [b, c] = [row, column].map(|steps| f64::from(steps) / f64::from(rows));
            [1.0 - b - c, b, c]
        })
    });
    pieces.iter().flat_map(move |piece| {
        let [a, b, c] = piece.corners;
        let place = move |[at_a, at_b, at_c]: [f64; 3]| a * at_a + b * at_b + c * at_c;
        shares.clone().map(place)
    })
}

/// How far the nearest of all triangles is, and whose it is.
fn nearest(pieces: &[Piece], place: DVec3) -> (f64, Option<u32>) {
    let distance_to = |piece: &Piece| (exact_distance(place, piece.corners), piece.produced_by);
    pieces
        .iter()
        .map(distance_to)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or((f64::INFINITY, None))
}
