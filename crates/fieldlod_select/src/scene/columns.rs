//! Spheres of instances in columns, eight to an element, and spheres around 64 consecutive instances. The place of an
//! instance in the columns is its slot.

use std::collections::BTreeSet;

use fieldlod_hierarchy::Sphere;
use glam::Vec3;

use super::{InstanceId, MeshId, PlacedInstance};
use crate::criterion::error_bounds::sphere_around;
use crate::lanes::Eight;
use crate::lanes::bits::{CHUNK, LANES};

/// Centres and radii of eight spheres.
pub(crate) type EightSpheres = Eight<4>;

/// Centre and radius of one of eight spheres.
#[inline(always)]
pub(crate) fn sphere_at(spheres: &EightSpheres, lane: usize) -> (Vec3, f32) {
    let [x, y, z, radius] = spheres.at(lane);
    (Vec3::new(x, y, z), radius)
}

fn set_sphere(spheres: &mut [EightSpheres], index: usize, sphere: &Sphere) {
    let [x, y, z] = sphere.center.to_array();
    spheres[index / LANES].set(index % LANES, [x, y, z, sphere.radius]);
}

/// Eight spheres outside of every view.
const EIGHT_NOTHING: EightSpheres = Eight::splat([0.0, 0.0, 0.0, NOTHING.radius]);

/// The sphere of a free slot.
const NOTHING: Sphere = Sphere {
    center: Vec3::ZERO,
    radius: f32::NEG_INFINITY,
};

/// Truncates a list, and frees its memory if most of it is unused.
pub(crate) fn truncate<T>(list: &mut Vec<T>, count: usize) {
    list.truncate(count);
    if list.capacity() / 4 > count {
        list.shrink_to(count * 2);
    }
}

/// The instance in a slot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Occupant {
    pub(crate) id: InstanceId,
    pub(crate) mesh: MeshId,
    pub(crate) layers: u64,
}

impl Occupant {
    /// The occupant of a free slot. It is on no layer.
    const NONE: Self = Self {
        id: InstanceId::NONE,
        mesh: MeshId(0),
        layers: 0,
    };

    /// Whether the slot has an instance of a mesh.
    pub(crate) fn holds(&self, mesh: MeshId) -> bool {
        self.id != InstanceId::NONE && self.mesh == mesh
    }

    /// The mesh that a view of `layers` draws.
    #[inline]
    pub(crate) fn seen_mesh(&self, layers: u64) -> Option<MeshId> {
        (self.layers & layers != 0).then_some(self.mesh)
    }
}

/// The columns of a scene, by slot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Columns {
    pub(crate) occupants: Vec<Occupant>,
    pub(crate) spheres: Vec<EightSpheres>,
    /// The least and the largest factor of errors in the world, biases included.
    pub(crate) error_scales: Vec<[f32; 2]>,
    /// Spheres around 64 instances each.
    pub(crate) chunks: Vec<EightSpheres>,
    /// Chunks whose spheres are not up to date.
    pub(super) dirty: Vec<u32>,
    free: BTreeSet<u32>,
}

impl Columns {
    /// The lowest free slot, so that instances that are added together take the slots of instances that were removed
    /// together.
    pub(crate) fn free_slot(&mut self) -> u32 {
        self.free.pop_first().unwrap_or_else(|| {
            let slot = self.occupants.len();
            self.occupants.push(Occupant::NONE);
            self.error_scales.push([0.0; 2]);
            let elements = slot / LANES + 1;
            self.spheres.resize(elements, EIGHT_NOTHING);
            slot as u32
        })
    }

    /// All instances.
    pub(crate) fn placed(&self) -> impl Iterator<Item = PlacedInstance> {
        let occupied = self.occupants.iter().enumerate();
        let occupied = occupied.filter(|(_, occupant)| occupant.id != InstanceId::NONE);
        occupied.map(|(slot, occupant)| {
            let (center, radius) = sphere_at(&self.spheres[slot / LANES], slot % LANES);
            PlacedInstance {
                id: occupant.id,
                mesh: occupant.mesh,
                layers: occupant.layers,
                sphere: Sphere { center, radius },
            }
        })
    }

    /// Frees a slot.
    pub(crate) fn free(&mut self, slot: u32) {
        self.free.insert(slot);
        self.set(slot as usize, Occupant::NONE, &NOTHING, [0.0; 2]);
    }

    /// Drops the free slots behind the last instance, and their memory.
    pub(crate) fn shrink(&mut self) {
        let mut count = self.occupants.len();
        while count > 0 && self.free.remove(&(count as u32 - 1)) {
            count -= 1;
        }
        if count == self.occupants.len() {
            return;
        }
        let elements = count.div_ceil(LANES);
        truncate(&mut self.occupants, count);
        truncate(&mut self.error_scales, count);
        truncate(&mut self.spheres, elements);
        // Chunks that are partly dropped are dirty, because their slots were freed.
        self.dirty
            .retain(|&chunk| (chunk as usize) < elements.div_ceil(CHUNK / LANES));
        let chunks = elements.div_ceil(CHUNK / LANES);
        truncate(&mut self.chunks, chunks.div_ceil(LANES));
        for chunk in chunks..self.chunks.len() * LANES {
            set_sphere(&mut self.chunks, chunk, &NOTHING);
        }
    }

    /// Sets a slot; its chunk is not up to date until the next [`Columns::refit`].
    pub(crate) fn set(
        &mut self,
        slot: usize,
        occupant: Occupant,
        sphere: &Sphere,
        error_scale: [f32; 2],
    ) {
        self.occupants[slot] = occupant;
        self.error_scales[slot] = error_scale;
        set_sphere(&mut self.spheres, slot, sphere);
        let chunk = (slot / CHUNK) as u32;
        // Most consecutive changes are in one chunk; `refit` removes the other duplicates.
        if self.dirty.last() != Some(&chunk) {
            self.dirty.push(chunk);
        }
    }

    /// Updates the spheres around chunks.
    pub(crate) fn refit(&mut self) {
        let count = self.spheres.len().div_ceil(CHUNK / LANES);
        self.chunks.resize(count.div_ceil(LANES), EIGHT_NOTHING);
        self.dirty.sort_unstable();
        self.dirty.dedup();
        for &chunk in &self.dirty {
            let chunk = chunk as usize;
            let first = chunk * (CHUNK / LANES);
            let members = self.spheres[first..].iter().take(CHUNK / LANES);
            let members = members.flat_map(|eight| (0..LANES).map(|lane| sphere_at(eight, lane)));
            let present = members.filter(|(_, radius)| *radius > f32::NEG_INFINITY);
            let present = present.map(|(center, radius)| Sphere { center, radius });
            let around = sphere_around(present).unwrap_or(NOTHING);
            set_sphere(&mut self.chunks, chunk, &around);
        }
        self.dirty.clear();
    }
}
