//! Poses of a character: of its clips, of bent joints and of morph targets.

use glam::{Affine3A, Mat4, Quat, Vec3};

use super::character::Character;
use crate::import::rig::ancestors;
use crate::import::{Clip, Import, Node, Property};
use crate::mesh::MAX_COORDINATE;

/// Poses that are chosen from clips. With 8, held-out clips deviate up to 1.9 times as far as these, and with 16 up to
/// 1.5 times.
const CHOSEN: usize = 16;
/// Poses of all clips to choose from, and of one clip.
const MOST_CANDIDATES: usize = 1 << 12;
const MOST_OF_CLIP: usize = 64;
/// Vertices by which poses are compared.
const COMPARED_VERTICES: usize = 256;
/// Without clips, as many joints are bent, those with the most weight first.
const MOST_BENT: usize = 64;
/// By this angle, about each axis in both directions.
const BEND: f32 = 1.3;
/// Clips with fewer keyframes than this do not show how joints bend in others: levels that are chosen by half of a walk
/// deviate 1.7 times as far in the other half. Joints are then bent by a smaller angle, too.
const FEW: usize = 128;
const BEND_BESIDE_CLIPS: f32 = 0.65;
/// Levels are made for at most so many poses.
const MOST_MADE_FOR: usize = 32;

/// Where joints and morph targets bring the vertices of a character, in its space as carried by its carrier joint.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    /// For each joint of the skin, from the mesh in the bind pose. Empty for the bind pose.
    joints: Vec<Affine3A>,
    /// For each part of the character, the weights of its morph targets.
    weights: Vec<Vec<f32>>,
}

impl Pose {
    /// The positions of all vertices of a character.
    #[must_use]
    pub fn positions(&self, character: &Character<'_>) -> Vec<Vec3> {
        let mut positions = character.mesh.positions.clone();
        for (part, weights) in character.parts.iter().zip(&self.weights) {
            let own = &mut positions[part.range()];
            for (target, &weight) in part.rig.targets.iter().zip(weights) {
                let moved = own.iter_mut().zip(target).filter(|_| weight != 0.0);
                moved.for_each(|(position, delta)| *position += *delta * weight);
            }
        }
        if !self.joints.is_empty() {
            let influences = positions.iter_mut().zip(&character.influences);
            for (position, influence) in influences {
                let of_joint = |&(joint, weight): &(u16, f32)| {
                    self.joints[usize::from(joint)].transform_point3(*position) * weight
                };
                *position = influence.iter().map(of_joint).sum();
            }
        }
        positions
    }

    /// The normals of all vertices, if the source has normals. Scaled joints and morph targets do not change them.
    #[cfg(any(test, feature = "test-support"))]
    #[must_use]
    pub fn normals(&self, character: &Character<'_>) -> Vec<Vec3> {
        let mut normals = character.mesh.normals.clone();
        if self.joints.is_empty() {
            return normals;
        }
        for (normal, influence) in normals.iter_mut().zip(&character.influences) {
            let of_joint = |&(joint, weight): &(u16, f32)| {
                self.joints[usize::from(joint)].transform_vector3(*normal) * weight
            };
            *normal = influence
                .iter()
                .map(of_joint)
                .sum::<Vec3>()
                .normalize_or_zero();
        }
        normals
    }

    /// Whether all vertices have coordinates that a mesh may have.
    fn is_usable(&self, character: &Character<'_>) -> bool {
        let is_near = |p: &Vec3| p.is_finite() && p.abs().max_element() <= MAX_COORDINATE;
        self.positions(character).iter().all(is_near)
    }
}

/// The poses that a bake goes by.
pub(super) struct Training {
    /// All in which levels are measured.
    pub(super) poses: Vec<Pose>,
    /// Levels are made for the first of them, and chosen by them.
    chosen: usize,
}

