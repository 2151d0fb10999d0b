//! Spheres of instances in columns, eight to an element, and spheres around 64 consecutive instances. The place of an
//! instance in the columns is its slot.

use std::collections::BTreeSet;

use fieldlod_hierarchy::Sphere;
use glam::Vec3;
use wide::f32x8;

use super::{InstanceId, MeshId};
use crate::criterion::error_bounds::sphere_around;
use crate::lanes::V3;
use crate::lanes::bits::{CHUNK, LANES};

/// Eight spheres in world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EightSpheres {
    pub(crate) center: [[f32; LANES]; 3],
    pub(crate) radius: [f32; LANES],
}

impl EightSpheres {
    /// Spheres of eight free slots, outside of every view.
    const NOTHING: Self = Self {
        center: [[0.0; LANES]; 3],
        radius: [NOTHING.radius; LANES],
    };

    fn set(&mut self, lane: usize, sphere: &Sphere) {
        for (axis, column) in self.center.iter_mut().enumerate() {
            column[lane] = sphere.center[axis];
        }
        self.radius[lane] = sphere.radius;
    }

    fn get(&self, lane: usize) -> Sphere {
        Sphere {
            center: Vec3::from(self.center.map(|column| column[lane])),
            radius: self.radius[lane],
        }
    }

    #[inline]
    pub(crate) fn center(&self) -> V3<f32x8> {
        let [x, y, z] = self.center.map(f32x8::new);
        V3 { x, y, z }
    }

    #[inline(always)]
    pub(crate) fn center_at(&self, lane: usize) -> V3<f32> {
        let [x, y, z] = &self.center;
        V3 {
            x: x[lane],
            y: y[lane],
            z: z[lane],
        }
    }

    #[inline]
    pub(crate) fn radius(&self) -> f32x8 {
        f32x8::new(self.radius)
    }
}

/// The sphere of a free slot.
const NOTHING: Sphere = Sphere {
    center: Vec3::ZERO,
    radius: f32::NEG_INFINITY,
};

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
    /// Radii of instances that may hide others; 0 for all other instances.
    pub(crate) occluder_radii: Vec<[f32; LANES]>,
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
            self.spheres.resize(elements, EightSpheres::NOTHING);
            self.occluder_radii.resize(elements, [0.0; LANES]);
            slot as u32
        })
    }

    /// Frees a slot.
    pub(crate) fn free(&mut self, slot: u32) {
        self.free.insert(slot);
        self.set(slot as usize, Occupant::NONE, &NOTHING, [0.0; 2], 0.0);
    }

    /// Sets a slot; its chunk is not up to date until the next [`Columns::refit`].
    pub(crate) fn set(
        &mut self,
        slot: usize,
        occupant: Occupant,
        sphere: &Sphere,
        error_scale: [f32; 2],
        occluder_radius: f32,
    ) {
        let (element, lane) = (slot / LANES, slot % LANES);
        self.occupants[slot] = occupant;
        self.error_scales[slot] = error_scale;
        self.spheres[element].set(lane, sphere);
        self.occluder_radii[element][lane] = occluder_radius;
        let chunk = (slot / CHUNK) as u32;
        if self.dirty.last() != Some(&chunk) {
            self.dirty.push(chunk);
        }
    }

    /// Updates the spheres around chunks.
    pub(crate) fn refit(&mut self) {
        let count = self.spheres.len().div_ceil(CHUNK / LANES);
        self.chunks
            .resize(count.div_ceil(LANES), EightSpheres::NOTHING);
        self.dirty.sort_unstable();
        self.dirty.dedup();
        for &chunk in &self.dirty {
            let chunk = chunk as usize;
            let first = chunk * (CHUNK / LANES);
            let members = self.spheres[first..].iter().take(CHUNK / LANES);
            let members = members.flat_map(|eight| (0..LANES).map(|lane| eight.get(lane)));
            let present = members.filter(|sphere| sphere.radius > f32::NEG_INFINITY);
            let around = sphere_around(present).unwrap_or(NOTHING);
            self.chunks[chunk / LANES].set(chunk % LANES, &around);
        }
        self.dirty.clear();
    }
}
