//! Distances between a cut and the source surface on the screen, in pixels.
//!
//! Each sample of the source surface is paired with the nearest point of the cut. Each sample of the cut is paired
//! with the nearest point of the source. Only samples in the picture count. Unless surfaces are two-sided, only those
//! that face the eye count. Both points of a pair are projected, in `f64`:
//!
//! ```text
//! displacement = | project(p) − project(nearest(p)) |        pixels
//! ```
//! Samples are the corners, centers and edge midpoints of triangles. Occlusion is ignored, and nothing is rasterised.

mod samples;

use fieldlod_bake::TriangleTree;
use fieldlod_hierarchy::Hierarchy;
use glam::{DMat3, DVec3, Mat3, Vec3};
use serde::Serialize;

use crate::eye::{Eye, Instance};
use crate::measure::greatest;

use samples::{Sample, samples_of};

/// Displacements of a cut in one view, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Displacement {
    /// The largest displacement.
    pub max_px: f64,
    /// The number of samples in the picture.
    pub samples: usize,
}

impl Displacement {
    /// The statistics of the displacements of samples, in pixels.
    #[must_use]
    pub fn of(displaced_px: &[f64]) -> Self {
        Self {
            max_px: greatest(displaced_px.iter().copied()),
            samples: displaced_px.len(),
        }
    }
}

/// The surface that cuts are measured against.
#[derive(Debug)]
pub struct SourceSurface<'a> {
    hierarchy: &'a Hierarchy,
    surface: TriangleTree,
    samples: Vec<Sample>,
}

/// The surface of one cut.
#[derive(Debug)]
pub struct CutSurface {
    surface: TriangleTree,
    samples: Vec<Sample>,
    is_drawn: Vec<bool>,
}

impl<'a> SourceSurface<'a> {
    /// The source surface with about `sample_count` samples, but at most two per triangle.
    #[must_use]
    pub fn new(hierarchy: &'a Hierarchy, sample_count: usize) -> Self {
        let source: Vec<u32> = hierarchy.source_units().map(|unit| unit as u32).collect();
        Self {
            hierarchy,
            surface: surface_of(hierarchy, &source),
            samples: samples_of(hierarchy, &source, sample_count),
        }
    }

    /// The surface of the drawn `units`, with about as many samples as the source.
    #[must_use]
    pub fn cut(&self, units: &[u32]) -> CutSurface {
        let mut is_drawn = vec![false; self.hierarchy.units.len()];
        for &unit in units {
            is_drawn[unit as usize] = true;
        }
        // Source units have no displacement, so they need no samples.
        let is_coarse = |unit: &u32| self.hierarchy.units[*unit as usize].producer().is_some();
        let coarse: Vec<u32> = units.iter().copied().filter(is_coarse).collect();
        CutSurface {
            surface: surface_of(self.hierarchy, units),
            samples: samples_of(self.hierarchy, &coarse, self.samples.len()),
            is_drawn,
        }
    }

    /// The displacement of every sample of a cut in the picture, in pixels. `two_sided` includes surfaces that face away.
    #[must_use]
    pub fn displacements(
        &self,
        cut: &CutSurface,
        instance: &Instance,
        eye: &Eye,
        two_sided: bool,
    ) -> Vec<f64> {
        let projector = Projector::new(instance, eye, two_sided);
        let mut displaced_px = Vec::new();
        // From the source to the cut. Source units that are drawn have no displacement.
        for sample in projector.visible(&self.samples) {
            if cut.is_drawn[sample.unit as usize] {
                displaced_px.push(0.0);
            } else if let Some(nearest) = cut.surface.nearest_point(sample.position) {
                displaced_px.push(projector.distance_px(sample.position, nearest));
            }
        }
        // From the cut to the source.
        for sample in projector.visible(&cut.samples) {
            if let Some(nearest) = self.surface.nearest_point(sample.position) {
                displaced_px.push(projector.distance_px(sample.position, nearest));
            }
        }
        displaced_px
    }
}

fn surface_of(hierarchy: &Hierarchy, units: &[u32]) -> TriangleTree {
    let positions = &hierarchy.vertices.positions;
    let units = units.iter().map(|&unit| &hierarchy.units[unit as usize]);
    let triangles = units.flat_map(|unit| hierarchy.triangles_of(unit));
    TriangleTree::new(triangles.map(|t| t.map(|v| positions[v as usize])))
}

/// Projects local space to pixels, in double precision.
struct Projector<'a> {
    eye: &'a Eye,
    camera_from_local: DMat3,
    origin_in_camera: DVec3,
    /// -1 for mirrored instances, whose normals would point inwards.
    handedness: f64,
    two_sided: bool,
}

impl<'a> Projector<'a> {
    fn new(instance: &Instance, eye: &'a Eye, two_sided: bool) -> Self {
        let world_from_local = instance.world_from_local;
        let camera_from_world = eye.camera_from_world();
        let origin = Vec3::from(world_from_local.translation).as_dvec3();
        let camera_from_local = camera_from_world * Mat3::from(world_from_local.matrix3).as_dmat3();
        Self {
            eye,
            camera_from_local,
            origin_in_camera: camera_from_world * (origin - eye.position().as_dvec3()),
            handedness: camera_from_local.determinant().signum(),
            two_sided,
        }
    }

    fn in_camera(&self, position: Vec3) -> DVec3 {
        self.camera_from_local * position.as_dvec3() + self.origin_in_camera
    }

    fn visible<'s>(&'s self, samples: &'s [Sample]) -> impl Iterator<Item = &'s Sample> + 's {
        samples.iter().filter(|sample| self.is_visible(sample))
    }

    fn is_visible(&self, sample: &Sample) -> bool {
        // Culling and clipping remove surfaces outside the picture, so errors there are not visible.
        let position = self.in_camera(sample.position);
        let is_near = !self.eye.is_orthographic() && position.z < f64::from(self.eye.near);
        if is_near || !self.eye.camera.contains(position.as_vec3()) {
            return false;
        }
        // Back faces of closed meshes are hidden by their front faces.
        let edges = sample
            .edges
            .map(|edge| self.camera_from_local * edge.as_dvec3());
        let normal = edges[0].cross(edges[1]) * self.handedness;
        let to_surface = if self.eye.is_orthographic() {
            DVec3::Z
        } else {
            position
        };
        self.two_sided || normal.dot(to_surface) <= 0.0
    }

    /// Returns infinity if one of the points is not in front of a perspective camera.
    fn distance_px(&self, from: Vec3, to: Vec3) -> f64 {
        let project = |point: Vec3| self.eye.project_px(self.in_camera(point));
        match (project(from), project(to)) {
            (Some(from), Some(to)) => from.distance(to),
            _ => f64::INFINITY,
        }
    }
}
