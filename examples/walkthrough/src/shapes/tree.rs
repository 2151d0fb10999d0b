//! Trees: a closed mesh of a signed distance function of limbs and clumps, with leaves on it.

use std::f32::consts::TAU;

use bevy::prelude::*;

use super::Shape;
use super::leaves::Foliage;
use super::sdf::{ellipsoid, limb, polygonise, smooth_union};
use crate::noise::{cells, fbm, gradient, random, smoothstep};

/// A part of the trunk or of a bough, from `from` to `to`, with its radii at both ends.
#[derive(Clone, Copy, Debug)]
struct Limb {
    from: Vec3,
    to: Vec3,
    radii: [f32; 2],
}

/// An ellipsoidal part of the crown.
#[derive(Clone, Copy, Debug)]
struct Clump {
    center: Vec3,
    radii: Vec3,
}

/// The look of a species.
#[derive(Clone, Copy, Debug)]
struct Species {
    /// Distance between neighbouring tufts, along each axis.
    tuft_in_m: Vec3,
    /// Depth of the gaps between tufts.
    depth_in_m: f32,
    /// Linear RGB of the leaves in the gaps, of the leaves at the tips, and of the bark.
    gap: Vec3,
    tip: Vec3,
    bark: Vec3,
    /// The look of the leaves, and their number.
    foliage: Foliage,
    leaves: usize,
    /// Side of the voxels that sample the surface.
    voxel_in_m: f32,
}

/// The parts of a tree. Its foot is at the origin.
#[derive(Clone, Debug)]
struct Tree {
    limbs: Vec<Limb>,
    clumps: Vec<Clump>,
    species: Species,
    seed: u32,
}

const OAK: Species = Species {
    tuft_in_m: Vec3::new(0.46, 0.38, 0.46),
    depth_in_m: 0.27,
    gap: Vec3::new(0.020, 0.032, 0.010),
    tip: Vec3::new(0.155, 0.19, 0.048),
    bark: Vec3::new(0.10, 0.075, 0.055),
    foliage: Foliage::new(0.30, 0.15, 0.1),
    leaves: 5_000,
    voxel_in_m: 0.13,
};

const PINE: Species = Species {
    tuft_in_m: Vec3::new(0.36, 0.30, 0.36),
    depth_in_m: 0.24,
    gap: Vec3::new(0.010, 0.022, 0.009),
    tip: Vec3::new(0.075, 0.135, 0.035),
    bark: Vec3::new(0.17, 0.095, 0.06),
    foliage: Foliage::new(0.30, 0.075, 0.45),
    leaves: 5_500,
    voxel_in_m: 0.115,
};

const CYPRESS: Species = Species {
    tuft_in_m: Vec3::new(0.22, 0.50, 0.22),
    depth_in_m: 0.15,
    gap: Vec3::new(0.007, 0.014, 0.008),
    tip: Vec3::new(0.045, 0.080, 0.030),
    bark: Vec3::new(0.11, 0.085, 0.065),
    foliage: Foliage::new(0.30, 0.075, 0.8),
    leaves: 4_000,
    voxel_in_m: 0.078,
};

/// An oak, about 7 m tall and 7 m wide. Each `variant` differs.
pub(crate) fn oak(variant: u32) -> Shape {
    let seed = 700 + 40 * variant;
    let fork = Vec3::new(0.15, 1.9, -0.1);
    let mut tree = Tree::new(OAK, seed, fork, [0.36, 0.27]);
    tree.add_clump(Vec3::Y * 5.4, Vec3::new(1.6, 1.15, 1.6));
    for i in 0..12 {
        let draw = |k: u32| random(i * 4 + k, seed);
        // One bough in three grows upwards, the others grow outwards.
        let (turns, radius, height) = match i % 3 {
            0 => (4.3, [0.7, 1.3], [4.9, 5.7]),
            _ => (1.0, [1.7, 2.45], [3.0, 4.4]),
        };
        let angle = TAU * (i as f32 + 0.7 * draw(0)) / 12.0 * turns;
        let radius = f32::lerp(radius[0], radius[1], draw(1));
        let height = f32::lerp(height[0], height[1], draw(2));
        let center = around_axis(angle, radius, height);
        let size = f32::lerp(0.85, 1.25, draw(3));
        tree.add_clump(center, Vec3::new(size, 0.74 * size, size));
        tree.add_limb(fork, center, [0.17, 0.05]);
    }
    tree.grow()
}

