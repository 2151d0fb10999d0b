//! Measures the area that levels of plants cover, and grows leaves to keep it.
//!
//! Larger leaves hide each other more, by an amount that depends on the density of the plant. The covered area is
//! therefore measured on pictures of each level, and the next level corrects it. A level of one group is corrected
//! directly. Surfaces, such as the mass of a crown, also grow to replace pruned leaves, but stay inside the source's
//! bounding box.
//!
//! Leaves with texture coordinates and an unknown texture count as half transparent.

use std::collections::BTreeMap;
use std::f32::consts::PI;

use fieldlod_hierarchy::{Aabb, Sphere};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::levels::simplify::{Method, Simplified, Task};
use crate::levels::vertices::{LevelVertices, Piece};
use crate::mesh::components::Component;
use crate::mesh::surface::Surface;
use crate::plants::elements::MAX_SMALL_ELEMENT;
use crate::plants::picture::{Model, Viewpoint};

/// Number and side length of the pictures that measure the covered area. With 6 directions, the area of a level of 100
/// leaves differs by 3 % from the area in other directions.
const COVERAGE_VIEWS: usize = 12;
const COVERAGE_SIDE_PX: usize = 112;
/// Maximum number of corrections of a level of one group. Sparse textures need them.
const MAX_ATTEMPTS: usize = 8;
/// Number and side length of the pictures that measure how many pixels of each vertex are visible. With few pixels, the
/// visibility of small leaves is random; the time grows with the pixels. With areas instead of pixels, cards have 12 %
/// more RMSE at equal triangles.
const VISIBILITY_VIEWS: usize = 24;
const VISIBILITY_SIDE_PX: usize = 256;
/// Levels aim to cover at least this share of the source's area, and at most all of it.
const TARGET_AREA: f32 = 0.98;
/// Limit for the total correction of a level: a level of few leaves may never cover the wanted area. At 1.8, five
/// plants have equal levels.
const MAX_CORRECTION: f32 = 2.5;
/// Corrections stop within this share of the wanted area. Half and twice this share make no difference to levels.
const AREA_TOLERANCE: f32 = 0.003;
/// Opacity of leaves with an unknown texture: usually a leaf is cut out of a quad. At 1, levels of leaves that cover
/// half of their quads cover as little as 0.71 of the source, instead of 0.79 to 0.91.
const OPACITY_OF_LEAVES: f32 = 0.5;
/// Limit for the change of the elements' gain in one correction. At 2.5, five plants have equal levels.
const MAX_GAIN_STEP: f32 = 1.6;

/// The area that the source covers in pictures.
pub(crate) struct Coverage {
    of_source: f32,
    sphere: Sphere,
    /// Bounding box of the source: corrected vertices stay inside.
    aabb: Aabb,
}

impl Coverage {
    /// Measures the source mesh with these `corners`.
    pub(crate) fn of(corners: &[u32], vertices: &LevelVertices) -> Self {
        let source = vertices.positions.iter().take(vertices.source_count);
        let source = source.copied().map(Vec3::from);
        let mut coverage = Self {
            of_source: 0.0,
            sphere: Sphere::around(source.clone()),
            aabb: Aabb::around(source).unwrap_or_default(),
        };
        // Leave room for elements that grow. Outside the picture they would not be counted.
        coverage.sphere.radius *= 1.25;
        let drawn = Drawn::of(corners.to_vec(), vertices);
        coverage.of_source = coverage.measure(&drawn, vertices);
        coverage
    }

    /// Measures a level, and returns the wanted area divided by the covered area.
    pub(crate) fn wanted_ratio(&self, level: &Drawn, vertices: &LevelVertices) -> f32 {
        self.wanted(self.measure(level, vertices))
    }

    /// The wanted area divided by the covered area.
    fn wanted(&self, covered: f32) -> f32 {
        // At least a pixel each: a level may cover none.
        let share = covered.max(1.0) / self.of_source.max(1.0);
        share.clamp(TARGET_AREA, 1.0) / share
    }

    /// Scales a simplified mesh until it covers the wanted area. Elements grow or shrink; surfaces only grow.
    pub(crate) fn correct_area(&self, task: &Task<'_>, simplified: &mut Simplified) {
        let before = simplified.positions.clone();
        let parts = task.components(&simplified.corners, &before);
        let mut gain = 1.0f32;
        let mut drawn = Drawn::default();
        drawn.push(&task.piece, simplified);
        for _ in 0..MAX_ATTEMPTS {
            drawn.positions.clone_from(&simplified.positions);
            let covered = self.measure(&drawn, task.vertices);
            let wanted = self.wanted(covered);
            if (wanted - 1.0).abs() <= AREA_TOLERANCE {
                break;
            }
            gain = (gain * wanted).clamp(MAX_CORRECTION.recip(), MAX_CORRECTION);
            // Scale the positions from before all corrections, so that rounding does not add up.
            for part in &parts {
                let scaled_vertices = task.scaled_vertices(&before, part, gain);
                for (own, position) in scaled_vertices {
                    let position = position.clamp(self.aabb.min, self.aabb.max);
                    simplified.positions[own as usize] = position.to_array();
                    simplified.is_new[own as usize] = true;
                }
            }
        }
    }

