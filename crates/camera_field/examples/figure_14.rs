//! Figure 14: splat kernels of large, off-centre disks: exact, the paper's and ours (§4.1.1).
//!
//! The paper shows three kernels and calls the difference not apparent. This figure measures it as an area,
//! over the angle off the axis, for three ways in which a disk can lie.
//!
//! `cargo run -p camera_field --example figure_14 -- paper-out`
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "drawing takes angles and allocates; selection does not run here"
)]

mod drawing;

use core::f64::consts::TAU;
use std::path::Path;

use camera_field::double::{Intrinsics, SplatKernel, Surfel};
use drawing::{
    Area, Fallible, INK, OTHER, OURS, PAPER, Series, curve, dot, graph, out_folder, picture, plane,
    polar, save, wide_camera,
};
use glam::{DVec2, dvec2, dvec3};
use plotters::chart::SeriesLabelPosition;
use plotters::style::{Color, RGBColor};

/// Symmetric differences to the exact kernel, relative to its area, for a disk with a radius of 0.15 of its
/// distance.
#[derive(Clone, Copy, Debug)]
struct DifferenceAtAngle {
    off_axis_deg: f64,
    paper: f64,
    curl_only: f64,
    sheared: f64,
}

/// A kernel of a disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum KernelKind {
    /// The projected disk.
    Exact,
    /// The paper's ellipse around the projected centre.
    Paper,
    /// Second order, with the keystone of the curl alone.
    Curl,
    /// Second order, with the whole keystone.
    Sheared,
}

/// A disk's kernel, and the part of its keystone that the curl gives.
struct Disk {
    kernel: SplatKernel,
    curl_keystone: DVec2,
}

/// How disks lie: across the sight ray, or turned by 60° so that they face away from the axis or towards it.
const TURNS: [(&str, f64); 3] = [
    ("across the sight ray", 0.0),
    ("turned outwards", 60.0),
    ("turned inwards", -60.0),
];
const COMPARED: [(&str, KernelKind, RGBColor); 3] = [
    ("the paper's", KernelKind::Paper, PAPER),
    ("curl only", KernelKind::Curl, OTHER),
    ("sheared", KernelKind::Sheared, OURS),
];

fn main() -> Fallible {
    println!("symmetric difference to the exact kernel, % of its area");
    for ((name, _), angles) in TURNS.iter().zip(figure(&out_folder()?)?) {
        println!("{name}\n  off axis    the paper's    curl only    sheared");
        for at in angles.iter().step_by(2) {
            let [paper, curl, sheared] =
                [at.paper, at.curl_only, at.sheared].map(|share| share * 100.0);
            println!(
                "{:>6} deg{paper:>15.1}{curl:>13.1}{sheared:>11.1}",
                at.off_axis_deg
            );
        }
    }
    Ok(())
}

/// Draws `figure_14.svg` and returns the numbers for each of [`TURNS`].
fn figure(folder: &Path) -> Fallible<[Vec<DifferenceAtAngle>; 3]> {
    let numbers = TURNS.map(|(_, turn_deg)| differences(turn_deg));
    let path = folder.join("figure_14.svg");
    let whole = picture(&path, (1200, 720))?;
    let (above, below) = whole.split_vertically(360);
    let shown = [
        ("60 degrees off axis, across the sight ray", 60.0, 0.0),
        ("40 degrees off axis, turned inwards", 40.0, -60.0),
        ("on the axis, turned: the curl is zero", 0.0, 60.0),
    ];
    for (area, (title, off_axis, turn)) in above.split_evenly((1, 3)).iter().zip(shown) {
        draw_kernels(
            area,
            title,
            &Disk::new(&wide_camera(1000.0), &surfel(off_axis, turn, 0.3)),
        )?;
    }
    for ((area, (name, _)), angles) in below.split_evenly((1, 3)).iter().zip(TURNS).zip(&numbers) {
        let series = COMPARED.map(|(name, kind, color)| {
            let points = angles
                .iter()
                .map(|at| dvec2(at.off_axis_deg, 100.0 * at.of(kind)));
            Series {
                name,
                color,
                points: points.collect(),
            }
        });
        let (x, y) = (
            ("degrees off the axis", 0.0..80.0),
            ("% of the area", 0.0..100.0),
        );
        graph(area, name, x, y, &series, SeriesLabelPosition::UpperLeft)?;
    }
    save(&whole, &path)?;
    Ok(numbers)
}

/// A disk at distance 1, turned from the sight ray within the plane of the axis. Positive turns face away
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

