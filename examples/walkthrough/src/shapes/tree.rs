//! Trees: limbs and clumps of leaves as one signed distance function, its polygons closed.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::Shape;
use super::leaves::Foliage;
use super::sdf::{ellipsoid, limb, polygonise, smooth_union};
use crate::noise::{cells, fbm, gradient, lerp, random, smoothstep};

/// A part of the wood, thinning from `from` to `to`.
#[derive(Clone, Copy, Debug)]
struct Limb {
    from: Vec3,
    to: Vec3,
    radii: [f32; 2],
}

/// A lump of leaves.
#[derive(Clone, Copy, Debug)]
struct Clump {
    center: Vec3,
    radii: Vec3,
}

/// What a kind of leaves looks like.
#[derive(Clone, Copy, Debug)]
struct Leaves {
    /// Distance between neighbouring tufts, along each axis.
    tuft_in_m: Vec3,
    /// How far tufts stand out.
    depth_in_m: f32,
    /// Linear RGB in the gaps and at the tips.
    colors: [Vec3; 2],
    bark: Vec3,
    /// Length and width of a leaf, how much leaves point up, and their number.
    leaf_in_m: [f32; 2],
    rise: f32,
    count: usize,
}

/// A tree as its parts; its foot is at the origin.
#[derive(Clone, Debug)]
struct Tree {
    limbs: Vec<Limb>,
    clumps: Vec<Clump>,
    leaves: Leaves,
    seed: u32,
}

const OAK_LEAVES: Leaves = Leaves {
    tuft_in_m: Vec3::new(0.46, 0.38, 0.46),
    depth_in_m: 0.27,
    colors: [
        Vec3::new(0.020, 0.032, 0.010),
        Vec3::new(0.155, 0.19, 0.048),
    ],
    bark: Vec3::new(0.10, 0.075, 0.055),
    leaf_in_m: [0.30, 0.15],
    rise: 0.1,
    count: 5_000,
};

const PINE_LEAVES: Leaves = Leaves {
    tuft_in_m: Vec3::new(0.36, 0.30, 0.36),
    depth_in_m: 0.24,
    colors: [
        Vec3::new(0.010, 0.022, 0.009),
        Vec3::new(0.075, 0.135, 0.035),
    ],
    bark: Vec3::new(0.17, 0.095, 0.06),
    leaf_in_m: [0.30, 0.075],
    rise: 0.45,
    count: 5_500,
};

const CYPRESS_LEAVES: Leaves = Leaves {
    tuft_in_m: Vec3::new(0.22, 0.50, 0.22),
    depth_in_m: 0.15,
    colors: [
        Vec3::new(0.007, 0.014, 0.008),
        Vec3::new(0.045, 0.080, 0.030),
    ],
    bark: Vec3::new(0.11, 0.085, 0.065),
    leaf_in_m: [0.30, 0.075],
    rise: 0.8,
    count: 4_000,
};

/// A broad oak, about 7 m tall and as wide; each `variant` another one.
pub(crate) fn oak(variant: u32) -> Shape {
    let seed = 700 + 40 * variant;
    let fork = Vec3::new(0.15, 1.9, -0.1);
    let mut limbs = trunk(fork, [0.36, 0.27]);
    let mut clumps = vec![clump(Vec3::new(0.0, 5.4, 0.0), Vec3::new(1.6, 1.15, 1.6))];
    for i in 0..12 {
        let draw = |k: u32| random(i * 4 + k, seed);
        let low = i % 3 != 0;
        let angle = TAU * (i as f32 + 0.7 * draw(0)) / 12.0 * if low { 1.0 } else { 4.3 };
        let reach = if low {
            lerp(1.7, 2.45, draw(1))
        } else {
            lerp(0.7, 1.3, draw(1))
        };
        let height = if low {
            lerp(3.0, 4.4, draw(2))
        } else {
            lerp(4.9, 5.7, draw(2))
        };
        let center = upright(angle, reach, height);
        let size = lerp(0.85, 1.25, draw(3));
        clumps.push(clump(center, Vec3::new(size, 0.74 * size, size)));
        limbs.push(Limb {
            from: fork,
            to: center,
            radii: [0.17, 0.05],
        });
    }
    Tree {
        limbs,
        clumps,
        leaves: OAK_LEAVES,
        seed,
    }
    .grow(0.13)
}

/// An umbrella pine, about 9 m tall: a bare stem and a flat crown; each `variant` another one.
pub(crate) fn pine(variant: u32) -> Shape {
    let seed = 900 + 40 * variant;
    let fork = Vec3::new(0.35 - 0.5 * variant as f32, 4.9, 0.2);
    let mut limbs = trunk(fork, [0.30, 0.20]);
    let mut clumps = vec![clump(fork + Vec3::Y * 2.7, Vec3::new(1.7, 0.75, 1.7))];
    for i in 0..9 {
        let draw = |k: u32| random(i * 4 + k, seed);
        let angle = TAU * (i as f32 + 0.8 * draw(0)) / 9.0;
        let reach = lerp(1.5, 2.7, draw(1));
        let height = lerp(6.9, 7.6, draw(2)) - 0.2 * reach;
        let center = upright(angle, reach, height) + Vec3::new(fork.x, 0.0, fork.z);
        let size = lerp(0.95, 1.3, draw(3));
        clumps.push(clump(center, Vec3::new(size, 0.5 * size, size)));
        limbs.push(Limb {
            from: fork - Vec3::Y * 0.6 * draw(0),
            to: center,
            radii: [0.13, 0.04],
        });
    }
    Tree {
        limbs,
        clumps,
        leaves: PINE_LEAVES,
        seed,
    }
    .grow(0.115)
}

