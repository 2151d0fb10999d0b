//! Leaves that a texture cuts out of cards become opaque triangles.
//!
//! Renderers test the alpha once per pixel, at its centre. Under multisampling, a card that covers only a corner of the
//! pixel is tested outside of it, and a far crown loses most of its leaves. A triangle whose corners all have the texture
//! coordinates of an opaque texel passes every test. It covers the area of the card's opaque part, and a card has two.
//!
//! 16 trees of the bench `truth` (8 at 24 px), levels at 1 px: triangles a tree, and error from the truth relative to
//! full detail. Cards have a flattening cost of 0.7, with which none is flattened. Both columns allow plants a difference of
//! 1.875 at 16 px and a spread of 2 pixels.
//!
//! | radius | cards | opaque triangles |
//! |---|---|---|
//! | 3 px | 39, 1.08 | 29, 0.81 |
//! | 6 px | 219, 0.78 | 130, 0.60 |
//! | 12 px | 1,581, 1.15 | 868, 0.89 |
//! | 24 px | 7,183, 1.00 | 3,300, 0.80 |

use std::ops::{Add, Mul};

use glam::{Vec2, Vec3};

use crate::levels::simplify::{Method, Simplified, Task};
use crate::mesh::components::Component;
use crate::mesh::surface::Surface;

/// Cards of more triangles keep their shape: they may be whole branches or fronds.
const MAX_TRIANGLES: usize = 4;
/// Samples along an edge of a triangle, and all its samples.
const SIDE: usize = 16;
const SAMPLES: usize = SIDE * (SIDE + 1) / 2;

/// The opaque part of a card.
pub(crate) struct OpaquePart {
    pub(crate) area: f32,
    pub(crate) centroid: Vec3,
    /// Attributes of an opaque point.
    pub(crate) row: Vec<f32>,
}

impl Task<'_> {
    /// Whether an element is a leaf of a plant that a texture cuts out of a card.
    pub(crate) fn is_leaf_cut_out(&self, element: &Component) -> bool {
        self.loose == Method::Elements
            && element.triangles.len() <= MAX_TRIANGLES
            && self.surface_of(element).is_some_and(Surface::is_cut_out)
    }

    fn surface_of(&self, element: &Component) -> Option<&Surface> {
        let vertex = self.piece.vertices[element.triangles[0][0] as usize];
        let origin = self.vertices.origin[vertex as usize];
        self.vertices.surfaces.of_vertex(origin)
    }

    /// Gives vertices the texture coordinates of a row.
    pub(crate) fn set_uvs(&self, simplified: &mut Simplified, vertices: [u32; 3], row: &[f32]) {
        let layout = &self.vertices.layout;
        let width = layout.width();
        for own in vertices.map(|own| own as usize) {
            layout.copy_uvs(&mut simplified.rows[own * width..][..width], row);
        }
    }

    /// The opaque part of a leaf; `None` if it is no cut-out, or no sample is opaque.
    pub(crate) fn opaque_part(
        &self,
        simplified: &Simplified,
        element: &Component,
    ) -> Option<OpaquePart> {
        let is_leaf = self.is_leaf_cut_out(element);
        let surface = self.surface_of(element).filter(|_| is_leaf)?;
        let triangles = element.triangles.iter();
        let samples = triangles.flat_map(|corners| self.samples_of(simplified, corners, surface));
        let samples: Vec<Sample> = samples.collect();
        let area: f32 = samples.iter().map(|sample| sample.area).sum();
        let mean = |value: fn(&Sample) -> Vec3| {
            let values = samples.iter().map(|sample| value(sample) * sample.area);
            values.sum::<Vec3>() / area
        };
        let color = mean(|sample| sample.color);
        // Far from transparent texels, which filters would mix in, and of the usual colour.
        let fitness = |sample: &Sample| sample.opacity - sample.color.distance(color);
        let by_fitness = |a: &&Sample, b: &&Sample| fitness(a).total_cmp(&fitness(b));
        let best = samples.iter().max_by(by_fitness)?;
        let width = self.vertices.layout.width();
        let rows = best
            .corners
            .map(|own| &simplified.rows[own as usize * width..][..width]);
        let row = (0..width).map(|k| mixed(rows.map(|row| row[k]), best.shares));
        Some(OpaquePart {
            area,
            centroid: mean(|sample| sample.at),
            row: row.collect(),
        })
    }

    /// Opaque samples of a triangle.
    fn samples_of(
        &self,
        simplified: &Simplified,
        corners: &[u32; 3],
        surface: &Surface,
    ) -> Vec<Sample> {
        let layout = &self.vertices.layout;
        let second = surface.mapping().is_some_and(|mapping| mapping.uses_uvs_1);
        let [a, b, c] = corners.map(|own| Vec3::from(simplified.positions[own as usize]));
        let uvs = corners.map(|own| {
            let row = &simplified.rows[own as usize * layout.width()..];
            layout.uv_of(row, second).unwrap_or_default()
        });
        let sample = |shares: Vec3| {
            let uv = mixed(uvs, shares);
            Some(Sample {
                at: mixed([a, b, c], shares),
                area: 0.5 * (b - a).cross(c - a).length() / SAMPLES as f32,
                color: surface.drawn_at(uv)?,
                opacity: surface.opacity_around(uv),
                corners: *corners,
                shares,
            })
        };
        samples().filter_map(sample).collect()
    }
}

/// An opaque point of a card.
struct Sample {
    at: Vec3,
    /// The part of the triangle's area that it stands for.
    area: f32,
    color: Vec3,
    /// Opacity of its surroundings.
    opacity: f32,
    /// The triangle, and the weights of its corners.
    corners: [u32; 3],
    shares: Vec3,
}

/// Weights of the corners at each sample of a triangle.
fn samples() -> impl Iterator<Item = Vec3> {
    let along = |across: usize| (0..SIDE - across).map(move |along| (across, along));
    (0..SIDE).flat_map(along).map(|(across, along)| {
        let at = (Vec2::new(across as f32, along as f32) + 1.0 / 3.0) / SIDE as f32;
        at.extend(1.0 - at.x - at.y)
    })
}

/// The weighted mean of the corners.
fn mixed<V: Mul<f32, Output = V> + Add<Output = V>>([a, b, c]: [V; 3], shares: Vec3) -> V {
    a * shares.x + b * shares.y + c * shares.z
}
