//! Poses of a character: poses of clips, bent joints and morph targets.

use glam::{Affine3A, Mat4, Quat, Vec3};

use super::character::Character;
use crate::import::rig::ancestors;
use crate::import::{Channel, Clip, Import, Node, Property, Skin};
use crate::mesh::MAX_COORDINATE;

/// Poses chosen from clips, or from bent joints if there are no clips. With 8, characters have 6 % more triangles at
/// equal deviation, and held-out clips reach 0.82 instead of 0.73 of the stated deviation. With 32, triangles rise by
/// 1 %, and bakes take a third longer.
const CHOSEN: usize = 16;
/// Poses of all clips to choose from. Bounds the memory for files with many clips.
const MOST_CANDIDATES: usize = 1 << 12;
/// Keyframes of one clip to choose from. With 16, 32 or 128, skinned characters' triangles at equal deviation change by
/// at most 3 %.
const MOST_OF_CLIP: usize = 64;
/// Instances of a character that are posed with their own morph weights. Bounds the time for damaged files.
const MOST_INSTANCES: usize = 16;
/// Vertices by which poses are compared. With 64, characters have 2 % more triangles at equal deviation, and the knight's
/// held-out clips reach 0.89 instead of 0.69 of the stated deviation. With 512, triangles differ by less than 1 %.
const COMPARED_VERTICES: usize = 256;
/// Number of joints that are bent. Joints with the most weight come first. The rest are fingers and the like, which
/// move little area. With 16 joints, held-out clips deviated up to 7.5 times as far as stated. With 32 or 128, the
/// characters of the lab's record keep their levels.
const MOST_BENT: usize = 64;
/// Angle in radians by which joints are bent without clips, about each axis in both directions. At half of it, a clip
/// of the fox deviates 1.07 times as far as stated, instead of 0.75 times. At double the angle, guarantees are up to
/// 25 % larger.
const BEND: f32 = 1.3;
/// Angle by which joints are bent if there are clips, which show larger bends. Without bent joints, a held-out clip of
/// CesiumMan deviates 1.15 times as far as stated. At half the angle, it is 1.00 times. At double the angle, the
/// guarantee is 9 % larger.
const BEND_BESIDE_CLIPS: f32 = 0.65;
/// Poses that guide the simplification and choose between its results. Each one costs a measurement of every
/// simplification. With 16, characters have 5 % more triangles at equal deviation. Only characters with many morph
/// targets or instances have more than 32.
const MOST_GUIDING: usize = 32;

/// Transforms of joints and weights of morph targets. Posed vertices are in the space of the mesh, relative to the
/// carrier joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// For each joint of the skin, the transform from the bind pose. Empty for the bind pose.
    joints: Vec<Affine3A>,
    /// The origin of the world.
    origin: Vec3,
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
            let influences = influences.filter(|(_, own)| own.iter().any(|(_, w)| *w != 0.0));
            for (position, influence) in influences {
                let of_joint = |&(joint, weight): &(u16, f32)| {
                    self.joints[usize::from(joint)].transform_point3(*position) * weight
                };
                // The matrix of a joint without a weight may be NaN.
                let used = influence.iter().filter(|(_, weight)| *weight != 0.0);
                let moved: Vec3 = used.map(of_joint).sum();
                // Bevy adds up places in the world. Weights below 1 draw a vertex towards its origin.
                let missing = 1.0 - influence.iter().map(|(_, weight)| weight).sum::<f32>();
                *position = moved + self.origin * missing;
            }
        }
        positions
    }

    /// The normals of all vertices, if the source has normals. Morph targets are ignored, and scaled joints are
    /// inexact.
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

    /// Returns `true` if all posed vertices are within the range of a mesh.
    fn is_usable(&self, character: &Character<'_>) -> bool {
        let is_near = |p: &Vec3| p.is_finite() && p.abs().max_element() <= MAX_COORDINATE;
        self.positions(character).iter().all(is_near)
    }
}

