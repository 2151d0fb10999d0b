//! How much elements have to grow, so that each level covers as much of a picture as the source.
//!
//! Larger elements hide each other more, and stand out more where an aggregate ends: by how much depends
//! on how dense it is, and on what is behind it. So it is measured on each level, and set right on the
//! next.

use fieldlod_hierarchy::Sphere;
use glam::Vec3;

use crate::clusters::Cluster;
use crate::picture::{Model, Viewpoint};
use crate::vertices::LevelVertices;

/// Directions and pixels of the pictures.
const DIRECTIONS: usize = 6;
const SIDE: usize = 160;
/// The share of the source's area that levels aim at.
const AIM: f32 = 0.98;
/// Elements grow and shrink no more than this in a level, beyond what keeps their area.
const MOST_GAIN: f32 = 1.6;

/// What covers how much.
pub(crate) struct Coverage {
    of_source: f32,
    sphere: Sphere,
}

impl Coverage {
    /// Of the source, whose triangles are `corners`.
    pub(crate) fn of(corners: &[u32], vertices: &LevelVertices) -> Self {
        let source = vertices.positions.iter().take(vertices.source_count);
        let mut coverage = Self {
            of_source: 0.0,
            sphere: Sphere::around(source.copied().map(Vec3::from)),
        };
        // Room for what elements grow.
        coverage.sphere.radius *= 1.25;
        coverage.of_source = coverage.measure(corners.as_chunks().0, vertices);
        coverage
    }

    /// By how much elements should grow on the next level after this one.
    pub(crate) fn gain(&self, level: &[Cluster], vertices: &LevelVertices) -> f32 {
        let triangles = level.iter().flat_map(|c| c.corners.as_chunks::<3>().0);
        let triangles: Vec<[u32; 3]> = triangles.copied().collect();
        let share = AIM * self.of_source / self.measure(&triangles, vertices).max(1.0);
        // Elements are only some of what is seen.
        (share * share).clamp(MOST_GAIN.recip(), MOST_GAIN)
    }

    fn measure(&self, triangles: &[[u32; 3]], vertices: &LevelVertices) -> f32 {
        let positions: Vec<Vec3> = vertices.positions.iter().copied().map(Vec3::from).collect();
        let model = Model {
            positions: &positions,
            normals: &[],
            colors: &[],
            sphere: self.sphere,
            exposure: 1.0,
        };
        let views = (0..DIRECTIONS).map(|index| Viewpoint::around(index, DIRECTIONS));
        views
            .map(|view| model.draw(triangles, &view, SIDE).covered())
            .sum()
    }
}