fn differences(turn_deg: f64) -> Vec<DifferenceAtAngle> {
    let at = |degrees: u32| {
        let off_axis_deg = f64::from(degrees);
        let disk = Disk::new(&wide_camera(1.0), &surfel(off_axis_deg, turn_deg, 0.15));
        DifferenceAtAngle {
            off_axis_deg,
            paper: disk.symmetric_difference(KernelKind::Paper),
            curl_only: disk.symmetric_difference(KernelKind::Curl),
            sheared: disk.symmetric_difference(KernelKind::Sheared),
        }
    };
    (0..=80).step_by(5).map(at).collect()
}

impl DifferenceAtAngle {
    fn of(&self, kind: KernelKind) -> f64 {
        match kind {
            KernelKind::Exact => 0.0,
            KernelKind::Paper => self.paper,
            KernelKind::Curl => self.curl_only,
            KernelKind::Sheared => self.sheared,
        }
    }
}

impl Disk {
    fn new(camera: &Intrinsics, surfel: &Surfel) -> Self {
        Self {
            kernel: SplatKernel::new(camera, surfel),
            curl_keystone: surfel.keystone_from_curl(camera),
        }
    }

    /// Maps a point of the unit disk to the image.
    fn map(&self, kind: KernelKind, e: DVec2) -> DVec2 {
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

    /// Radius of a kernel's outline in a direction, in the coordinates of its affine part.
    fn radius(&self, kind: KernelKind, direction: DVec2) -> f64 {
        match kind {
            KernelKind::Exact => 1.0 / (1.0 + self.kernel.keystone.dot(direction)),
            KernelKind::Paper => 1.0,
            KernelKind::Curl => 1.0 - self.curl_keystone.dot(direction),
            KernelKind::Sheared => 1.0 - self.kernel.keystone.dot(direction),
        }
    }

    /// Area inside exactly one of a kernel and the exact one, relative to the exact area. In polar
    /// coordinates, areas are integrals of squared radii.
    fn symmetric_difference(&self, kind: KernelKind) -> f64 {
        const DIRECTIONS: u32 = 7200;
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

/// The outlines of a disk's kernels in pixels, the exact one in ink.
fn draw_kernels(area: &Area, title: &str, disk: &Disk) -> Fallible {
    let (middle_px, [a, b]) = disk.kernel.ellipse();
    let reach = a.abs().max(b.abs());
    let mut chart = plane(area, title, middle_px, 280.0 / (2.6 * reach.max_element()))?;
    let exact = [("exact", KernelKind::Exact, INK)];
    for (_, kind, color) in exact.into_iter().chain(COMPARED) {
        let angles = (0..=180).map(|step| TAU * f64::from(step) / 180.0);
        let outline = angles.map(|angle| disk.map(kind, DVec2::from_angle(angle)));
        curve(&mut chart, outline, color.stroke_width(2))?;
    }
    dot(&mut chart, disk.kernel.center_px, 4, INK)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At every angle and in every position. The curl alone is not nearer when a disk is turned outwards.
    #[test]
    fn sheared_kernel_is_nearest_to_the_exact_one() {
        let folder = tempfile::tempdir().unwrap();
        let numbers = figure(folder.path()).unwrap();
        let slack = 1e-9;
        for at in numbers.iter().flatten() {
            assert!(at.sheared <= at.paper.min(at.curl_only) + slack, "{at:?}");
        }
        let [across, outwards, _] = numbers.map(|angles| angles[12]);
        assert_eq!(across.off_axis_deg, 60.0);
        assert!((across.paper - 0.327).abs() < 1e-3, "{across:?}");
        assert!((across.sheared - 0.069).abs() < 1e-3, "{across:?}");
        assert!(outwards.curl_only > outwards.paper, "{outwards:?}");
        assert!(folder.path().join("figure_14.svg").exists());
    }

    /// The radii by direction are those of the kernels' own maps.
    #[test]
    fn radii_match_the_mapped_outlines() {
        let center = polar(1.0, 0.7);
        let normal = (-center + glam::DVec3::X).normalize();
        let disk = Disk::new(
            &wide_camera(900.0),
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
                let rim = disk.map(kind, DVec2::from_angle(f64::from(degrees).to_radians()));
                let at = disk.kernel.unmap_affine(rim);
                let expected = disk.radius(kind, at.normalize());
                assert!((at.length() - expected).abs() < 1e-9, "{kind:?} {degrees}");
            }
        }
    }
}