/// A cypress, about 9 m tall: a slender flame.
pub(crate) fn cypress() -> Shape {
    let limbs = trunk(Vec3::new(0.0, 1.5, 0.0), [0.17, 0.13]);
    let clumps = (0..9).map(|i| {
        let height = lerp(1.6, 7.9, i as f32 / 8.0);
        let wide = 0.72
            * (1.0 - 0.055 * (height - 3.3) * (height - 3.3))
                .max(0.12)
                .sqrt();
        let aside = Vec2::from_angle(i as f32 * 2.4) * 0.1;
        clump(
            Vec3::new(aside.x, height, aside.y),
            Vec3::new(wide, 1.15, wide),
        )
    });
    Tree {
        limbs,
        clumps: clumps.collect(),
        leaves: CYPRESS_LEAVES,
        seed: 1100,
    }
    .grow(0.078)
}

fn upright(angle: f32, reach: f32, height: f32) -> Vec3 {
    let (sin, cos) = angle.sin_cos();
    Vec3::new(cos * reach, height, sin * reach)
}

fn clump(center: Vec3, radii: Vec3) -> Clump {
    Clump { center, radii }
}

/// A stem up to `fork`, with roots that go into the ground.
fn trunk(fork: Vec3, [foot, top]: [f32; 2]) -> Vec<Limb> {
    let root = |i: u32| {
        let angle = TAU * (i as f32 + 0.4 * random(i, 31)) / 5.0;
        Limb {
            from: Vec3::Y * 0.45,
            to: upright(angle, 2.6 * foot, -0.5),
            radii: [0.6 * foot, 0.3 * foot],
        }
    };
    let stem = Limb {
        from: Vec3::Y * -0.9,
        to: fork,
        radii: [foot, top],
    };
    (0..5).map(root).chain([stem]).collect()
}

impl Tree {
    fn grow(&self, voxel_in_m: f32) -> Shape {
        let (mut min, mut max) = (Vec3::MAX, Vec3::MIN);
        for clump in &self.clumps {
            let reach = clump.radii + self.leaves.depth_in_m + 0.3;
            min = min.min(clump.center - reach);
            max = max.max(clump.center + reach);
        }
        for limb in &self.limbs {
            min = min.min(limb.from - 0.6).min(limb.to - 0.6);
            max = max.max(limb.from + 0.6).max(limb.to + 0.6);
        }
        // Steeper than a distance because of the tufts: the factor keeps blocks from being skipped.
        let distance = |p: Vec3| 0.6 * self.wood(p).min(self.crown(p));
        let (positions, indices) = polygonise(min, max, voxel_in_m, distance);
        let mut shape = Shape::smooth(positions, indices, |p, n| self.color(p, n));
        let Leaves {
            leaf_in_m: [length_in_m, width_in_m],
            rise,
            count,
            ..
        } = self.leaves;
        let foliage = Foliage {
            length_in_m,
            width_in_m,
            rise,
            seed: self.seed + 20,
        };
        foliage.sprout(&mut shape, count, |p| self.crown(p) < self.wood(p));
        shape
    }

    fn wood(&self, p: Vec3) -> f32 {
        let bent = p + 0.12
            * Vec3::new(
                gradient(p * 0.8, self.seed),
                0.0,
                gradient(p * 0.8, self.seed + 1),
            );
        let of = |part: &Limb| limb(bent, part.from, part.to, part.radii[0], part.radii[1]);
        let wood = self
            .limbs
            .iter()
            .map(of)
            .fold(f32::MAX, |a, b| smooth_union(a.min(1e3), b, 0.12));
        if wood.abs() > 0.5 {
            wood
        } else {
            wood + 0.025 * gradient(p * Vec3::new(9.0, 2.0, 9.0), self.seed)
        }
    }

    fn crown(&self, p: Vec3) -> f32 {
        let bare = self.bare_crown(p);
        if bare.abs() > 1.0 {
            return bare;
        }
        bare + 0.14 * fbm(p * 1.1, 2, self.seed + 9)
            - self.leaves.depth_in_m * (self.tuft(p) - 0.35)
    }

    fn bare_crown(&self, p: Vec3) -> f32 {
        let of = |clump: &Clump| ellipsoid(p, clump.center, clump.radii);
        self.clumps
            .iter()
            .map(of)
            .fold(f32::MAX, |a, b| smooth_union(a.min(1e3), b, 0.25))
    }

    /// 1 in the middle of a tuft, 0 in the gaps.
    fn tuft(&self, p: Vec3) -> f32 {
        let q = p / self.leaves.tuft_in_m;
        let distance = cells(q, self.seed + 3);
        let fine = cells(q * 2.3, self.seed + 4);
        1.0 - distance * distance - 0.35 * fine * fine
    }

    fn color(&self, p: Vec3, n: Vec3) -> Vec3 {
        let bark =
            self.leaves.bark * (1.0 + 0.5 * fbm(p * Vec3::new(12.0, 2.5, 12.0), 2, self.seed));
        let [gap, tip] = self.leaves.colors;
        let outward = smoothstep(-0.35, 0.25, self.bare_crown(p));
        let lit = smoothstep(0.0, 0.9, self.tuft(p)) * lerp(0.35, 1.0, outward);
        let sky = lerp(0.55, 1.0, 0.5 + 0.5 * n.y);
        let tint = 1.0 + 0.25 * fbm(p * 0.7, 2, self.seed + 6);
        let leaf = gap.lerp(tip * tint, lit * sky);
        if self.wood(p) < self.crown(p) {
            bark
        } else {
            leaf
        }
    }
}
