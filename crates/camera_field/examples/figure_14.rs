//! Figure 14: splat kernels of large, off-centre disks: exact, the paper's and ours (§4.1.1).
//!
//! The paper reports no apparent difference between kernels. This figure also measures the difference as an area, by
//! the angle off the axis, for three orientations of a disk.
//!
//! `cargo run -p camera_field --example figure_14 -- paper-out`
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "drawing takes angles and allocates; selection does not run here"
)]

mod drawing;

use core::f64::consts::TAU;

use camera_field::double::{SplatKernel, Surfel};
use drawing::{
    Area, Color, Fallible, INK, OTHER, OURS, PAPER, RGBColor, curve, dot, draw, plane, polar,
    wide_camera,
};
use glam::{DVec2, dvec3};

/// Two kernels of a disk: with its whole keystone, and with the keystone of the curl alone.
struct Disk {
    kernel: SplatKernel,
    by_curl: SplatKernel,
}

/// Maps a point of the unit disk to the image.
type Map = fn(&Disk, DVec2) -> DVec2;

/// The projected disk, the paper's ellipse around the projected centre, and two kernels of second order.
const KERNELS: [(RGBColor, Map); 4] = [
    (INK, |disk, e| disk.kernel.map_exact(e)),
    (PAPER, |disk, e| disk.kernel.map_affine(e)),
    (OTHER, |disk, e| disk.by_curl.map_sheared(e)),
    (OURS, |disk, e| disk.kernel.map_sheared(e)),
];
/// Orientations of disks: perpendicular to the sight ray, or turned by 60° away from the axis or towards it.
const TURNS: [(&str, f64); 3] = [
    ("across the sight ray", 0.0),
    ("turned outwards", 60.0),
    ("turned inwards", -60.0),
];

fn main() -> Fallible {
    println!("symmetric difference to the exact kernel, % of its area");
    for (name, turn_deg) in TURNS {
        println!("{name}\n  off axis    the paper's    curl only    sheared");
        for degrees in (0..=80).step_by(10) {
            let shares = differences(f64::from(degrees), turn_deg);
            let [paper, curl, sheared] = shares.map(|share| share * 100.0);
            println!("{degrees:>6} deg{paper:>15.1}{curl:>13.1}{sheared:>11.1}");
        }
    }
    draw("figure_14.svg", (1200, 360), |whole| {
        let shown = [
            ("60 degrees off axis, across the sight ray", 60.0, 0.0),
            ("40 degrees off axis, turned inwards", 40.0, -60.0),
            ("on the axis, turned: the curl is zero", 0.0, 60.0),
        ];
        for (area, (title, off_axis, turn)) in whole.split_evenly((1, 3)).iter().zip(shown) {
            let disk = Disk::new(1000.0, &surfel(off_axis, turn, 0.3));
            draw_kernels(area, title, &disk)?;
        }
        Ok(())
    })
}

/// A disk at distance 1, turned from the sight ray in the plane of ray and axis. Positive turns face away
/// from the axis.
fn surfel(off_axis_deg: f64, turn_deg: f64, radius: f64) -> Surfel {
    let (phi, turn) = (off_axis_deg.to_radians(), turn_deg.to_radians());
    let center = polar(1.0, phi);
    let outwards = dvec3(phi.cos(), 0.0, -phi.sin());
    let normal = outwards * turn.sin() - center * turn.cos();
    Surfel {
        center,
        normal,
        radius,
    }
}

/// Symmetric differences of the other kernels to the exact kernel, relative to its area, for a disk with a
/// radius of 0.15 of its distance.
fn differences(off_axis_deg: f64, turn_deg: f64) -> [f64; 3] {
    let disk = Disk::new(1.0, &surfel(off_axis_deg, turn_deg, 0.15));
    let [_, paper, curl, sheared] = KERNELS.map(|(_, map)| disk.symmetric_difference(map));
    [paper, curl, sheared]
}

impl Disk {
    fn new(focal_px: f64, surfel: &Surfel) -> Self {
        let camera = wide_camera(focal_px);
        let kernel = SplatKernel::new(&camera, surfel);
        let keystone = surfel.keystone_from_curl(&camera);
        let by_curl = SplatKernel { keystone, ..kernel };
        Self { kernel, by_curl }
    }

    /// Area inside either a kernel or the exact kernel but not both, relative to the exact area. In polar
    /// coordinates of the affine part, areas are integrals of squared radii.
    fn symmetric_difference(&self, map: Map) -> f64 {
        const DIRECTIONS: u32 = 7200;
        let (mut difference, mut exact_area) = (0.0, 0.0);
        for step in 0..DIRECTIONS {
            let direction = DVec2::from_angle(TAU * f64::from(step) / f64::from(DIRECTIONS));
            // All kernels map a direction to a multiple of its affine image.
            let squared = |rim: DVec2| self.kernel.unmap_affine(rim).length_squared();
            let exact = squared(self.kernel.map_exact(direction));
            difference += (squared(map(self, direction)) - exact).abs();
            exact_area += exact;
        }
        difference / exact_area
    }
}

/// Draws the outlines of the kernels of a disk.
fn draw_kernels(area: &Area, title: &str, disk: &Disk) -> Fallible {
    let (middle_px, [a, b]) = disk.kernel.ellipse();
    let reach = a.abs().max(b.abs());
    let mut chart = plane(area, title, middle_px, 280.0 / (2.6 * reach.max_element()))?;
    for (color, map) in KERNELS {
        let angles = (0..=180).map(|step| TAU * f64::from(step) / 180.0);
        let outline = angles.map(|angle| map(disk, DVec2::from_angle(angle)));
        curve(&mut chart, outline, color.stroke_width(2))?;
    }
    dot(&mut chart, disk.kernel.center_px, 4, INK)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The curl alone is worse than the paper's kernel when a disk is turned outwards.
    #[test]
    fn sheared_kernel_is_nearest_to_the_exact_kernel() {
        for (name, turn_deg) in TURNS {
            for degrees in (0..=80).step_by(5) {
                let [paper, curl, sheared] = differences(f64::from(degrees), turn_deg);
                assert!(sheared <= paper.min(curl) + 1e-9, "{name} {degrees}");
            }
        }
        let [paper, _, sheared] = differences(60.0, 0.0);
        assert!((paper - 0.327).abs() < 1e-3, "{paper}");
        assert!((sheared - 0.069).abs() < 1e-3, "{sheared}");
        let [paper, curl, _] = differences(60.0, 60.0);
        assert!(curl > paper, "{curl} {paper}");
    }
}
