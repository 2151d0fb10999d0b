//! How much leaves and the like have to grow, so that each level covers as much of a picture as the source.
//!
//! Larger elements hide each other more, and stand out more where an aggregate ends: by how much depends
//! on how dense it is, and on what is behind it. So it is measured on each level, and set right on the
//! next. A level of one group is set right itself, too: then surfaces, such as the mass of a crown, swell for
//! the elements on them that are gone, but not out of the source's box.

use std::collections::BTreeMap;
use std::f32::consts::PI;

use fieldlod_hierarchy::{Aabb, Sphere};
use glam::Vec3;

use crate::clusters::Cluster;
use crate::components::{Component, components_of};
use crate::elements::MOST_MOVED_IF_OPEN;
use crate::picture::{Model, Viewpoint};
use crate::simplify::{Simplified, Task};
use crate::vertices::LevelVertices;

/// Directions and pixels of the pictures.
const DIRECTIONS: usize = 6;
const SIDE: usize = 160;
/// The share of the source's area that levels aim at.
const AIM: f32 = 0.98;
/// Elements grow and shrink no more than this in a level, beyond what keeps their area.
const MOST_GAIN: f32 = 1.6;
/// A level is set right by no more than this.
const MOST_SET_RIGHT: f32 = 2.5;
/// A level that covers what is aimed at but for this share is left as it is.
const NEAR: f32 = 0.003;
/// How much of a card with a texture is opaque: as a rule a leaf is cut out of it. Cards count as transparent by the
/// rest, so that those behind others count as well.
const OPACITY_OF_CARDS: f32 = 0.5;
/// How often a level is measured at most until it is right.
const ATTEMPTS: usize = 4;

/// What covers how much.
pub(crate) struct Coverage {
    of_source: f32,
    sphere: Sphere,
    /// The box that nothing grows out of.
    aabb: Aabb,
}

impl Coverage {
    /// Of the source, whose triangles are `corners`.
    pub(crate) fn of(corners: &[u32], vertices: &LevelVertices) -> Self {
        let source = vertices.positions.iter().take(vertices.source_count);
        let source = source.copied().map(Vec3::from);
        let mut coverage = Self {
            of_source: 0.0,
            sphere: Sphere::around(source.clone()),
            aabb: Aabb::around(source).unwrap_or_default(),
        };
        // Room for what elements grow.
        coverage.sphere.radius *= 1.25;
        coverage.of_source = coverage.measure(corners, &vertices.positions, vertices, |own| own);
        coverage
    }

    /// By how much elements should grow on the next level after this one.
    pub(crate) fn gain(&self, level: &[Cluster], vertices: &LevelVertices) -> f32 {
        let corners = level.iter().flat_map(|c| c.corners.iter().copied());
        let corners: Vec<u32> = corners.collect();
        let covered = self.measure(&corners, &vertices.positions, vertices, |own| own);
        let share = AIM * self.of_source / covered.max(1.0);
        // Elements are only some of what is seen.
        (share * share).clamp(MOST_GAIN.recip(), MOST_GAIN)
    }

    /// Grows what is left of a mesh until it covers what is aimed at, or shrinks its elements until it covers no
    /// more than the source.
    pub(crate) fn set_right(&self, task: &Task<'_>, simplified: &mut Simplified) {
        let before = simplified.positions.clone();
        let parts = components_of(
            &simplified.corners,
            &before,
            &task.same_position,
            &task.is_locked,
        );
        let mut gain = 1.0f32;
        for _ in 0..ATTEMPTS {
            let covered = self.measure(
                &simplified.corners,
                &simplified.positions,
                task.vertices,
                |own| task.piece.vertices[own as usize],
            );
            let share = covered / self.of_source.max(1.0);
            if (AIM - NEAR..=1.0 + NEAR).contains(&share) {
                break;
            }
            let wanted = share.clamp(AIM, 1.0) / share.max(f32::MIN_POSITIVE);
            gain = (gain * wanted).clamp(MOST_SET_RIGHT.recip(), MOST_SET_RIGHT);
            for part in &parts {
                let grown = task.grown(&before, part, gain);
                for (own, position) in grown {
                    let position = position.clamp(self.aabb.min, self.aabb.max);
                    simplified.positions[own as usize] = position.to_array();
                    simplified.is_new[own as usize] = true;
                }
            }
        }
    }

    /// Pixels that triangles cover; each of their vertices is or was one of `vertices`.
    fn measure(
        &self,
        corners: &[u32],
        positions: &[[f32; 3]],
        vertices: &LevelVertices,
        vertex_of: impl Fn(u32) -> u32,
    ) -> f32 {
        let positions: Vec<Vec3> = positions.iter().copied().map(Vec3::from).collect();
        let model = Model {
            positions: &positions,
            normals: &[],
            colors: &[],
            sphere: self.sphere,
            exposure: 1.0,
        };
        let has_uvs = vertices.layout.has_uvs();
        let is_open = |&own: &u32| vertices.is_border[vertex_of(own) as usize];
        let opacity = |triangle: &[u32; 3]| match has_uvs && triangle.iter().all(is_open) {
            true => OPACITY_OF_CARDS,
            false => 1.0,
        };
        let (triangles, _) = corners.as_chunks();
        let views = (0..DIRECTIONS).map(|index| Viewpoint::around(index, DIRECTIONS));
        views
            .map(|view| model.covered(triangles, &view, SIDE, opacity))
            .sum()
    }
}

impl Task<'_> {
    /// The vertices of a part that is to cover `gain` times as much as at the positions `before`, and where they
    /// go: elements around their middles, surfaces outwards if they grow.
    fn grown(&self, before: &[[f32; 3]], part: &Component, gain: f32) -> Vec<(u32, Vec3)> {
        let position = |own: u32| Vec3::from(before[own as usize]);
        let more = gain.sqrt() - 1.0;
        let vertices = part.vertices().into_iter();
        if part.triangles.len() <= MOST_MOVED_IF_OPEN {
            let offset = |own| (position(own) - part.centroid) * more;
            return vertices
                .map(|own| (own, position(own) + offset(own)))
                .collect();
        }
        if more <= 0.0 {
            return Vec::new();
        }
        // As far as a ball of that area grows.
        let out = (part.area / (4.0 * PI)).sqrt() * more;
        let first = |own: u32| self.same_position[own as usize];
        let mut normals: BTreeMap<u32, Vec3> = BTreeMap::new();
        for &[a, b, c] in &part.triangles {
            let cross = (position(b) - position(a)).cross(position(c) - position(a));
            for own in [a, b, c] {
                *normals.entry(first(own)).or_default() += cross;
            }
        }
        let is_border =
            |own: &u32| self.vertices.is_border[self.piece.vertices[*own as usize] as usize];
        let grown = vertices.filter(|own| !is_border(own));
        grown
            .map(|own| {
                (
                    own,
                    position(own) + normals[&first(own)].normalize_or_zero() * out,
                )
            })
            .collect()
    }
}