    /// Number of pixels in which each vertex of a level is visible, over all views. Each vertex gets a third of the
    /// pixels of its triangles.
    pub(crate) fn visible_px(&self, drawn: &Drawn, vertices: &LevelVertices) -> Vec<f32> {
        let (triangles, _) = drawn.corners.as_chunks();
        let by_view = self.with_model(drawn, vertices, |model, opacity| {
            let views = (0..VISIBILITY_VIEWS).into_par_iter();
            let visible_px = views.map(|index| {
                let view = Viewpoint::around(index, VISIBILITY_VIEWS);
                model.visible_px(triangles, &view, VISIBILITY_SIDE_PX, opacity)
            });
            visible_px.collect::<Vec<Vec<u32>>>()
        });
        let mut visible_px = vec![0.0f32; drawn.vertices.len()];
        for by_triangle in by_view {
            for (triangle, pixels) in triangles.iter().zip(by_triangle) {
                for &vertex in triangle {
                    visible_px[vertex as usize] += pixels as f32 / 3.0;
                }
            }
        }
        visible_px
    }

    /// Number of pixels that a level covers.
    fn measure(&self, drawn: &Drawn, vertices: &LevelVertices) -> f32 {
        let (triangles, _) = drawn.corners.as_chunks();
        self.with_model(drawn, vertices, |model, opacity| {
            let views = (0..COVERAGE_VIEWS).map(|index| Viewpoint::around(index, COVERAGE_VIEWS));
            views
                .map(|view| model.covered(triangles, &view, COVERAGE_SIDE_PX, opacity))
                .sum()
        })
    }

    /// Calls `look` with the model and the opacity of triangles whose surface is unknown.
    fn with_model<R>(
        &self,
        drawn: &Drawn,
        vertices: &LevelVertices,
        look: impl FnOnce(&Model<'_>, &(dyn Fn(&[u32; 3]) -> f32 + Sync)) -> R,
    ) -> R {
        let positions: Vec<Vec3> = drawn.positions.iter().copied().map(Vec3::from).collect();
        let (surfaces, uvs, alphas) = drawn.surfaces(vertices);
        let model = Model {
            positions: &positions,
            normals: &[],
            colors: &[],
            surfaces: &surfaces,
            uvs: &uvs,
            alphas: &alphas,
            sphere: self.sphere,
            exposure: 1.0,
        };
        let has_uvs = vertices.layout.has_uvs();
        let is_cut_out = |&own: &u32| {
            let vertex = drawn.vertices[own as usize];
            vertices.is_border[vertex as usize] && surface_of(vertex, vertices).is_none()
        };
        let opacity = |triangle: &[u32; 3]| {
            if has_uvs && triangle.iter().all(is_cut_out) {
                OPACITY_OF_LEAVES
            } else {
                1.0
            }
        };
        look(&model, &opacity)
    }
}

/// How the covered area of a level responds to the gain of its elements.
#[derive(Default)]
pub(crate) struct Response {
    /// The previous gain, and the wanted area divided by the area covered with that gain.
    last: Option<[f32; 2]>,
}

impl Response {
    /// Returns the factor for the next gain. The previous `gain` gave the ratio `wanted_ratio` of wanted to covered
    /// area.
    pub(crate) fn gain(&mut self, gain: f32, wanted_ratio: f32) -> f32 {
        // The covered area is modelled as a power of the gain. Two measurements give the power (secant method).
        let power = self.last.map_or(f32::NAN, |[last_gain, last_ratio]| {
            (gain / last_gain).ln() / (last_ratio / wanted_ratio).ln()
        });
        self.last = Some([gain, wanted_ratio]);
        // The first guess is quadratic, because elements are only a part of the covered area. Nearly equal ratios can
        // give any power, so it is limited.
        let power = if power.is_finite() {
            power.clamp(0.5, 5.0)
        } else {
            2.0
        };
        wanted_ratio
            .powf(power)
            .clamp(MAX_GAIN_STEP.recip(), MAX_GAIN_STEP)
    }
}

/// The surface of a vertex, if known.
fn surface_of(vertex: u32, vertices: &LevelVertices) -> Option<&Surface> {
    vertices
        .surfaces
        .of_vertex(vertices.origin[vertex as usize])
}

/// Triangles to draw, with their own vertices.
#[derive(Default)]
pub(crate) struct Drawn {
    /// Three own vertices for each triangle.
    corners: Vec<u32>,
    /// For each own vertex, its index in `LevelVertices`, or the index of the vertex that it was moved from.
    vertices: Vec<u32>,
    positions: Vec<[f32; 3]>,
    /// A row of attributes for each own vertex.
    rows: Vec<f32>,
}

impl Drawn {
    /// All vertices of `vertices`, with the triangles `corners`.
    pub(crate) fn of(corners: Vec<u32>, vertices: &LevelVertices) -> Self {
        Self {
            corners,
            vertices: (0..vertices.positions.len() as u32).collect(),
            positions: vertices.positions.clone(),
            rows: vertices.rows().to_vec(),
        }
    }

