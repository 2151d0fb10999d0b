//! The step of the bake for plants: each level keeps the area that leaves and other loose elements cover.
//!
//! Each level starts with its ratio of triangles, the visible pixels of its vertices and the gain of its elements. A
//! level of several groups is simplified again until it covers enough area.

use std::cell::OnceCell;

use crate::config::BakeConfig;
use crate::levels::clusters::{Cluster, triangle_count};
use crate::levels::simplified_group::SimplifiedGroup;
use crate::levels::simplify::{Method, Simplified, Task};
use crate::levels::vertices::LevelVertices;
use crate::mesh::SourceMesh;
use crate::plants::aggregate::is_aggregate;
use crate::plants::appearance::MAX_VERTICES;
use crate::plants::coverage::{Coverage, Drawn, Response};

/// Maximum number of times that a level is simplified again. Each time costs as much as the first.
const MAX_CORRECTIONS: usize = 4;
/// A level within this share of the wanted area is not corrected.
const AREA_TOLERANCE: f32 = 0.01;
/// From the second level on, the share of removed triangles grows at most by this factor per level: removed triangles
/// are visible when levels change. Each level keeps a share of the finer level between the bounds below.
const MAX_REMOVED_GROWTH: f32 = 1.25;
const MIN_KEPT: f32 = 0.6;
/// [`Hierarchy::whole_mesh_levels`](fieldlod_hierarchy::Hierarchy::whole_mesh_levels) skips levels that keep over 0.75.
const MAX_KEPT: f32 = 0.74;
/// Levels keep at most this share of `stuck_ratio`, because simplification may end slightly above its target.
const STUCK_MARGIN: f32 = 0.9;

/// Keeps the covered area of plants from level to level. Meshes without loose elements are unaffected.
pub(crate) struct Plant<'a> {
    mesh: &'a SourceMesh,
    /// Whether many triangles of the mesh belong to loose elements.
    is_plant: bool,
    /// Area that the source covers, measured on first use.
    coverage: OnceCell<Coverage>,
    /// Factor for the areas of the next level's simplified elements.
    area_gain: f32,
    /// Whether a group of a finer level has elements.
    has_elements: bool,
    level: u32,
}

/// Parameters for the simplification of one level.
pub(crate) struct PlantLevel<'a> {
    /// Share of the triangles to keep.
    pub(crate) ratio: f32,
    /// Factor for the areas of simplified elements. It corrects the covered area.
    pub(crate) area_gain: f32,
    /// Number of pixels in which each vertex is visible; only for plants.
    pub(crate) visible_px: Option<Vec<f32>>,
    /// Area to cover; only for a level of one group.
    coverage: Option<&'a Coverage>,
    has_elements: bool,
}

impl<'a> Plant<'a> {
    pub(crate) fn of(mesh: &'a SourceMesh, place: &[u32]) -> Self {
        let is_small = mesh.positions.len() <= MAX_VERTICES as usize;
        Self {
            mesh,
            is_plant: is_small && is_aggregate(mesh, place),
            coverage: OnceCell::new(),
            area_gain: 1.0,
            has_elements: false,
            level: 0,
        }
    }

    /// Whether a group of a finer level has loose elements.
    pub(crate) fn has_elements(&self) -> bool {
        self.has_elements
    }

    fn coverage(&self, vertices: &LevelVertices) -> &Coverage {
        let indices = &self.mesh.indices;
        self.coverage
            .get_or_init(|| Coverage::of(indices, vertices))
    }

