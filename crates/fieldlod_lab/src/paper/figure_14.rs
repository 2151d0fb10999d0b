//! Figure 14: splat kernels of large, off-centre disks: exact, the paper's and ours (§4.1.1).
//!
//! The paper shows three kernels and calls the difference not apparent. Here it is an area, over
//! the angle off the axis, for three ways a disk can lie.

use core::f64::consts::TAU;
use std::path::Path;

use camera_field::double::Surfel;
use glam::{DVec2, dvec2, dvec3};
use serde::Serialize;

use super::disks::{Disk, KernelKind};
use super::profile::{polar, wide_camera};
use crate::canvas::{Align, Canvas, Color, Rect};
use crate::files::WriteError;
use crate::plot::{Axis, Plot, draw_legend};

/// The numbers of figure 14: symmetric difference to the exact kernel, relative to its area, for
/// disks with a radius of 0.15 of their distance.
#[derive(Clone, Debug, Serialize)]
pub struct Figure14 {
    /// Disks across the sight ray.
    pub across_sight_ray: Vec<DifferenceAtAngle>,
    /// Disks turned by 60° so that they face away from the axis.
    pub turned_outwards: Vec<DifferenceAtAngle>,
    /// Disks turned by 60° so that they face the axis.
    pub turned_inwards: Vec<DifferenceAtAngle>,
}

/// Symmetric differences at one angle off the axis.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DifferenceAtAngle {
    /// Angle off the axis, in degrees.
    pub off_axis_deg: f64,
    /// The paper's kernel: an ellipse around the projected centre.
    pub paper: f64,
    /// Second-order kernel with the keystone of the curl alone.
    pub curl_only: f64,
    /// Second-order kernel with the whole keystone.
    pub sheared: f64,
}

const RADIUS: f64 = 0.15;
const TURN_DEG: f64 = 60.0;
const WIDEST_DEG: u32 = 80;

const COMPARED: [(KernelKind, Color); 3] = [
    (KernelKind::Paper, Color::RED),
    (KernelKind::Curl, Color::ORANGE),
    (KernelKind::Sheared, Color::BLUE),
];

pub(super) fn draw(path: &Path) -> Result<Figure14, WriteError> {
    let numbers = Figure14 {
        across_sight_ray: differences(0.0),
        turned_outwards: differences(TURN_DEG),
        turned_inwards: differences(-TURN_DEG),
    };
    let mut canvas = Canvas::new(1320, 1120);
    draw_kernels(&mut canvas);
    draw_charts(&mut canvas, &numbers);
    canvas.save(path)?;
    Ok(numbers)
}

/// A disk at distance 1, turned from the sight ray within the plane of the axis. Positive turns
/// face away from the axis.
fn surfel(off_axis_deg: f64, turn_deg: f64, radius: f64) -> Surfel {
    let (phi, turn) = (off_axis_deg.to_radians(), turn_deg.to_radians());
    let center = polar(1.0, phi);
    // Across the sight ray within the plane of the axis, away from it.
    let outwards = dvec3(phi.cos(), 0.0, -phi.sin());
    let normal = outwards * turn.sin() - center * turn.cos();
    Surfel {
        center,
        normal,
        radius,
    }
}

fn differences(turn_deg: f64) -> Vec<DifferenceAtAngle> {
    (0..=WIDEST_DEG)
        .step_by(5)
        .map(|degrees| {
            let off_axis_deg = f64::from(degrees);
            let disk = Disk::new(&wide_camera(1.0), &surfel(off_axis_deg, turn_deg, RADIUS));
            DifferenceAtAngle {
                off_axis_deg,
                paper: disk.symmetric_difference(KernelKind::Paper),
                curl_only: disk.symmetric_difference(KernelKind::Curl),
                sheared: disk.symmetric_difference(KernelKind::Sheared),
            }
        })
        .collect()
}

/// Three large disks, a row each; the kernels side by side.
fn draw_kernels(canvas: &mut Canvas) {
    let columns = [
        "exact",
        "the paper's",
        "difference",
        "ours, sheared",
        "difference",
    ];
    for (column, name) in columns.into_iter().enumerate() {
        canvas.title(dvec2(270.0 + 230.0 * column as f64, 24.0), name);
    }
    let rows = [
        (60.0, 0.0, ["60 deg off axis,", "across the", "sight ray"]),
        (40.0, -TURN_DEG, ["40 deg off axis,", "turned inwards", ""]),
        (0.0, TURN_DEG, ["on the axis,", "turned: curl", "is zero"]),
    ];
    for (row, (off_axis, turn, labels)) in rows.into_iter().enumerate() {
        let top = 44.0 + 200.0 * row as f64;
        // What the row is.
        for (line, label) in labels.into_iter().enumerate() {
            let at = dvec2(10.0, top + 70.0 + 20.0 * line as f64);
            canvas.text(at, Align::Left, label, Color::INK);
        }
        let disk = Disk::new(&wide_camera(1000.0), &surfel(off_axis, turn, 0.3));
        // Its kernels, and how they differ from the exact one.
        let panel = |column: usize| Panel::new(&disk, column, top);
        panel(0).draw_kernel(canvas, KernelKind::Exact);
        panel(1).draw_kernel(canvas, KernelKind::Paper);
        panel(2).draw_difference(canvas, KernelKind::Paper);
        panel(3).draw_kernel(canvas, KernelKind::Sheared);
        panel(4).draw_difference(canvas, KernelKind::Sheared);
    }
    let text =
        "rings: equal distances on the disk; dot: its centre. green: exact only, red: kernel only";
    canvas.caption(dvec2(660.0, 660.0), text);
}

