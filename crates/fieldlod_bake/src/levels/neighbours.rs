//! Finds borders that several meshes share.
//!
//! Each mesh selects its levels independently. Vertices on shared borders therefore stay at all levels, so that no
//! cracks open.

use glam::Vec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::levels::vertices::border_of;
use crate::mesh::{SourceMesh, adapter, bits};

/// Marks a position of several objects.
const SEVERAL: u32 = u32::MAX;

/// The meshes at one position.
#[derive(Clone, Copy)]
struct Meeting {
    /// The object of all meshes, or [`SEVERAL`].
    object: u32,
    /// Whether a mesh has an open border there.
    has_border: bool,
}

/// For each vertex of each mesh, whether a mesh of another object has a vertex at exactly the same position, on an open
/// border of a mesh. `objects` has the object of each mesh. The meshes share one space, and their indices must be in
/// range.
pub(crate) fn meeting_vertices(
    meshes: &[&SourceMesh],
    objects: impl Iterator<Item = u32>,
) -> Vec<Vec<bool>> {
    if meshes.len() < 2 {
        return vec![Vec::new(); meshes.len()];
    }
    let borders: Vec<Vec<bool>> = meshes.par_iter().map(|mesh| borders_of(mesh)).collect();
    let mut meetings: FxHashMap<[u32; 3], Meeting> = FxHashMap::default();
    for (object, (mesh, is_border)) in objects.zip(meshes.iter().zip(&borders)) {
        for (position, &is_border) in mesh.positions.iter().zip(is_border) {
            let meeting = meetings.entry(bits(*position)).or_insert(Meeting {
                object,
                has_border: false,
            });
            // Without a border, all surfaces are closed there, and no crack can open.
            meeting.has_border |= is_border;
            if meeting.object != object {
                meeting.object = SEVERAL;
            }
        }
    }
    let is_shared = |position: &Vec3| {
        let meeting = meetings.get(&bits(*position));
        meeting.is_some_and(|meeting| meeting.object == SEVERAL && meeting.has_border)
    };
    let of_mesh = |mesh: &&SourceMesh| mesh.positions.iter().map(is_shared).collect();
    meshes.par_iter().map(of_mesh).collect()
}

fn borders_of(mesh: &SourceMesh) -> Vec<bool> {
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(Vec3::to_array).collect();
    let same_position = meshopt::generate_position_remap(&adapter(&positions));
    border_of(&mesh.indices, &same_position)
}
