//! Skins, morph targets and animations, which move the vertices of a primitive.

pub(super) mod clips;

pub use clips::{Channel, Clip, Interpolation, Property};

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use glam::{Mat4, Quat, Vec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::{Accessor, Document, Primitive, Semantic};

use super::accessor::{VertexReader, read_numbers};
use super::buffers::Buffers;
use super::error::PrimitiveFault;
use super::rig_fault::RigFault;

/// Largest number of joints of a skin that Bevy draws.
const MOST_JOINTS: usize = 256;
/// Largest number of morph targets that Bevy draws.
const MOST_TARGETS: usize = 256;

/// A skin, morph targets or both, with the values that Bevy's loader reads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// The skins that nodes draw the mesh with, as indices into [`Import::skins`](super::Import::skins).
    pub skins: Vec<u32>,
    /// Four joints per vertex, as indices into [`Skin::joints`]. Empty without a skin.
    pub joints: Vec<[u16; 4]>,
    /// The weights of these joints, as the file has them. At least one vertex has [usable](Skin::influences) weights.
    pub weights: Vec<[f32; 4]>,
    /// For each morph target, the position delta of each vertex.
    pub targets: Vec<Vec<Vec3>>,
}

impl Rig {
    /// The rig of the vertices with these indices.
    pub(crate) fn at(&self, indices: &[u32]) -> Self {
        fn gather<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
            let used = indices.iter().filter(|_| !values.is_empty());
            used.map(|&index| values[index as usize]).collect()
        }
        Self {
            skins: self.skins.clone(),
            joints: gather(&self.joints, indices),
            weights: gather(&self.weights, indices),
            targets: self.targets.iter().map(|t| gather(t, indices)).collect(),
        }
    }
}

/// The joints of a character.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// The nodes of the joints, as indices into [`Import::nodes`](super::Import::nodes).
    pub joints: Vec<u32>,
    /// For each joint, the matrix from the mesh to the joint in the bind pose. It may be singular, or NaN if the file
    /// has none.
    pub inverse_binds: Vec<Mat4>,
}

/// Sums of weights for which vertices are simplified. Bevy does not normalize weights: other vertices are drawn mostly
/// where the world has its origin. Weights beyond the fourth, which Bevy ignores, leave sums above a half.
const USABLE_SUMS: RangeInclusive<f32> = 0.5..=2.0;

impl Skin {
    /// The joints that move a vertex, with the weights that Bevy uses. `None` if a joint or a weight cannot be used, or
    /// if the sum of the weights is far from 1.
    #[must_use]
    pub fn influences(&self, joints: [u16; 4], weights: [f32; 4]) -> Option<[(u16, f32); 4]> {
        // The joint of a zero weight may be out of range.
        let influences = std::array::from_fn(|k| match weights[k] {
            0.0 => (0, 0.0),
            weight => (joints[k], weight),
        });
        let mut sum = 0.0;
        for (joint, weight) in influences.into_iter().filter(|(_, weight)| *weight != 0.0) {
            let bind = self.inverse_binds.get(usize::from(joint))?;
            bind.is_finite().then_some(())?;
            // A matrix of zeros moves nothing, as a weight of zero.
            sum += weight * bind.w_axis.w;
        }
        USABLE_SUMS.contains(&sum).then_some(influences)
    }

    /// Whether the inverse bind matrix of a joint has an inverse.
    pub(crate) fn is_invertible(&self, joint: u16) -> bool {
        let bind = self.inverse_binds.get(usize::from(joint));
        bind.is_some_and(|m| m.is_finite() && m.determinant().is_normal())
    }
}

/// A node of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Its name, or an empty string.
    pub name: String,
    /// The parent. Parents form no cycle.
    pub parent: Option<u32>,
    /// The mesh that the node draws.
    pub mesh: Option<u32>,
    /// Translation without animation.
    pub translation: Vec3,
    /// Rotation without animation.
    pub rotation: Quat,
    /// Scale without animation.
    pub scale: Vec3,
    /// Weights of the morph targets of the node's mesh, without animation.
    pub weights: Vec<f32>,
}

