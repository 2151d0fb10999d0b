//! Visible shares of instances and groups by a depth image. Points outside the image count as hidden.

use wide::f32x8;

use super::OcclusionBuffer;
use super::choice::camera_from_local;
use crate::hidden::shares::{FULL_SHARE, HIDDEN, share_of_step};
use crate::lanes::bits::LANES;
use crate::lanes::{Lane, M3, V3, bits_of};
use crate::scene::table::GroupTable;
use crate::scene::{Instance, InstanceId, Scene};
use crate::view::stretch::largest_stretch;

/// Radius in texels from which the groups of an instance have shares of their own. A smaller radius costs more samples;
/// a larger radius counts the hidden groups of large instances as visible.
const LARGE_RADIUS: f32 = 24.0;
/// Sample points of a whole instance, and of a whole instance with a radius below [`SMALL_RADIUS`]. Fewer points give
/// coarser steps of the share; more points cost time in proportion.
const INSTANCE_SAMPLES: usize = 32;
const SMALL_SAMPLES: usize = 8;
const SMALL_RADIUS: f32 = 1.0;
/// Relative distance behind a texel at which a point is still visible. Without it, surfaces hide themselves by
/// rounding; a larger distance sees through thin occluders.
const SAME_DEPTH: f32 = 1e-3;

/// The points of one instance, as the depth image tests them.
struct Query {
    linear: M3<f32x8>,
    origin: V3<f32x8>,
    instance: u32,
}

impl OcclusionBuffer {
    /// The visible share of each group of an instance, above 0 and at most 1; empty if the instance was removed.
    #[must_use]
    pub fn visible_shares(&self, scene: &Scene, instance: InstanceId) -> Vec<f32> {
        let Some(mesh) = scene.mesh_of(instance) else {
            return Vec::new();
        };
        let (table, mut groups) = (scene.table(mesh), Vec::new());
        let placed = &scene.instances[instance.index()];
        if let Some(of_all) = self.shares(table, instance, placed, &mut groups) {
            groups = vec![of_all; table.group_count];
        }
        let share = |&step: &u8| share_of_step(step, 0.0);
        groups.iter().map(share).collect()
    }

    /// The visible share of an instance in steps, rounded up; `None` if the instance is so large that its groups have
    /// shares of their own.
    pub(crate) fn share_of_all(
        &self,
        table: &GroupTable,
        id: InstanceId,
        instance: &Instance,
    ) -> Option<u8> {
        // The radius of the instance in texels.
        let sphere = &instance.sphere;
        let gap = (sphere.center - self.view.eye_in_world).length() - sphere.radius;
        let radius = self.plane.texels(sphere.radius, gap);
        let is_small = radius < SMALL_RADIUS;
        if radius >= LARGE_RADIUS && !table.has_one_place() {
            return None;
        }
        // The texels of the instance itself hide none of its points.
        let count = if is_small {
            SMALL_SAMPLES
        } else {
            INSTANCE_SAMPLES
        };
        let query = self.query(id, instance);
        Some(self.share(table.samples.of_mesh(count), &query, None))
    }

    /// [`Self::share_of_all`]; if it is `None`, `groups` gets the visible shares of the groups.
    pub(crate) fn shares(
        &self,
        table: &GroupTable,
        id: InstanceId,
        instance: &Instance,
        groups: &mut Vec<u8>,
    ) -> Option<u8> {
        let of_all = self.share_of_all(table, id, instance);
        if of_all.is_none() {
            let query = self.query(id, instance);
            let (linear, _) = camera_from_local(&self.view, &instance.world_from_local);
            let stretch = largest_stretch(&linear);
            groups.clear();
            groups.extend((0..table.group_count).map(|group| {
                let (block, lane) = (group / LANES, group % LANES);
                let radius = table.groups.radius[block].to_array()[lane] * stretch;
                self.share(table.samples.of_group(group), &query, Some(radius))
            }));
        }
        of_all
    }

    fn query(&self, id: InstanceId, instance: &Instance) -> Query {
        let (linear, origin) = camera_from_local(&self.view, &instance.world_from_local);
        Query {
            linear: M3::splat(&linear),
            origin: V3::splat(origin),
            instance: id.index,
        }
    }

    /// The share of points that are visible; full without points. Texels of the same instance hide only points that are
    /// farther by more than a `thickness`; without a `thickness`, they hide no points.
    #[inline(always)]
    fn share(&self, samples: &[V3<f32x8>], query: &Query, thickness: Option<f32>) -> u8 {
        let (mut count, mut visible) = (0, 0);
        for sample in samples {
            let point = query.linear.of(*sample).plus(query.origin);
            let at = self.plane.project(point);
            let has_place = self.plane.has_place(at, point.z);
            count += bits_of(point.dot(point).is_below(f32x8::infinity())).count_ones();
            let texels = self.plane.texels_at(at, has_place);
            let of_texels = |image: &[f32]| f32x8::new(texels.map(|texel| image[texel as usize]));
            let nearness = at.z + at.z.abs() * f32x8::splat(SAME_DEPTH);
            let before_others = bits_of(of_texels(&self.texels.nearness).is_at_most(nearness));
            let before_own = thickness.map_or(0xff, |thickness| {
                let front = point.z - f32x8::splat(thickness);
                let shrunk = of_texels(&self.shrunk).is_at_most(self.plane.nearness(front));
                bits_of(front.is_below(f32x8::zero()) | shrunk)
            });
            let is_own = |texel: i32| self.texels.owners[texel as usize] == query.instance;
            let own = (0..LANES).fold(0, |own, lane| own | u32::from(is_own(texels[lane])) << lane);
            let is_visible = own & before_own | !own & before_others;
            visible += (is_visible & bits_of(has_place)).count_ones();
        }
        match count {
            0 => FULL_SHARE,
            _ => HIDDEN + (visible * u32::from(FULL_SHARE - HIDDEN)).div_ceil(count) as u8,
        }
    }
}