impl Training {
    /// The bind pose, poses of clips, each morph target, and each joint bent if there are few poses of clips.
    pub(super) fn of(character: &Character<'_>, import: &Import) -> Self {
        let of_clips = clip_poses(character, import, &import.clips);
        let bent = match of_clips.len() {
            0 => bent_poses(character, import, BEND),
            count if count < FEW => bent_poses(character, import, BEND_BESIDE_CLIPS),
            _ => Vec::new(),
        };
        let rest = Rig::of(character, import).pose(&[]);
        let first = std::iter::once(Pose::default()).chain(rest).collect();
        let varied = if of_clips.is_empty() {
            &bent
        } else {
            &of_clips
        };
        let mut poses = farthest(character, first, varied);
        poses.extend(target_poses(character));
        poses.retain(|pose| pose.is_usable(character));
        let chosen = poses.len().min(MOST_MADE_FOR);
        poses.extend(bent);
        Self { poses, chosen }
    }

    pub(super) fn chosen(&self) -> &[Pose] {
        &self.poses[..self.chosen]
    }
}

/// Poses at keyframes of clips, at most 64 of each. Empty if no clip moves the character.
#[must_use]
pub fn clip_poses(character: &Character<'_>, import: &Import, clips: &[Clip]) -> Vec<Pose> {
    let rig = Rig::of(character, import);
    let most = (MOST_CANDIDATES / clips.len().max(1)).clamp(1, MOST_OF_CLIP);
    let poses = clips.iter().flat_map(|clip| {
        let channels = clip.channels.iter();
        let own = channels.filter(|channel| rig.is_moved_by(channel.node));
        let mut times: Vec<f32> = own.flat_map(|channel| &channel.times).copied().collect();
        times.sort_by(f32::total_cmp);
        times.dedup();
        let step = times.len().div_ceil(most).max(1);
        let times: Vec<f32> = times.into_iter().step_by(step).collect();
        let rig = &rig;
        times.into_iter().filter_map(move |time| {
            let values = clip.channels.iter().map(|channel| {
                let value = channel.at(time);
                (channel.node, channel.property, value)
            });
            rig.pose(&values.collect::<Vec<_>>())
        })
    });
    poses.collect()
}

/// Each joint bent by itself.
fn bent_poses(character: &Character<'_>, import: &Import, angle: f32) -> Vec<Pose> {
    let rig = Rig::of(character, import);
    let joints = character.joints_by_weight.iter().take(MOST_BENT);
    let bends = joints.flat_map(|&joint| {
        let node = rig.joints[usize::from(joint)];
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter();
        axes.flat_map(move |axis| [(node, axis, angle), (node, axis, -angle)])
    });
    let pose = |(node, axis, angle): (u32, Vec3, f32)| {
        let rest = import.nodes[node as usize].rotation;
        let rotation = rest * Quat::from_axis_angle(axis, angle);
        rig.pose(&[(node, Property::Rotation, rotation.to_array().to_vec())])
    };
    bends.filter_map(pose).collect()
}

/// Each morph target at 1, in the bind pose.
fn target_poses(character: &Character<'_>) -> Vec<Pose> {
    let parts = character.parts.iter();
    let count = parts.clone().map(|part| part.rig.targets.len()).max();
    let pose = |target: usize| Pose {
        joints: Vec::new(),
        weights: parts
            .clone()
            .map(|_| {
                (0..=target)
                    .map(|t| f32::from(u8::from(t == target)))
                    .collect()
            })
            .collect(),
    };
    (0..count.unwrap_or(0)).map(pose).collect()
}

/// `chosen`, and the [`CHOSEN`] candidates that are farthest from it and from each other.
fn farthest(character: &Character<'_>, mut chosen: Vec<Pose>, candidates: &[Pose]) -> Vec<Pose> {
    let step = character
        .mesh
        .positions
        .len()
        .div_ceil(COMPARED_VERTICES)
        .max(1);
    let compared = |pose: &Pose| -> Vec<Vec3> {
        pose.positions(character)
            .into_iter()
            .step_by(step)
            .collect()
    };
    let places: Vec<Vec<Vec3>> = candidates.iter().map(compared).collect();
    let mut distances = vec![f32::INFINITY; candidates.len()];
    let mut shrink = |to: &[Vec3]| {
        for (distance, places) in distances.iter_mut().zip(&places) {
            let pairs = places.iter().zip(to);
            let own: f32 = pairs.map(|(a, b)| a.distance_squared(*b)).sum();
            *distance = distance.min(own);
        }
        let numbered = distances.iter().enumerate();
        numbered
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map(|(k, d)| (k, *d))
    };
    let mut next = None;
    for pose in &chosen {
        next = shrink(&compared(pose));
    }
    for _ in 0..CHOSEN {
        let Some((index, _)) = next.filter(|(_, distance)| *distance > 0.0) else {
            break;
        };
        chosen.push(candidates[index].clone());
        next = shrink(&places[index]);
    }
    chosen
}