impl Node {
    /// The transform without animation, relative to the parent.
    pub(super) fn transform(&self) -> Mat4 {
        Mat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }
}

/// All nodes of a file. One node of each cycle becomes a root.
pub(super) fn nodes_of(document: &Document) -> Vec<Node> {
    let node = |node: gltf::Node<'_>| {
        let (translation, rotation, scale) = node.transform().decomposed();
        let mesh = node.mesh();
        let of_mesh = mesh.as_ref().and_then(gltf::Mesh::weights);
        Node {
            name: node.name().unwrap_or_default().to_owned(),
            parent: None,
            mesh: mesh.as_ref().map(|mesh| mesh.index() as u32),
            translation: translation.into(),
            rotation: Quat::from_array(rotation),
            scale: scale.into(),
            weights: node.weights().or(of_mesh).unwrap_or_default().to_vec(),
        }
    };
    let mut nodes: Vec<Node> = document.nodes().map(node).collect();
    for parent in document.nodes() {
        for child in parent.children() {
            nodes[child.index()].parent = Some(parent.index() as u32);
        }
    }
    cut_cycles(&mut nodes);
    nodes
}

/// Makes one node of each cycle a root. Each node is visited once, because chains may be long.
fn cut_cycles(nodes: &mut [Node]) {
    let mut visited_from = vec![None; nodes.len()];
    for start in 0..nodes.len() {
        let mut node = start;
        while visited_from[node].is_none() {
            visited_from[node] = Some(start);
            let Some(parent) = nodes[node].parent else {
                break;
            };
            if visited_from[parent as usize] == Some(start) {
                nodes[node].parent = None;
                break;
            }
            node = parent as usize;
        }
    }
}

/// A node and its ancestors, the nearest first.
pub(crate) fn ancestors(nodes: &[Node], node: u32) -> impl Iterator<Item = u32> + '_ {
    std::iter::successors(Some(node), |&node| nodes[node as usize].parent)
}

/// The skins that nodes draw each mesh with, ascending. `None` stands for a node without a skin.
pub(super) fn skins_of_meshes(document: &Document) -> Vec<BTreeSet<Option<u32>>> {
    let mut skins = vec![BTreeSet::new(); document.meshes().len()];
    for node in document.nodes() {
        if let Some(mesh) = node.mesh() {
            let own = node.skin().map(|skin| skin.index() as u32);
            skins[mesh.index()].insert(own);
        }
    }
    skins
}

/// Reads all skins of a file.
pub(super) fn read_skins(
    document: &Document,
    buffers: &Buffers,
) -> Vec<Result<Skin, PrimitiveFault>> {
    let skins = document.skins();
    skins.map(|skin| read_skin(&skin, buffers)).collect()
}

fn read_skin(skin: &gltf::Skin<'_>, buffers: &Buffers) -> Result<Skin, PrimitiveFault> {
    let joints: Vec<u32> = skin.joints().map(|joint| joint.index() as u32).collect();
    if joints.len() > MOST_JOINTS {
        let joints = joints.len();
        return Err(RigFault::TooManyJoints { joints }.into());
    }
    let mut inverse_binds = match skin.inverse_bind_matrices() {
        None => vec![Mat4::IDENTITY; joints.len()],
        Some(accessor) => read_matrices(&accessor, buffers)?,
    };
    // Surplus matrices belong to no joint, and a joint without a matrix moves only its own vertices.
    inverse_binds.resize(joints.len(), Mat4::NAN);
    Ok(Skin {
        joints,
        inverse_binds,
    })
}

fn read_matrices(accessor: &Accessor<'_>, buffers: &Buffers) -> Result<Vec<Mat4>, PrimitiveFault> {
    let is_matrix = accessor.dimensions() == Dimensions::Mat4;
    if !is_matrix || accessor.data_type() != DataType::F32 {
        return Err(RigFault::Format("inverse bind matrices").into());
    }
    let numbers = read_numbers(accessor, buffers);
    let numbers = numbers.map_err(PrimitiveFault::accessor("inverse bind matrices"))?;
    let (matrices, _) = numbers.as_chunks::<16>();
    Ok(matrices.iter().map(Mat4::from_cols_array).collect())
}

