//! Where vertices are, in the order in which the groups first use them.

use crate::groups::RawGroup;
use crate::input::SimplifierInput;
use crate::surface::NONE;

/// The places of all vertices that groups use, with those at the same place made one.
///
/// What is measured together lies together in memory: a bake reads places, and what is noted of
/// them, much more often than anything else.
pub(crate) struct Places {
    /// In scaled units.
    pub(crate) positions: Vec<[f32; 3]>,
    /// For each vertex, its place.
    place_of: Vec<u32>,
    pub(crate) local_from_scaled: f32,
}

impl Places {
    pub(crate) fn of(input: SimplifierInput, groups: &[RawGroup]) -> Self {
        let mut place_of = vec![NONE; input.positions.len()];
        let mut positions = Vec::with_capacity(input.positions.len());
        let units = groups.iter().flat_map(|group| &group.units);
        let source = units.filter(|unit| unit.is_source());
        for &vertex in source.flat_map(|unit| &unit.clusters).flatten() {
            let first = input.same_position[vertex as usize] as usize;
            if place_of[first] == NONE {
                place_of[first] = positions.len() as u32;
                positions.push(input.positions[first]);
            }
        }
        // The first at a place comes before the others.
        for (vertex, &first) in input.same_position.iter().enumerate() {
            place_of[vertex] = place_of[first as usize];
        }
        Self {
            positions,
            place_of,
            local_from_scaled: input.local_from_scaled,
        }
    }

    /// The triangles of a list, each by the places of its corners.
    pub(crate) fn triangles<'a>(&'a self, list: &'a [u32]) -> impl Iterator<Item = [u32; 3]> + 'a {
        let (triangles, _) = list.as_chunks::<3>();
        let place = |triangle: &[u32; 3]| triangle.map(|vertex| self.place_of[vertex as usize]);
        triangles.iter().map(place)
    }
}

/// For each place of the source, the simplified triangle above which it stands, or [`NONE`].
pub(super) type Seats = Vec<u32>;
