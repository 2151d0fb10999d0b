//! A bound of the deviation for any pose that bends joints by up to an angle.
//!
//! A point of a surface is `y = Σ_i λ_i y_i` in the bind pose. Posed, it is `Σ_b M_b m_b` with the moments
//! ```text
//! m_b = Σ_i λ_i u_ib (y_i, 1)
//! ```
//! of the joints `b` with weights `u_ib`. The moments of two points at a distance `d` in the bind pose differ by
//! `Δm_b`. If joints do not stretch, the distance of the posed points is, for any joint `r`, at most
//! ```text
//! d + Σ_{b ≠ r} ‖(M_b − M_r) Δm_b‖
//! ```
//! A joint that turns by θ about its pivot `p` moves a moment `(v, s)` by at most `2 sin(θ/2) ‖v − s p‖`. The joints
//! that turn `b` against `r` are the joints above one of the two but not above the other.

use std::collections::BTreeMap;

use glam::{Vec3, Vec4};

use super::character::Character;
use super::deviation::{Sample, nearest_pairs};
use crate::import::Import;
use crate::import::rig::ancestors;

/// The distance of two points in the bind pose, and by how much it can grow per `2 sin(θ/2)`.
type Growth = (f32, f32);

/// For each angle, a bound of the distances between samples of a level and the source, in both directions. Morph
/// targets are at 0.
pub(super) fn bounds<const N: usize>(
    character: &Character<'_>,
    import: &Import,
    level: &[[u32; 3]],
    degrees: [f32; N],
) -> [f32; N] {
    let skeleton = Skeleton::of(character, import);
    let pairs = nearest_pairs(character, level);
    let growths: Vec<Growth> = pairs.iter().map(|pair| skeleton.growth(pair)).collect();
    degrees.map(|degrees| {
        let chord = 2.0 * (degrees.to_radians() * 0.5).sin();
        let bounds = growths.iter().map(|(near, slope)| near + slope * chord);
        bounds.fold(0.0, f32::max)
    })
}

struct Skeleton<'a> {
    character: &'a Character<'a>,
    /// The position of each joint in the bind pose.
    pivots: Vec<Vec3>,
    /// Each joint with the joints above it.
    chains: Vec<Vec<u16>>,
}

impl<'a> Skeleton<'a> {
    fn of(character: &'a Character<'a>, import: &Import) -> Self {
        // Skins of one character usually have equal skeletons.
        let skin = character.skins.first();
        let joints = skin.map_or(&[][..], |skin| &skin.joints);
        // A matrix without an inverse places its joint nowhere.
        let pivot = |joint: u16| {
            let skin = skin.filter(|skin| skin.is_invertible(joint));
            let bind = skin.map(|skin| skin.inverse_binds[usize::from(joint)].inverse());
            bind.map_or(Vec3::ZERO, |bind| bind.w_axis.truncate())
        };
        let chain = |&joint: &u32| {
            let nodes = ancestors(&import.nodes, joint);
            let above = nodes.filter_map(|node| joints.iter().position(|&joint| joint == node));
            above.map(|joint| joint as u16).collect()
        };
        Self {
            character,
            pivots: (0..joints.len() as u16).map(pivot).collect(),
            chains: joints.iter().map(chain).collect(),
        }
    }

    /// The distance of two points, and by how much it can grow.
    fn growth(&self, [x, y]: &[Sample; 2]) -> Growth {
        let positions = &self.character.mesh.positions;
        let near = x.position(positions).distance(y.position(positions));
        // For each joint, the difference of the moments, and the weight of both points.
        let mut moments: BTreeMap<u16, (Vec4, f32)> = BTreeMap::new();
        for (sample, sign) in [(x, 1.0), (y, -1.0)] {
            for (&corner, share) in sample.corners.iter().zip(sample.weights.to_array()) {
                let influences = self.character.influences.get(corner as usize);
                for &(joint, weight) in influences.into_iter().flatten() {
                    let (moment, sum) = moments.entry(joint).or_default();
                    let share = share * weight;
                    *moment += positions[corner as usize].extend(1.0) * (share * sign);
                    *sum += share;
                }
            }
        }
        // Any joint may be the reference. The strongest one leaves the smallest moments.
        let strongest = moments.iter().max_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let Some((&strongest, _)) = strongest else {
            return (near, 0.0);
        };
        let growths = moments.iter().map(|(&joint, (moment, _))| {
            let [own, other] = [joint, strongest].map(|joint| &self.chains[usize::from(joint)]);
            // Joints above both turn them together, and change no distance.
            let of_own = own.iter().filter(|joint| !other.contains(joint));
            let between = of_own.chain(other.iter().filter(|joint| !own.contains(joint)));
            let arms = between.map(|joint| {
                let pivot = self.pivots[usize::from(*joint)];
                (moment.truncate() - pivot * moment.w).length()
            });
            arms.sum::<f32>()
        });
        (near, growths.sum())
    }
}