/// A square of the picture that shows a disk's kernels at one scale.
struct Panel<'a> {
    disk: &'a Disk,
    area: Rect,
    middle_px: DVec2,
    zoom: f64,
}

impl<'a> Panel<'a> {
    fn new(disk: &'a Disk, column: usize, top: f64) -> Self {
        let area = Rect::new(170.0 + 230.0 * column as f64, top, 200.0, 180.0);
        let (middle_px, [a, b]) = disk.kernel.ellipse();
        let reach = a.abs().max(b.abs());
        let zoom = (area.size / (2.6 * reach)).min_element();
        Self {
            disk,
            area,
            middle_px,
            zoom,
        }
    }

    fn place(&self, pixel: DVec2) -> DVec2 {
        self.area.center() + (pixel - self.middle_px) * self.zoom
    }

    fn draw_kernel(&self, canvas: &mut Canvas, kind: KernelKind) {
        // Rings on the disk, as the kernel maps them.
        let ring = |radius: f64| -> Vec<DVec2> {
            (0..180)
                .map(|step| DVec2::from_angle(f64::from(step) / 180.0 * TAU) * radius)
                .map(|e| self.place(self.disk.map(kind, e)))
                .collect()
        };
        canvas.clip_to(Some(self.area));
        canvas.polygon(&ring(1.0), Color::BLUE.faded(60));
        for radius in [1.0, 2.0 / 3.0, 1.0 / 3.0] {
            canvas.loop_line(&ring(radius), 1.5, Color::BLUE);
        }
        canvas.dot(self.place(self.disk.kernel.center_px), 3.5, Color::INK);
        canvas.clip_to(None);
        canvas.frame(self.area, Color::PALE);
    }

    fn draw_difference(&self, canvas: &mut Canvas, kind: KernelKind) {
        canvas.shade(self.area, |pixel| {
            let at = self.middle_px + (pixel - self.area.size * 0.5) / self.zoom;
            let exact = self.disk.covers(KernelKind::Exact, at);
            match (exact, self.disk.covers(kind, at)) {
                (true, true) => Color::PALE,
                (true, false) => Color::GREEN,
                (false, true) => Color::RED,
                (false, false) => Color::WHITE,
            }
        });
        canvas.frame(self.area, Color::PALE);
        // How much of the exact area differs, in the corner.
        let share = self.disk.symmetric_difference(kind) * 100.0;
        let at = self.area.max() - dvec2(6.0, 12.0);
        canvas.text(at, Align::Right, &format!("{share:.1} %"), Color::INK);
    }
}

fn draw_charts(canvas: &mut Canvas, numbers: &Figure14) {
    let text =
        "symmetric difference to the exact kernel, in % of its area; radius 0.15 of the distance";
    canvas.caption(dvec2(660.0, 710.0), text);
    let charts = [
        ("across the sight ray", &numbers.across_sight_ray),
        ("turned 60 deg outwards", &numbers.turned_outwards),
        ("turned 60 deg inwards", &numbers.turned_inwards),
    ];
    for (column, (name, values)) in charts.into_iter().enumerate() {
        let chart = Plot {
            area: Rect::new(80.0 + 420.0 * column as f64, 760.0, 340.0, 250.0),
            x: Axis::linear("degrees off the axis", 0.0..=80.0, 20.0, 0),
            y: Axis::linear(name, 0.0..=100.0, 20.0, 0),
        };
        chart.draw_frame(canvas);
        // A curve for each kernel.
        for (kind, color) in COMPARED {
            let share = |at: &DifferenceAtAngle| match kind {
                KernelKind::Paper => at.paper,
                KernelKind::Curl => at.curl_only,
                KernelKind::Sheared | KernelKind::Exact => at.sheared,
            };
            let points: Vec<DVec2> = values
                .iter()
                .map(|at| dvec2(at.off_axis_deg, share(at) * 100.0))
                .collect();
            chart.curve(canvas, &points, color);
        }
    }
    let names = ["the paper's", "ours, curl only", "ours, curl and distance"];
    for (index, (name, (_, color))) in names.into_iter().zip(COMPARED).enumerate() {
        draw_legend(
            canvas,
            dvec2(260.0 + 300.0 * index as f64, 1086.0),
            &[(name, color)],
        );
    }
}