/// The poses that a bake uses.
pub(super) struct Training {
    /// Poses in which levels are measured.
    pub(super) poses: Vec<Pose>,
    /// Number of poses at the start that guide the simplification and choose between its results.
    chosen: usize,
}

impl Training {
    /// The bind pose, the rest pose, poses of clips, each morph target, and each joint bent.
    pub(super) fn of(character: &Character<'_>, import: &Import, of_clips: &[Pose]) -> Self {
        let angle = if of_clips.is_empty() {
            BEND
        } else {
            BEND_BESIDE_CLIPS
        };
        let rigs = Rig::of_skins(character, import);
        // Skins of one mesh have similar skeletons, so the bends of the first suffice.
        let mut bent = bent_poses(&rigs[0], angle);
        let rest = rigs.iter().flat_map(|rig| rig.poses(&[]));
        let first = std::iter::once(Pose::default()).chain(rest).collect();
        let varied = if of_clips.is_empty() { &bent } else { of_clips };
        let mut poses = farthest(character, first, varied);
        poses.extend(target_poses(character));
        poses.retain(|pose| pose.is_usable(character));
        let chosen = poses.len().min(MOST_GUIDING);
        // Bent joints come last: they only measure levels, unless there are no clips.
        bent.retain(|pose| !poses.contains(pose));
        poses.extend(bent);
        Self { poses, chosen }
    }

    pub(super) fn chosen(&self) -> &[Pose] {
        &self.poses[..self.chosen]
    }
}

/// Poses at up to 64 keyframes of each clip. Empty if no clip moves the character.
#[must_use]
pub fn clip_poses(character: &Character<'_>, import: &Import, clips: &[Clip]) -> Vec<Pose> {
    let rigs = Rig::of_skins(character, import);
    let instances = rigs.first().map_or(1, |rig| rig.instances);
    let most = MOST_CANDIDATES / (clips.len() * rigs.len() * instances).max(1);
    let of_rig = |rig: &Rig<'_>, clip: &Clip| {
        let channels = clip.channels.iter();
        let own: Vec<_> = channels
            .filter(|channel| rig.is_used[channel.node as usize])
            .collect();
        let times = own.iter().flat_map(|channel| &channel.times);
        let mut times: Vec<f32> = times.copied().collect();
        times.sort_by(f32::total_cmp);
        times.dedup();
        let step = times.len().div_ceil(most.clamp(1, MOST_OF_CLIP)).max(1);
        let times = times.into_iter().step_by(step);
        let poses = times.flat_map(|time| rig.poses_at(own.iter().copied(), time));
        poses.collect::<Vec<_>>()
    };
    let pairs = clips
        .iter()
        .flat_map(|clip| rigs.iter().map(move |rig| (rig, clip)));
    let poses = pairs.flat_map(|(rig, clip)| of_rig(rig, clip));
    poses.take(MOST_CANDIDATES).collect()
}

/// Each joint bent by itself.
fn bent_poses(rig: &Rig<'_>, angle: f32) -> Vec<Pose> {
    let joints = rig.character.joints_by_weight.iter().take(MOST_BENT);
    let bends = joints.flat_map(|&joint| {
        let node = rig.joints[usize::from(joint)];
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter();
        axes.flat_map(move |axis| [(node, axis, angle), (node, axis, -angle)])
    });
    let pose = |(node, axis, angle): (u32, Vec3, f32)| {
        let rest = rig.nodes[node as usize].rotation;
        let rotation = rest * Quat::from_axis_angle(axis, angle);
        let change = (node, Property::Rotation, rotation.to_array().to_vec());
        // Instances differ by their morph weights alone, so one of them suffices.
        rig.poses(&[change]).into_iter().next()
    };
    bends.filter_map(pose).collect()
}

/// Each morph target at 1, in the bind pose. Targets with the same index in several parts move together.
fn target_poses(character: &Character<'_>) -> Vec<Pose> {
    let targets = character.parts.iter().map(|part| part.rig.targets.len());
    let pose = |target: usize| {
        let mut weights = vec![0.0; target + 1];
        weights[target] = 1.0;
        Pose {
            weights: vec![weights; character.parts.len()],
            ..Pose::default()
        }
    };
    (0..targets.max().unwrap_or(0)).map(pose).collect()
}

