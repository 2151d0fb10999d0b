//! Meshes that meet: borders that several meshes have in common.
//!
//! Each mesh changes its levels on its own. So the vertices where meshes meet stay at all levels, and no crack opens
//! between any two levels.

use glam::Vec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::levels::vertices::border_of;
use crate::mesh::SourceMesh;
use crate::mesh::adapter;

/// Marks a position of several meshes.
const SEVERAL: u32 = u32::MAX;

/// The meshes at one position.
#[derive(Clone, Copy)]
struct Meeting {
    /// The index of the mesh, or [`SEVERAL`].
    mesh: u32,
    /// Whether one of the meshes has an open border there.
    has_border: bool,
}

/// For each vertex of each mesh, whether it is where the mesh meets another one in the same space: at the same position to
/// the last bit, and on an open border of one of them. The indices of the meshes must be in range.
pub(crate) fn meeting_vertices(meshes: &[&SourceMesh]) -> Vec<Vec<bool>> {
    if meshes.len() < 2 {
        return vec![Vec::new(); meshes.len()];
    }
    let borders: Vec<Vec<bool>> = meshes.par_iter().map(|mesh| borders_of(mesh)).collect();
    let mut meetings: FxHashMap<[u32; 3], Meeting> = FxHashMap::default();
    for (index, (mesh, is_border)) in (0..).zip(meshes.iter().zip(&borders)) {
        for (position, &is_border) in mesh.positions.iter().zip(is_border) {
            let meeting = meetings.entry(bits(*position)).or_insert(Meeting {
                mesh: index,
                has_border: false,
            });
            meeting.has_border |= is_border;
            if meeting.mesh != index {
                meeting.mesh = SEVERAL;
            }
        }
    }
    let is_met = |position: &Vec3| {
        let meeting = meetings.get(&bits(*position));
        meeting.is_some_and(|meeting| meeting.mesh == SEVERAL && meeting.has_border)
    };
    let of_mesh = |mesh: &&SourceMesh| mesh.positions.iter().map(is_met).collect();
    meshes.par_iter().map(of_mesh).collect()
}

fn borders_of(mesh: &SourceMesh) -> Vec<bool> {
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(Vec3::to_array).collect();
    let same_position = meshopt::generate_position_remap(&adapter(&positions));
    border_of(&mesh.indices, &same_position)
}

fn bits(position: Vec3) -> [u32; 3] {
    // Adding zero makes one of the two zeros.
    (position + Vec3::ZERO).to_array().map(f32::to_bits)
}
