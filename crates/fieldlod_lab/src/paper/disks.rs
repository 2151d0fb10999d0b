//! The kernels that figure 14 compares, as outlines around the projected centre of a disk.
//!
//! All are `A e` times a factor that depends on the direction of `e` (see `camera_field`'s splat
//! kernels), so in the coordinates of `A` each outline is a radius by direction.

use core::f64::consts::TAU;

use camera_field::double::{Intrinsics, SplatKernel, Surfel};
use glam::DVec2;

/// A kernel of a disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KernelKind {
    /// The projected disk.
    Exact,
    /// The paper's ellipse.
    Paper,
    /// Second order, with the keystone that the curl gives.
    Curl,
    /// Second order, with the whole keystone.
    Sheared,
}

/// A disk's kernel and the part of its keystone that comes from the curl.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disk {
    pub(super) kernel: SplatKernel,
    curl_keystone: DVec2,
}

impl Disk {
    pub(super) fn new(camera: &Intrinsics, surfel: &Surfel) -> Self {
        Self {
            kernel: SplatKernel::new(camera, surfel),
            curl_keystone: surfel.keystone_from_curl(camera),
        }
    }

    /// Maps a point of the unit disk to the image by a kernel.
    pub(super) fn map(&self, kind: KernelKind, e: DVec2) -> DVec2 {
        match kind {
            KernelKind::Exact => self.kernel.map_exact(e),
            KernelKind::Paper => self.kernel.map_affine(e),
            KernelKind::Sheared => self.kernel.map_sheared(e),
            KernelKind::Curl => {
                let keystone = self.curl_keystone;
                SplatKernel {
                    keystone,
                    ..self.kernel
                }
                .map_sheared(e)
            }
        }
    }

    /// Tells whether a pixel is inside a kernel.
    pub(super) fn covers(&self, kind: KernelKind, pixel: DVec2) -> bool {
        let e = self.kernel.unmap_affine(pixel);
        e.length() <= self.radius(kind, e.normalize_or_zero())
    }

    /// Radius of a kernel's outline in a direction, in the coordinates of `A`.
    fn radius(&self, kind: KernelKind, direction: DVec2) -> f64 {
        match kind {
            KernelKind::Exact => 1.0 / (1.0 + self.kernel.keystone.dot(direction)),
            KernelKind::Paper => 1.0,
            KernelKind::Curl => 1.0 - self.curl_keystone.dot(direction),
            KernelKind::Sheared => 1.0 - self.kernel.keystone.dot(direction),
        }
    }

    /// Area in exactly one of a kernel and the exact one, relative to the exact area.
    pub(super) fn symmetric_difference(&self, kind: KernelKind) -> f64 {
        const DIRECTIONS: u32 = 7200;
        // In polar coordinates, areas are integrals of squared radii.
        let (mut difference, mut exact_area) = (0.0, 0.0);
        for step in 0..DIRECTIONS {
            let direction = DVec2::from_angle(TAU * f64::from(step) / f64::from(DIRECTIONS));
            let exact = self.radius(KernelKind::Exact, direction).powi(2);
            difference += (self.radius(kind, direction).powi(2) - exact).abs();
            exact_area += exact;
        }
        difference / exact_area
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::profile::{polar, wide_camera};

    /// The areas by direction against counted pixels.
    #[test]
    fn symmetric_differences_match_counted_pixels() {
        let camera = wide_camera(900.0);
        let center = polar(1.0, 1.0);
        let surfel = Surfel {
            center,
            normal: -center.normalize(),
            radius: 0.15,
        };
        let disk = Disk::new(&camera, &surfel);
        let (middle, [a, b]) = disk.kernel.ellipse();
        let reach = (a.length() + b.length()) as i32 + 20;
        let pixels: Vec<DVec2> = (-reach..reach)
            .flat_map(|x| (-reach..reach).map(move |y| middle + DVec2::new(x.into(), y.into())))
            .collect();
        let exact = pixels
            .iter()
            .filter(|&&p| disk.covers(KernelKind::Exact, p))
            .count();
        for kind in [KernelKind::Paper, KernelKind::Curl, KernelKind::Sheared] {
            let differs = |p: DVec2| disk.covers(kind, p) != disk.covers(KernelKind::Exact, p);
            let counted = pixels.iter().filter(|&&p| differs(p)).count() as f64 / exact as f64;
            let computed = disk.symmetric_difference(kind);
            assert!(
                (counted - computed).abs() < 3e-3,
                "{kind:?}: {counted} {computed}"
            );
        }
    }

    /// The outlines are those of the kernels of `camera_field`.
    #[test]
    fn outlines_are_those_of_the_kernels() {
        let camera = wide_camera(900.0);
        let center = polar(1.0, 0.7);
        let normal = (-center + glam::DVec3::X).normalize();
        let disk = Disk::new(
            &camera,
            &Surfel {
                center,
                normal,
                radius: 0.2,
            },
        );
        for kind in [
            KernelKind::Exact,
            KernelKind::Paper,
            KernelKind::Curl,
            KernelKind::Sheared,
        ] {
            for degrees in 0..360 {
                let e = DVec2::from_angle(f64::from(degrees).to_radians());
                let rim = disk.map(kind, e);
                let radius = disk.kernel.unmap_affine(rim).length();
                assert!((radius - disk.radius(kind, e)).abs() < 1e-9);
            }
        }
    }
}