/// Adds the [`CHOSEN`] candidates that are farthest from `chosen` and from each other.
fn farthest(character: &Character<'_>, mut chosen: Vec<Pose>, candidates: &[Pose]) -> Vec<Pose> {
    let vertices = character.mesh.positions.len();
    let step = vertices.div_ceil(COMPARED_VERTICES).max(1);
    let compared = |pose: &Pose| -> Vec<Vec3> {
        let positions = pose.positions(character).into_iter();
        positions.step_by(step).collect()
    };
    let places: Vec<Vec<Vec3>> = candidates.iter().map(compared).collect();
    let mut distances = vec![f32::INFINITY; candidates.len()];
    // Updates the distances for one more chosen pose, and returns the candidate that is now farthest.
    let mut shrink = |to: &[Vec3]| {
        for (distance, places) in distances.iter_mut().zip(&places) {
            let pairs = places.iter().zip(to);
            let own: f32 = pairs.map(|(a, b)| a.distance_squared(*b)).sum();
            *distance = distance.min(own);
        }
        let distances = distances.iter().copied().enumerate();
        distances.max_by(|a, b| a.1.total_cmp(&b.1))
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

/// A node, a property, and its value in a pose.
type Change = (u32, Property, Vec<f32>);

/// The nodes that pose a character.
struct Rig<'a> {
    character: &'a Character<'a>,
    nodes: &'a [Node],
    skin: Option<&'a Skin>,
    /// The nodes of the joints.
    joints: &'a [u32],
    /// The joints and their ancestors, parents first.
    order: Vec<u32>,
    /// For each node of the file, its index in `order`, or 0.
    slots: Vec<usize>,
    /// For each part, the nodes that draw its mesh.
    drawn_by: Vec<Vec<u32>>,
    /// The largest number of nodes that draw a mesh of the character, up to [`MOST_INSTANCES`].
    instances: usize,
    /// For each node of the file, whether it affects a pose.
    is_used: Vec<bool>,
}

impl<'a> Rig<'a> {
    /// The nodes that pose a character, for each of its skins.
    fn of_skins(character: &'a Character<'a>, import: &'a Import) -> Vec<Self> {
        let skins = character.skins.iter().take(MOST_INSTANCES);
        let skins = skins.map(|skin| Self::of(character, import, Some(skin)));
        let skins: Vec<Self> = skins.collect();
        if skins.is_empty() {
            vec![Self::of(character, import, None)]
        } else {
            skins
        }
    }

    fn of(character: &'a Character<'a>, import: &'a Import, skin: Option<&'a Skin>) -> Self {
        let joints = skin.map_or(&[][..], |skin| &skin.joints);
        let mut is_used = vec![false; import.nodes.len()];
        let mut order: Vec<u32> = Vec::new();
        for &joint in joints {
            let chain = ancestors(&import.nodes, joint);
            // The ancestors of a known node are known as well.
            let new = chain.take_while(|node| !is_used[*node as usize]);
            let new: Vec<u32> = new.collect();
            new.iter().for_each(|node| is_used[*node as usize] = true);
            order.extend(new.into_iter().rev());
        }
        let mut slots = vec![0; import.nodes.len()];
        for (slot, &node) in order.iter().enumerate() {
            slots[node as usize] = slot;
        }
        let drawn_by = character.parts.iter().map(|part| {
            let mesh = Some(part.primitive.place.mesh_index);
            let nodes = (0u32..).zip(&import.nodes);
            let drawing = nodes.filter(|(_, node)| node.mesh == mesh);
            let drawing = drawing.map(|(index, _)| index).take(MOST_INSTANCES);
            drawing.collect()
        });
        let drawn_by: Vec<Vec<u32>> = drawn_by.collect();
        for node in drawn_by.iter().flatten() {
            is_used[*node as usize] = true;
        }
        Self {
            character,
            nodes: &import.nodes,
            skin,
            joints,
            order,
            slots,
            instances: drawn_by.iter().map(Vec::len).max().unwrap_or(0).max(1),
            drawn_by,
            is_used,
        }
    }

    fn poses_at<'b>(
        &self,
        channels: impl IntoIterator<Item = &'b Channel>,
        time: f32,
    ) -> Vec<Pose> {
        let channels = channels.into_iter();
        let changes = channels.map(|own| (own.node, own.property, own.at(time)));
        self.poses(&changes.collect::<Vec<_>>())
    }

    /// The rest pose with `changes` applied: one pose for each distinct set of morph weights of the instances.
    /// Degenerate poses, and poses that are too far away, are left out.
    fn poses(&self, changes: &[Change]) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::new();
        let Some((joints, origin)) = self.joints_in(changes) else {
            return poses;
        };
        for instance in 0..self.instances {
            let weights = self.weights_in(changes, instance);
            if poses.iter().all(|pose| pose.weights != weights) {
                let joints = joints.clone();
                poses.push(Pose {
                    joints,
                    origin,
                    weights,
                });
            }
        }
        poses.retain(|pose| pose.is_usable(self.character));
        poses
    }

    /// The transforms of the joints and the origin of the world, relative to the carrier joint.
    fn joints_in(&self, changes: &[Change]) -> Option<(Vec<Affine3A>, Vec3)> {
        let Some(skin) = self.skin else {
            return Some((Vec::new(), Vec3::ZERO));
        };
        let nodes = || self.order.iter().map(|&node| &self.nodes[node as usize]);
        let local = |node: &Node| (node.scale, node.rotation, node.translation);
        let mut locals: Vec<(Vec3, Quat, Vec3)> = nodes().map(local).collect();
        for (node, property, value) in changes {
            let slot = self.slots[*node as usize];
            // Nodes that are not in the list have slot 0.
            if self.order.get(slot) != Some(node) {
                continue;
            }
            let (scale, rotation, translation) = &mut locals[slot];
            match (property, &value[..]) {
                (Property::Translation, &[x, y, z]) => *translation = Vec3::new(x, y, z),
                (Property::Scale, &[x, y, z]) => *scale = Vec3::new(x, y, z),
                (Property::Rotation, &[x, y, z, w]) => {
                    *rotation = Quat::from_xyzw(x, y, z, w).normalize();
                }
                _ => {}
            }
        }
        let mut globals: Vec<Mat4> = Vec::with_capacity(locals.len());
        for (node, (scale, rotation, translation)) in nodes().zip(locals) {
            let local = Mat4::from_scale_rotation_translation(scale, rotation, translation);
            globals.push(match node.parent {
                Some(parent) => globals[self.slots[parent as usize]] * local,
                None => local,
            });
        }
        let pairs = skin.joints.iter().zip(&skin.inverse_binds);
        let joints = pairs.map(|(&joint, bind)| {
            let global = globals[self.slots[joint as usize]];
            Affine3A::from_mat4(global * *bind)
        });
        let joints: Vec<Affine3A> = joints.collect();
        let carrier = joints.get(usize::from(self.character.carrier_joint()?))?;
        // A carrier that is scaled to zero has no inverse.
        let is_regular = carrier.matrix3.determinant().is_normal();
        let own_from_world = is_regular.then(|| carrier.inverse())?;
        let joints = joints.iter().map(|joint| own_from_world * *joint);
        Some((joints.collect(), own_from_world.translation.into()))
    }

    /// The weights of the morph targets of each part, as an instance has them.
    fn weights_in(&self, changes: &[Change], instance: usize) -> Vec<Vec<f32>> {
        let of_part = self.drawn_by.iter().map(|nodes| {
            let node = nodes.get(instance.min(nodes.len().saturating_sub(1)));
            let Some(&node) = node else {
                return Vec::new();
            };
            let is_own = |change: &&Change| change.0 == node && change.1 == Property::Weights;
            match changes.iter().rfind(is_own) {
                Some((_, _, weights)) => weights.clone(),
                None => self.nodes[node as usize].weights.clone(),
            }
        });
        of_part.collect()
    }
}