/// The nodes that pose a character.
struct Rig<'a> {
    character: &'a Character<'a>,
    nodes: &'a [Node],
    /// The nodes of the joints.
    joints: &'a [u32],
    /// The joints and what they are attached to, parents first.
    order: Vec<u32>,
}

impl<'a> Rig<'a> {
    fn of(character: &'a Character<'a>, import: &'a Import) -> Self {
        let joints = character.skin.map_or(&[][..], |skin| &skin.joints);
        let mut is_listed = vec![false; import.nodes.len()];
        let mut order = Vec::new();
        for &joint in joints {
            let chain = ancestors(&import.nodes, joint);
            let new: Vec<u32> = chain
                .take_while(|node| !is_listed[*node as usize])
                .collect();
            new.iter().for_each(|node| is_listed[*node as usize] = true);
            order.extend(new.into_iter().rev());
        }
        Self {
            character,
            nodes: &import.nodes,
            joints,
            order,
        }
    }

    fn is_moved_by(&self, node: u32) -> bool {
        let mesh = self.nodes[node as usize].mesh;
        let parts = self.character.parts.iter();
        let mut meshes = parts.map(|part| part.primitive.place.mesh_index);
        self.order.contains(&node) || meshes.any(|own| Some(own) == mesh)
    }

    /// The pose in which some properties of nodes differ from the rest pose. `None` if it is degenerate or too far away.
    fn pose(&self, values: &[(u32, Property, Vec<f32>)]) -> Option<Pose> {
        let mut nodes: Vec<Node> = self.nodes.to_vec();
        for (node, property, value) in values {
            let node = &mut nodes[*node as usize];
            match (property, &value[..]) {
                (Property::Translation, &[x, y, z]) => node.translation = Vec3::new(x, y, z),
                (Property::Scale, &[x, y, z]) => node.scale = Vec3::new(x, y, z),
                (Property::Rotation, &[x, y, z, w]) => {
                    node.rotation = Quat::from_xyzw(x, y, z, w).normalize();
                }
                (Property::Weights, weights) => node.weights = weights.to_vec(),
                _ => {}
            }
        }
        let pose = Pose {
            joints: self.joints_of(&nodes)?,
            weights: self.weights_of(&nodes),
        };
        pose.is_usable(self.character).then_some(pose)
    }

    fn joints_of(&self, nodes: &[Node]) -> Option<Vec<Affine3A>> {
        let Some(skin) = self.character.skin else {
            return Some(Vec::new());
        };
        let mut globals = vec![Mat4::IDENTITY; nodes.len()];
        for &index in &self.order {
            let node = &nodes[index as usize];
            let local =
                Mat4::from_scale_rotation_translation(node.scale, node.rotation, node.translation);
            globals[index as usize] = match node.parent {
                Some(parent) => globals[parent as usize] * local,
                None => local,
            };
        }
        let pairs = skin.joints.iter().zip(&skin.inverse_binds);
        let joints =
            pairs.map(|(&joint, bind)| Affine3A::from_mat4(globals[joint as usize] * *bind));
        let joints: Vec<Affine3A> = joints.collect();
        let carrier = joints.get(usize::from(self.character.carrier_joint?))?;
        let own_from_world = carrier
            .matrix3
            .determinant()
            .is_normal()
            .then(|| carrier.inverse())?;
        Some(joints.iter().map(|joint| own_from_world * *joint).collect())
    }

    fn weights_of(&self, nodes: &[Node]) -> Vec<Vec<f32>> {
        let parts = self.character.parts.iter();
        let of_part = parts.map(|part| {
            let mesh = Some(part.primitive.place.mesh_index);
            let node = nodes.iter().find(|node| node.mesh == mesh);
            node.map_or_else(Vec::new, |node| node.weights.clone())
        });
        of_part.collect()
    }
}
