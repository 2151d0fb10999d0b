//! The step of the bake for plants: each level keeps the area that leaves and other loose elements cover.
//!
//! Each level starts with its ratio of triangles, the visible pixels of its vertices and the gain of its elements. A
//! level of several groups is simplified again until it covers enough area.

use std::sync::OnceLock;

use crate::config::BakeConfig;
use crate::levels::clusters::{Cluster, triangle_count};
use crate::levels::simplified_group::SimplifiedGroup;
use crate::levels::simplify::{Method, Simplified, Task};
use crate::levels::vertices::LevelVertices;
use crate::mesh::SourceMesh;
use crate::plants::aggregate::loose_elements;
use crate::plants::appearance::MAX_VERTICES;
use crate::plants::coverage::{Coverage, Drawn, Response};
use crate::plants::kits::LooseElements;

/// Maximum number of times that a level is simplified again. Each time costs as much as the first. At 0, levels of
/// cards cover 0.93 of the source's area, and those of large crowns 1.03.
const MAX_CORRECTIONS: usize = 4;
/// A level within this share of the wanted area is not corrected. Half and twice this share change errors at equal
/// triangles by 1 %.
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
    /// Whether they belong to pieces of a kit.
    is_kit: bool,
    /// Method for loose elements.
    loose: Method,
    /// Area that the source covers, measured on first use.
    coverage: OnceLock<Coverage>,
}

/// Parameters for the simplification of one level.
pub(crate) struct PlantLevel<'a> {
    plant: &'a Plant<'a>,
    /// Share of the triangles to keep.
    pub(crate) ratio: f32,
    /// Factor for the areas of simplified elements. It corrects the covered area.
    pub(crate) area_gain: f32,
    /// Number of pixels in which each vertex is visible; only for plants.
    pub(crate) visible_px: Option<Vec<f32>>,
    /// Method for loose elements.
    pub(crate) loose: Method,
    /// Whether a group of a finer level has elements.
    has_elements: bool,
    is_whole: bool,
    corrections: usize,
    response: Response,
}

impl<'a> Plant<'a> {
    pub(crate) fn of(mesh: &'a SourceMesh, place: &[u32]) -> Self {
        // Larger meshes are never drawn as whole meshes. Pictures of all their triangles would take most of the bake.
        let is_small = mesh.positions.len() <= MAX_VERTICES as usize;
        let elements = loose_elements(mesh, place);
        Self {
            mesh,
            is_plant: is_small && elements == Some(LooseElements::OfPlant),
            is_kit: is_small && elements == Some(LooseElements::OfKit),
            loose: if elements == Some(LooseElements::OfKit) {
                Method::Pieces
            } else {
                Method::Elements
            },
            coverage: OnceLock::new(),
        }
    }

    fn coverage(&self, vertices: &LevelVertices) -> &Coverage {
        let indices = &self.mesh.indices;
        self.coverage
            .get_or_init(|| Coverage::of(indices, vertices))
    }

    /// Parameters for the simplification of the groups `parts`. `has_elements` is true if a group of a finer level has
    /// loose elements. Their gain then corrects the area that the finer level covers.
    pub(crate) fn begin_level(
        &self,
        parts: &[Vec<Cluster>],
        vertices: &LevelVertices,
        config: &BakeConfig,
        has_elements: bool,
    ) -> PlantLevel<'_> {
        let mut level = PlantLevel {
            plant: self,
            ratio: config.simplify_ratio,
            area_gain: 1.0,
            visible_px: None,
            loose: self.loose,
            has_elements,
            is_whole: parts.len() == 1,
            corrections: 0,
            response: Response::default(),
        };
        let is_fine = self.is_plant || self.is_kit;
        if is_fine {
            let left: usize = parts.iter().map(|part| triangle_count(part)).sum();
            let left = left as f32 / self.mesh.triangle_count() as f32;
            level.ratio = finer_ratio(left, config);
        }
        if !has_elements && !self.is_plant {
            return level;
        }
        let corners = parts.iter().flatten().flat_map(|cluster| &cluster.corners);
        let drawn = Drawn::of(corners.copied().collect(), vertices);
        let coverage = self.coverage(vertices);
        if has_elements {
            let wanted_ratio = coverage.wanted_ratio(&drawn, vertices);
            level.area_gain = Response::default().gain(1.0, wanted_ratio);
        }
        if self.is_plant {
            level.visible_px = Some(coverage.visible_px(&drawn, vertices));
        }
        level
    }
}

impl PlantLevel<'_> {
    /// The gain with which a level of several groups is simplified again. `None` if it covers the wanted area or has no
    /// elements, or if neither visible pixels nor opacities are known.
    pub(crate) fn next_gain(
        &mut self,
        parts: &[Vec<Cluster>],
        simplified: &[Option<SimplifiedGroup>],
        vertices: &LevelVertices,
    ) -> Option<f32> {
        let mut groups = simplified.iter().flatten();
        let is_known = self.plant.is_plant || vertices.has_known_opacity();
        let is_done = self.is_whole || self.corrections == MAX_CORRECTIONS;
        if is_done || !is_known || !groups.any(SimplifiedGroup::has_elements) {
            return None;
        }
        // Levels that are never corrected need no picture.
        self.corrections += 1;
        let drawn = drawn_of(parts, simplified, vertices);
        let wanted_ratio = self.plant.coverage(vertices).wanted_ratio(&drawn, vertices);
        let is_off = (wanted_ratio - 1.0).abs() > AREA_TOLERANCE;
        is_off.then(|| self.area_gain * self.response.gain(self.area_gain, wanted_ratio))
    }

    /// Corrects the covered area of a level of one group.
    pub(crate) fn fit_covered_area(&self, task: &Task<'_>, simplified: &mut Simplified) {
        let has_elements = self.has_elements || simplified.method == self.loose;
        if self.is_whole && has_elements {
            let coverage = self.plant.coverage(task.vertices);
            coverage.correct_area(task, simplified);
        }
    }
}

/// Share of its triangles that a level of a plant or a kit keeps. `left` is the level's share of the source triangles.
fn finer_ratio(left: f32, config: &BakeConfig) -> f32 {
    let removed = 1.0 - left;
    // The first level removes the usual share: nothing can grow from zero.
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