/// An umbrella pine, about 9 m tall, with a bare stem and a flat crown. Each `variant` differs.
pub(crate) fn pine(variant: u32) -> Shape {
    let seed = 900 + 40 * variant;
    let fork = Vec3::new(0.35 - 0.5 * variant as f32, 4.9, 0.2);
    let mut tree = Tree::new(PINE, seed, fork, [0.30, 0.20]);
    tree.add_clump(fork + Vec3::Y * 2.7, Vec3::new(1.7, 0.75, 1.7));
    for i in 0..9 {
        let draw = |k: u32| random(i * 4 + k, seed);
        let angle = TAU * (i as f32 + 0.8 * draw(0)) / 9.0;
        let radius = f32::lerp(1.5, 2.7, draw(1));
        let height = f32::lerp(6.9, 7.6, draw(2)) - 0.2 * radius;
        let center = around_axis(angle, radius, height) + fork.with_y(0.0);
        let size = f32::lerp(0.95, 1.3, draw(3));
        tree.add_clump(center, Vec3::new(size, 0.5 * size, size));
        tree.add_limb(fork - Vec3::Y * 0.6 * draw(0), center, [0.13, 0.04]);
    }
    tree.grow()
}

/// A cypress, about 9 m tall, slender and pointed.
pub(crate) fn cypress() -> Shape {
    let mut tree = Tree::new(CYPRESS, 1100, Vec3::Y * 1.5, [0.17, 0.13]);
    for i in 0..9 {
        let height = f32::lerp(1.6, 7.9, i as f32 / 8.0);
        let from_widest = height - 3.3;
        let taper = 1.0 - 0.055 * from_widest * from_widest;
        let wide = 0.72 * taper.max(0.12).sqrt();
        let aside = Vec2::from_angle(i as f32 * 2.4) * 0.1;
        let center = Vec3::new(aside.x, height, aside.y);
        tree.add_clump(center, Vec3::new(wide, 1.15, wide));
    }
    tree.grow()
}

/// A point at an angle around the Y axis.
fn around_axis(angle_in_rad: f32, radius: f32, height: f32) -> Vec3 {
    let (sin, cos) = angle_in_rad.sin_cos();
    Vec3::new(cos * radius, height, sin * radius)
}

impl Tree {
    /// A stem from the ground to `fork`, with its radii at both ends, and with roots in the ground.
    fn new(mut species: Species, seed: u32, fork: Vec3, radii: [f32; 2]) -> Self {
        species.foliage.seed = seed + 20;
        let mut tree = Self {
            limbs: Vec::new(),
            clumps: Vec::new(),
            species,
            seed,
        };
        let foot = radii[0];
        for i in 0..5 {
            let angle = TAU * (i as f32 + 0.4 * random(i, 31)) / 5.0;
            let tip = around_axis(angle, 2.6 * foot, -0.5);
            tree.add_limb(Vec3::Y * 0.45, tip, [0.6 * foot, 0.3 * foot]);
        }
        tree.add_limb(Vec3::Y * -0.9, fork, radii);
        tree
    }

    fn add_limb(&mut self, from: Vec3, to: Vec3, radii: [f32; 2]) {
        self.limbs.push(Limb { from, to, radii });
    }

    fn add_clump(&mut self, center: Vec3, radii: Vec3) {
        self.clumps.push(Clump { center, radii });
    }