    /// Adds a simplified piece.
    pub(crate) fn push(&mut self, piece: &Piece, simplified: &Simplified) {
        self.add(piece, &simplified.corners);
        self.positions.extend(&simplified.positions);
        self.rows.extend(&simplified.rows);
    }

    /// Adds unsimplified triangles of `vertices`.
    pub(crate) fn push_unchanged<'a>(
        &mut self,
        corners: impl Iterator<Item = &'a u32>,
        vertices: &LevelVertices,
    ) {
        let piece = Piece::of(corners.copied(), vertices);
        self.add(&piece, &piece.corners);
        self.positions.extend(&piece.positions);
        let rows = piece.vertices.iter().flat_map(|&v| vertices.row(v));
        self.rows.extend(rows);
    }

    fn add(&mut self, piece: &Piece, corners: &[u32]) {
        let first = self.vertices.len() as u32;
        self.corners.extend(corners.iter().map(|own| first + own));
        self.vertices.extend(&piece.vertices);
    }

    /// The known surface of each vertex, the texture coordinates that it uses, and its alpha.
    fn surfaces<'a>(
        &self,
        vertices: &'a LevelVertices,
    ) -> (Vec<Option<&'a Surface>>, Vec<Vec2>, Vec<f32>) {
        if !vertices.has_known_opacity() {
            return Default::default();
        }
        let of_vertices = self
            .vertices
            .iter()
            .map(|&vertex| surface_of(vertex, vertices));
        let surfaces: Vec<Option<&Surface>> = of_vertices.collect();
        let rows = self.rows.chunks_exact(vertices.layout.width());
        let alphas = rows.clone().filter_map(|row| vertices.layout.alpha_of(row));
        let alphas = alphas.collect();
        let uvs = rows.zip(&surfaces).map(|(row, surface)| {
            let mapping = surface.and_then(Surface::mapping)?;
            vertices.layout.uv_of(row, mapping.uses_uvs_1)
        });
        let uvs = uvs.map(Option::unwrap_or_default).collect();
        (surfaces, uvs, alphas)
    }
}

impl Task<'_> {
    /// Returns new positions for the vertices of a part that shall cover `gain` times its area at `before`. Elements
    /// scale around their centroid; surfaces only grow outwards.
    fn scaled_vertices(
        &self,
        before: &[[f32; 3]],
        part: &Component,
        gain: f32,
    ) -> Vec<(u32, Vec3)> {
        let position = |own: u32| Vec3::from(before[own as usize]);
        // The area grows with the square of lengths.
        let more = gain.sqrt() - 1.0;
        let vertices = part.vertices().into_iter();
        if part.triangles.len() <= MAX_SMALL_ELEMENT {
            let offset = |own| (position(own) - part.centroid) * more;
            return vertices
                .map(|own| (own, position(own) + offset(own)))
                .collect();
        }
        // The body of a kit stays in place.
        if more <= 0.0 || self.loose == Method::Pieces {
            return Vec::new();
        }
        // A sphere of the same area grows by this length.
        let out = (part.area / (4.0 * PI)).sqrt() * more;
        let first = |own: u32| self.same_position[own as usize];
        let mut normals: BTreeMap<u32, Vec3> = BTreeMap::new();
        for &[a, b, c] in &part.triangles {
            let cross = (position(b) - position(a)).cross(position(c) - position(a));
            for own in [a, b, c] {
                *normals.entry(first(own)).or_default() += cross;
            }
        }
        // Vertices on borders of the source stay in place, as in simplification.
        let scaled_vertices = vertices.filter(|&own| !self.is_border(own));
        scaled_vertices
            .map(|own| {
                (
                    own,
                    position(own) + normals[&first(own)].normalize_or_zero() * out,
                )
            })
            .collect()
    }
}
