//! Parts that lie at one place in the bind pose and that different joints move, such as the pieces of a machine that are
//! all modelled around the origin.
//!
//! The simplifier takes vertices at one position for one vertex, and a tree over parts at one place is slow in poses
//! that separate them. Both get positions in which these parts lie beside each other.

use std::collections::{BTreeMap, BTreeSet};

use glam::{UVec3, Vec3};

use crate::mesh::SourceMesh;
use crate::mesh::bounds::extent_of;
use crate::mesh::components::connected;
use crate::mesh::topology::Topology;

/// The joints of a vertex and their weights.
type Influences = [(u16, f32); 4];

/// A part lies at the place of other parts if they have at least this share of its positions. Neighbouring parts of a
/// robot share the positions of a ring, and stay together.
const MOSTLY: f32 = 0.75;

/// The positions of a mesh, with parts that lie at the place of others moved beside them.
pub(super) fn positions_apart(mesh: &SourceMesh, influences: &[Influences]) -> Vec<Vec3> {
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    let place = Topology::exact(mesh).place;
    let together = moving_alike(&place, influences);
    if together == place {
        return mesh.positions.clone();
    }
    let part = connected(together, triangles);
    // The parts at each position.
    let mut at_places: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for (place, part) in place.iter().zip(&part) {
        at_places.entry(*place).or_default().insert(*part);
    }
    // For each part, its positions, and those that it shares with other parts.
    let mut counts: BTreeMap<u32, (f32, f32)> = BTreeMap::new();
    for parts in at_places.values() {
        for part in parts {
            let (all, shared) = counts.entry(*part).or_default();
            *all += 1.0;
            *shared += f32::from(u8::from(parts.len() > 1));
        }
    }
    counts.retain(|_, (all, shared)| *shared >= *all * MOSTLY);
    // Places in a grid stay nearer to the origin, where positions have more digits, than places in a row.
    let side = ((counts.len() + 1) as f32).cbrt().ceil() as u32;
    let step = 2.0 * extent_of(&mesh.positions);
    let place = |number: u32| UVec3::new(number, number / side, number / (side * side)) % side;
    let moved = counts.keys().copied().zip(1..);
    let moved: BTreeMap<u32, Vec3> = moved
        .map(|(part, number)| (part, place(number).as_vec3() * step))
        .collect();
    let offset = |part: &u32| moved.get(part).copied().unwrap_or_default();
    let pairs = mesh.positions.iter().zip(&part);
    pairs
        .map(|(position, part)| *position + offset(part))
        .collect()
}

/// For each vertex, the first vertex at its place with the same strongest joint.
fn moving_alike(place: &[u32], influences: &[Influences]) -> Vec<u32> {
    let mut firsts: BTreeMap<(u32, Option<u16>), u32> = BTreeMap::new();
    let first = |(vertex, place): (u32, &u32)| {
        let own = influences.get(vertex as usize).into_iter().flatten();
        let strongest = own.max_by(|a, b| a.1.total_cmp(&b.1));
        let joint = strongest.map(|(joint, _)| *joint);
        *firsts.entry((*place, joint)).or_insert(vertex)
    };
    (0..).zip(place).map(first).collect()
}