    /// Makes the mesh of wood and crown, and leaves on the crown.
    fn grow(&self) -> Shape {
        let species = &self.species;
        let (mut min, mut max) = (Vec3::MAX, Vec3::MIN);
        for clump in &self.clumps {
            let half = clump.radii + species.depth_in_m + 0.3;
            min = min.min(clump.center - half);
            max = max.max(clump.center + half);
        }
        for limb in &self.limbs {
            min = min.min(limb.from - 0.6).min(limb.to - 0.6);
            max = max.max(limb.from + 0.6).max(limb.to + 0.6);
        }

        // Tufts make the function steeper than a distance. Without the factor, blocks with a surface would be skipped.
        let distance = |p: Vec3| 0.6 * self.wood(p).min(self.crown(p));
        let (positions, indices) = polygonise(min, max, species.voxel_in_m, distance);
        let mut shape = Shape::smooth(positions, indices, |p, n| self.color(p, n));
        let is_crown = |p| self.crown(p) < self.wood(p);
        species.foliage.sprout(&mut shape, species.leaves, is_crown);
        shape
    }

    /// Distance from trunk and boughs.
    fn wood(&self, p: Vec3) -> f32 {
        let sway = |seed: u32| gradient(p * 0.8, seed);
        let bent = p + 0.12 * Vec3::new(sway(self.seed), 0.0, sway(self.seed + 1));
        let of = |part: &Limb| limb(bent, part.from, part.to, part.radii[0], part.radii[1]);
        let wood = union_of(self.limbs.iter().map(of), 0.12);
        // Bark matters only near the surface; skipping it elsewhere saves time.
        if wood.abs() > 0.5 {
            wood
        } else {
            wood + 0.025 * gradient(p * Vec3::new(9.0, 2.0, 9.0), self.seed)
        }
    }

    /// Distance from the crown with its tufts.
    fn crown(&self, p: Vec3) -> f32 {
        let bare = self.bare_crown(p);
        // Tufts move the surface by less than 1 m; skipping them elsewhere saves time.
        if bare.abs() > 1.0 {
            return bare;
        }
        bare + 0.14 * fbm(p * 1.1, 2, self.seed + 9)
            - self.species.depth_in_m * (self.tuft(p) - 0.35)
    }

    /// Distance from the crown without its tufts.
    fn bare_crown(&self, p: Vec3) -> f32 {
        let of = |clump: &Clump| ellipsoid(p, clump.center, clump.radii);
        union_of(self.clumps.iter().map(of), 0.25)
    }

    /// Position of a point in a tuft: 1 in its middle, 0 in the gaps.
    fn tuft(&self, p: Vec3) -> f32 {
        // Small tufts roughen large ones.
        let q = p / self.species.tuft_in_m;
        let distance = cells(q, self.seed + 3);
        let fine = cells(q * 2.3, self.seed + 4);
        1.0 - distance * distance - 0.35 * fine * fine
    }

    fn color(&self, p: Vec3, n: Vec3) -> Vec3 {
        let species = &self.species;
        if self.wood(p) < self.crown(p) {
            let grooves = fbm(p * Vec3::new(12.0, 2.5, 12.0), 2, self.seed);
            return species.bark * (1.0 + 0.5 * grooves);
        }
        // Leaves are dark in the gaps, inside the crown and on its underside.
        let outward = smoothstep(-0.35, 0.25, self.bare_crown(p));
        let lit = smoothstep(0.0, 0.9, self.tuft(p)) * f32::lerp(0.35, 1.0, outward);
        let sky = f32::lerp(0.55, 1.0, 0.5 + 0.5 * n.y);
        let tint = 1.0 + 0.25 * fbm(p * 0.7, 2, self.seed + 6);
        species.gap.lerp(species.tip * tint, lit * sky)
    }
}

/// Distance from the union of several surfaces, blended.
fn union_of(distances: impl Iterator<Item = f32>, blend_in_m: f32) -> f32 {
    distances.fold(f32::MAX, |a, b| smooth_union(a.min(1e3), b, blend_in_m))
}