    /// Parameters for the simplification of the groups `parts`.
    pub(crate) fn begin_level(
        &self,
        parts: &[Vec<Cluster>],
        vertices: &LevelVertices,
        config: &BakeConfig,
    ) -> PlantLevel<'_> {
        let is_whole = parts.len() == 1;
        if is_whole && self.level == 0 {
            self.coverage(vertices);
        }
        let visible_px = self.is_plant.then(|| {
            let corners = parts.iter().flatten().flat_map(|cluster| &cluster.corners);
            let drawn = Drawn::of(corners.copied().collect(), vertices);
            self.coverage(vertices).visible_px(&drawn, vertices)
        });
        let ratio = if self.is_plant {
            let triangles: usize = parts.iter().map(|part| triangle_count(part)).sum();
            let left = triangles as f32 / self.mesh.triangle_count() as f32;
            ratio_of_plant(left, config)
        } else {
            config.simplify_ratio
        };
        PlantLevel {
            ratio,
            area_gain: self.area_gain,
            visible_px,
            coverage: self.coverage.get().filter(|_| is_whole),
            has_elements: self.has_elements,
        }
    }

    /// Whether a level with elements can be corrected: it has several groups, and visible pixels or opacities are
    /// known.
    pub(crate) fn can_be_corrected(
        &self,
        parts: &[Vec<Cluster>],
        vertices: &LevelVertices,
    ) -> bool {
        parts.len() > 1 && (self.is_plant || vertices.has_known_opacity())
    }

    /// Simplifies a level again with other gains until it covers the wanted area. `simplify` takes the gain.
    pub(crate) fn corrected(
        &self,
        parts: &[Vec<Cluster>],
        mut simplified: Vec<Option<SimplifiedGroup>>,
        vertices: &LevelVertices,
        mut simplify: impl FnMut(f32) -> Vec<Option<SimplifiedGroup>>,
    ) -> Vec<Option<SimplifiedGroup>> {
        let coverage = self.coverage(vertices);
        let mut response = Response::default();
        let mut area_gain = self.area_gain;
        for _ in 0..MAX_CORRECTIONS {
            let drawn = drawn_of(parts, &simplified, vertices);
            let wanted_ratio = coverage.wanted_ratio(&drawn, vertices);
            if (wanted_ratio - 1.0).abs() <= AREA_TOLERANCE {
                break;
            }
            area_gain *= response.gain(area_gain, wanted_ratio);
            simplified = simplify(area_gain);
        }
        simplified
    }

    /// Measures the finished level, and sets the gain of the next level.
    pub(crate) fn end_level(
        &mut self,
        has_elements: bool,
        clusters: &[Cluster],
        vertices: &LevelVertices,
    ) {
        self.level += 1;
        self.has_elements |= has_elements;
        if has_elements {
            let corners = clusters.iter().flat_map(|cluster| &cluster.corners);
            let drawn = Drawn::of(corners.copied().collect(), vertices);
            let wanted_ratio = self.coverage(vertices).wanted_ratio(&drawn, vertices);
            self.area_gain = Response::default().gain(1.0, wanted_ratio);
        }
    }
}

impl PlantLevel<'_> {
    /// Corrects the covered area of a level of one group.
    pub(crate) fn fit_covered_area(&self, task: &Task<'_>, simplified: &mut Simplified) {
        let has_elements = self.has_elements || simplified.method == Method::Elements;
        if let Some(coverage) = self.coverage.filter(|_| has_elements) {
            coverage.correct_area(task, simplified);
        }
    }
}

/// Share of its triangles that a level of a plant keeps. `left` is the level's share of the source triangles.
fn ratio_of_plant(left: f32, config: &BakeConfig) -> f32 {
    let removed = 1.0 - left;
    if removed <= 0.0 {
        return config.simplify_ratio;
    }
    // A larger `simplify_ratio` gives more levels; a smaller ratio has no effect here.
    let wanted = config.simplify_ratio;
    let most = MAX_KEPT.min(config.stuck_ratio * STUCK_MARGIN);
    let most = most.max(wanted);
    let least = MIN_KEPT.clamp(wanted, most);
    ((1.0 - MAX_REMOVED_GROWTH * removed) / left).clamp(least, most)
}

/// The triangles of a level. Stuck groups are drawn unsimplified.
fn drawn_of(
    parts: &[Vec<Cluster>],
    simplified: &[Option<SimplifiedGroup>],
    vertices: &LevelVertices,
) -> Drawn {
    let mut drawn = Drawn::default();
    for (part, simplified) in parts.iter().zip(simplified) {
        match simplified {
            Some(group) => drawn.push(&group.piece, &group.simplified),
            None => drawn.push_unchanged(part.iter().flat_map(|c| &c.corners), vertices),
        }
    }
    drawn
}
