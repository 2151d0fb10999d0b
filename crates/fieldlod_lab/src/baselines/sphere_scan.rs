//! clusterlod's choice as fast as a processor makes it: eight groups to a register, no root, and
//! then the units of the groups that are refined.
//!
//! ```text
//! e f / max(ρ − r, near) > τ   ⇔   (e f/τ + r)² > ρ²  and  e f/τ > near
//! ```

use fieldlod_hierarchy::NO_GROUP;
use glam::Vec3;
use wide::f32x8;

use crate::object::LodObject;
use crate::object_view::ObjectView;

const LANES: usize = 8;
/// Groups to a word of bits.
const WORD: usize = 64;

/// The spheres and errors that clusterlod reads of an object, eight groups to an element.
#[derive(Debug)]
pub(crate) struct SphereScan {
    /// Centre and radius of the nested sphere, and the error.
    rows: [Vec<f32x8>; 5],
    /// The first unit that each group consumes, and the number of units at the end.
    first_unit: Vec<u32>,
    produced_by: Vec<u32>,
}

impl SphereScan {
    /// Lays out an object.
    pub(crate) fn new(object: &LodObject) -> Self {
        let hierarchy = &object.hierarchy;
        // Groups beyond the last have no error, and are never refined.
        let padded = hierarchy.groups.len().next_multiple_of(WORD);
        let lanes = |value: &dyn Fn(usize) -> f32| -> Vec<f32x8> {
            let at = |group: usize| {
                if group < hierarchy.groups.len() {
                    value(group)
                } else {
                    0.0
                }
            };
            let element =
                |index: usize| f32x8::from(std::array::from_fn(|i| at(index * LANES + i)));
            (0..padded / LANES).map(element).collect()
        };
        let sphere = |group: usize| object.nested_bounds[group];
        let first_unit = hierarchy.groups.iter().map(|group| group.first_unit);
        Self {
            rows: [
                lanes(&|group| sphere(group).center.x),
                lanes(&|group| sphere(group).center.y),
                lanes(&|group| sphere(group).center.z),
                lanes(&|group| sphere(group).radius),
                lanes(&|group| object.errors_in_local[group]),
            ],
            first_unit: first_unit.chain([hierarchy.units.len() as u32]).collect(),
            produced_by: hierarchy.units.iter().map(|u| u.produced_by).collect(),
        }
    }

    /// Marks the groups with more than `threshold_px` in a perspective view of an instance that keeps
    /// angles: a bit for each.
    pub(crate) fn refine(&self, view: &ObjectView, threshold_px: f32, refined: &mut Vec<u64>) {
        let splat = f32x8::splat;
        // All is done in local space, in which the spheres are.
        let local_from_world = view.instance.world_from_local.inverse();
        let position: Vec3 = local_from_world.transform_point3(view.eye.position());
        let eye = position.to_array().map(splat);
        let scale = splat(view.eye.focal_px() / threshold_px);
        let near = splat(view.eye.near / view.max_scale);
        // Eight groups at a time, into words of 64 bits.
        let [x, y, z, radius, error] = &self.rows;
        refined.clear();
        refined.extend((0..x.len() / LANES).map(|word| {
            (0..LANES).fold(0u64, |bits, block| {
                let at = word * LANES + block;
                let (dx, dy, dz) = (x[at] - eye[0], y[at] - eye[1], z[at] - eye[2]);
                // Nearer than this to the sphere, the error is above the threshold.
                let visible_to = error[at] * scale;
                let from_center = visible_to + radius[at];
                let is_near = (from_center * from_center).simd_gt(dx * dx + dy * dy + dz * dz);
                let above = is_near & visible_to.simd_gt(near);
                bits | u64::from(above.to_bitmask() & 0xff) << (LANES * block)
            })
        }));
    }

    /// The units of the cut in which the marked groups are refined, ascending.
    pub(crate) fn units(&self, refined: &[u64], units: &mut Vec<u32>) {
        let is_refined = |group: u32| refined[group as usize / WORD] >> (group as usize % WORD) & 1;
        units.clear();
        for (word, &bits) in refined.iter().enumerate() {
            // Each bit that is set is a group whose units are drawn, but for those that a finer group
            // draws in their place.
            let mut left = bits;
            while left != 0 {
                let group = word * WORD + left.trailing_zeros() as usize;
                left &= left - 1;
                let consumed = self.first_unit[group]..self.first_unit[group + 1];
                units.extend(consumed.filter(|&unit| {
                    let producer = self.produced_by[unit as usize];
                    producer == NO_GROUP || is_refined(producer) == 0
                }));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chooser::Chooser;
    use crate::eye::{Eye, Instance};
    use crate::method::Method;
    use crate::object::ErrorSource;
    use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
    use glam::{Affine3A, Quat, Vec2};

    #[test]
    fn the_scan_chooses_what_clusterlod_chooses() {
        let hierarchy = bake_mesh(&fixtures::rock(5, 7), &BakeConfig::fine_grained()).unwrap();
        let object = LodObject::new(hierarchy, ErrorSource::Reported);
        let scan = SphereScan::new(&object);
        let placed = Affine3A::from_scale_rotation_translation(
            Vec3::splat(3.0),
            Quat::from_rotation_y(1.0),
            Vec3::new(2.0, 0.5, -1.0),
        );
        let (mut bits, mut units) = (Vec::new(), Vec::new());
        let mut sizes = Vec::new();
        for distance in [0.1, 1.3, 4.0, 12.0, 60.0] {
            let eye = Eye::perspective(60.0, Vec2::new(640.0, 360.0), 0.01);
            let eye = eye.looking_at(placed.transform_point3(Vec3::Z * distance), Vec3::ZERO);
            let instance = Instance::at(placed);
            let view = ObjectView::new(&object, &instance, &eye);
            for threshold_px in [0.3, 1.0, 4.0] {
                let expected = Chooser::new(Method::Clusterlod, threshold_px).choose(&view);
                scan.refine(&view, threshold_px, &mut bits);
                scan.units(&bits, &mut units);
                assert_eq!(units, expected.units, "{distance} {threshold_px}");
                sizes.push(units.len());
            }
        }
        sizes.sort_unstable();
        sizes.dedup();
        assert!(sizes.len() > 4, "always the same cut: {sizes:?}");
    }
}