/// Reads the rig of a primitive. `skins` are the skins of its mesh with their indices.
pub(super) fn read_rig(
    primitive: &Primitive<'_>,
    vertices: VertexReader<'_>,
    skins: &[(u32, &Skin)],
) -> Result<Option<Rig>, PrimitiveFault> {
    let reader = Reader {
        primitive,
        vertices,
    };
    let mut rig = Rig::default();
    if !skins.is_empty() {
        (rig.joints, rig.weights) = reader.joints(skins)?;
    }
    rig.skins = skins.iter().map(|(index, _)| *index).collect();
    rig.targets = reader.targets()?;
    Ok((!skins.is_empty() || !rig.targets.is_empty()).then_some(rig))
}

struct Reader<'a> {
    primitive: &'a Primitive<'a>,
    vertices: VertexReader<'a>,
}

impl Reader<'_> {
    fn joints(
        &self,
        skins: &[(u32, &Skin)],
    ) -> Result<(Vec<[u16; 4]>, Vec<[f32; 4]>), PrimitiveFault> {
        use DataType::{F32, U8, U16};
        let primitive = self.primitive;
        // Bevy reads the first four joints of a vertex.
        let joints = primitive.get(&Semantic::Joints(0));
        let joints = joints.filter(|a| matches!(a.data_type(), U8 | U16) && !a.normalized());
        let weights = primitive.get(&Semantic::Weights(0));
        let weights = weights.filter(|a| match a.data_type() {
            F32 => !a.normalized(),
            kind => matches!(kind, U8 | U16) && a.normalized(),
        });
        let (Some(joints), Some(weights)) = (joints, weights) else {
            return Err(RigFault::Format("joints or weights").into());
        };
        let joints: Vec<[f32; 4]> = self.vectors(&joints, Dimensions::Vec4, "joints")?;
        let joints: Vec<[u16; 4]> = joints.iter().map(|j| j.map(|j| j as u16)).collect();
        let weights = self.vectors(&weights, Dimensions::Vec4, "weights")?;
        let mut pairs = joints.iter().zip(&weights);
        let is_usable = |(&joints, &weights): (&[u16; 4], &[f32; 4])| {
            let mut skins = skins.iter();
            skins.all(|(_, skin)| skin.influences(joints, weights).is_some())
        };
        if !joints.is_empty() && !pairs.any(is_usable) {
            return Err(RigFault::BadWeights.into());
        }
        Ok((joints, weights))
    }

    fn targets(&self) -> Result<Vec<Vec<Vec3>>, PrimitiveFault> {
        let primitive = self.primitive;
        let targets = primitive.morph_targets();
        let count = targets.len();
        if count > MOST_TARGETS {
            return Err(RigFault::TooManyTargets { count }.into());
        }
        // Bevy would give each triangle its own vertices, but not its own deltas.
        let lacks_normals = primitive.get(&Semantic::Normals).is_none();
        if count > 0 && lacks_normals && primitive.indices().is_some() {
            return Err(RigFault::MorphedWithoutNormals.into());
        }
        let target = |target: gltf::mesh::MorphTarget<'_>| {
            let Some(positions) = target.positions() else {
                return Ok(vec![Vec3::ZERO; self.vertices.count()]);
            };
            if positions.data_type() != DataType::F32 {
                return Err(RigFault::Format("morph targets").into());
            }
            let deltas = self.vectors(&positions, Dimensions::Vec3, "morph targets")?;
            let deltas: Vec<Vec3> = deltas.into_iter().map(Vec3::from_array).collect();
            match deltas.iter().position(|delta| !delta.is_finite()) {
                Some(vertex) => Err(RigFault::BadDelta { vertex }.into()),
                None => Ok(deltas),
            }
        };
        targets.map(target).collect()
    }

    fn vectors<const N: usize>(
        &self,
        accessor: &Accessor<'_>,
        shape: Dimensions,
        attribute: &'static str,
    ) -> Result<Vec<[f32; N]>, PrimitiveFault> {
        if accessor.dimensions() != shape {
            return Err(RigFault::Format(attribute).into());
        }
        self.vertices.read(accessor, [0.0; N], attribute)
    }
}
