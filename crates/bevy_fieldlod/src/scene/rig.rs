//! Joints and morph targets of meshes.

use bevy::math::Vec3;
use bevy::mesh::morph::MorphAttributes;
use bevy::mesh::{Mesh, MeshAccessError, VertexAttributeValues};
use fieldlod_hierarchy::SourceHash;

/// How the levels of a skinned or morphed mesh are placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rig {
    /// The joint whose pose places a skinned mesh, as an index into the joints of its skin. A mesh without a skin has
    /// the transform of its entity.
    pub(crate) carrier_joint: Option<u16>,
}

/// Whether joints or morph targets move the vertices of a mesh.
pub(crate) fn is_rigged(mesh: &Mesh) -> bool {
    let has_joints = mesh.try_attribute(Mesh::ATTRIBUTE_JOINT_INDEX).is_ok();
    has_joints || mesh.try_has_morph_targets().unwrap_or(false)
}

/// The joints, weights and morph targets of a mesh. All are empty if the mesh is not rigged.
#[derive(Clone, Default)]
pub(crate) struct RigArrays {
    joints: Vec<[u16; 4]>,
    weights: Vec<[f32; 4]>,
    /// The position deltas of each morph target.
    targets: Vec<Vec<Vec3>>,
}

impl RigArrays {
    pub(crate) fn of(mesh: &Mesh) -> Result<Self, MeshAccessError> {
        let mut rig = Self::default();
        use VertexAttributeValues::{Float32x4, Uint16x4};
        if let Some(Uint16x4(joints)) = mesh.try_attribute_option(Mesh::ATTRIBUTE_JOINT_INDEX)? {
            rig.joints.clone_from(joints);
        }
        if let Some(Float32x4(weights)) = mesh.try_attribute_option(Mesh::ATTRIBUTE_JOINT_WEIGHT)? {
            rig.weights.clone_from(weights);
        }
        if mesh.try_has_morph_targets()? {
            let deltas = |target: &[MorphAttributes]| target.iter().map(|at| at.position).collect();
            let targets = mesh.try_morph_targets()?;
            rig.targets = targets
                .chunks_exact(mesh.count_vertices().max(1))
                .map(deltas)
                .collect();
        }
        Ok(rig)
    }

    /// The values at these vertices.
    pub(crate) fn at(&self, vertices: &[u32]) -> Self {
        Self {
            joints: values_at(&self.joints, vertices),
            weights: values_at(&self.weights, vertices),
            targets: self
                .targets
                .iter()
                .map(|target| values_at(target, vertices))
                .collect(),
        }
    }

    /// Adds the joints, weights and morph targets to the hash of a mesh.
    pub(crate) fn add_to(&self, mut hash: SourceHash) -> SourceHash {
        if !self.joints.is_empty() {
            hash = hash.with_joints(&self.joints, &self.weights);
        }
        let targets = self.targets.iter();
        targets.fold(hash, |hash, target| hash.with_morph_target(target))
    }
}

/// The morph targets of `source` at `vertices`; `None` if it has none.
pub(crate) fn morph_targets_at(
    source: &Mesh,
    vertices: &[u32],
) -> Result<Option<Vec<MorphAttributes>>, MeshAccessError> {
    if !source.try_has_morph_targets()? {
        return Ok(None);
    }
    // The values of all vertices for the first target, then those for the second, and so on.
    let targets = source.try_morph_targets()?;
    let targets = targets.chunks_exact(source.count_vertices().max(1));
    Ok(Some(
        targets
            .flat_map(|target| values_at(target, vertices))
            .collect(),
    ))
}

/// The values at these indices; empty if there are no values.
fn values_at<V: Copy>(values: &[V], indices: &[u32]) -> Vec<V> {
    let has_values = !values.is_empty();
    let indices = indices.iter().filter(|_| has_values);
    indices.map(|&index| values[index as usize]).collect()
}
