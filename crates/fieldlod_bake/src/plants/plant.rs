//! The step of the bake for plants: each level keeps the area that leaves and other loose elements cover.
//!
//! Before a level: how many triangles it keeps, which elements are seen, by how much elements grow. After the
//! simplification of a level with several groups: the level is simplified again until it covers enough.

use std::cell::OnceCell;

use crate::config::BakeConfig;
use crate::levels::clusters::{Cluster, triangle_count};
use crate::levels::simplified_group::SimplifiedGroup;
use crate::levels::simplify::{Method, Simplified, Task};
use crate::levels::vertices::LevelVertices;
use crate::mesh::SourceMesh;
use crate::plants::aggregate::is_aggregate;
use crate::plants::appearance::MOST_VERTICES;
use crate::plants::coverage::{Coverage, Drawn, Response};

/// How often a level is simplified again at most.
const MOST_CORRECTIONS: usize = 4;
/// A level within this share of the wanted area is not corrected.
const HARDLY_LACKING: f32 = 0.01;
/// From the second level on, the share of the triangles that is gone grows by no more than this factor per level: what
/// is gone is what shows when levels change. Each level keeps a share of the finer level between the bounds below.
const MOST_MORE_GONE: f32 = 1.25;
const LEAST_KEPT: f32 = 0.6;
const MOST_KEPT: f32 = 0.74;
/// Levels keep no more than this share of the ratio at which a level counts as stuck: simplification may end a little
/// above its target.
const ALL_BUT_STUCK: f32 = 0.9;

/// Keeps the covered area of plants from level to level. Meshes without loose elements are unaffected.
pub(crate) struct Plant<'a> {
    mesh: &'a SourceMesh,
    /// Whether many triangles of the mesh belong to loose elements.
    is_plant: bool,
    /// The area that the source covers; measured on first use.
    coverage: OnceCell<Coverage>,
    /// By how much elements of the next level grow beyond what keeps their area.
    area_gain: f32,
    /// Whether a group of a finer level has elements.
    has_elements: bool,
    level: u32,
}

/// Parameters for the simplification of one level.
pub(crate) struct PlantLevel<'a> {
    /// The share of the triangles to keep.
    pub(crate) ratio: f32,
    /// By how much elements grow beyond what keeps their area.
    pub(crate) area_gain: f32,
    /// In how many pixels each vertex is seen, for meshes that are plants.
    pub(crate) seen: Option<Vec<f32>>,
    /// The area to cover, for a level of one group.
    coverage: Option<&'a Coverage>,
    has_elements: bool,
}

impl<'a> Plant<'a> {
    pub(crate) fn of(mesh: &'a SourceMesh, place: &[u32]) -> Self {
        let is_small = mesh.positions.len() <= MOST_VERTICES as usize;
        Self {
            mesh,
            is_plant: is_small && is_aggregate(mesh, place),
            coverage: OnceCell::new(),
            area_gain: 1.0,
            has_elements: false,
            level: 0,
        }
    }

    /// Whether a group so far has loose elements.
    pub(crate) fn has_elements(&self) -> bool {
        self.has_elements
    }

    fn coverage(&self, vertices: &LevelVertices) -> &Coverage {
        let indices = &self.mesh.indices;
        self.coverage
            .get_or_init(|| Coverage::of(indices, vertices))
    }

    /// The parameters for the simplification of the groups `parts`.
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
        let seen = self.is_plant.then(|| {
            let corners = parts.iter().flatten().flat_map(|cluster| &cluster.corners);
            let drawn = Drawn::of(corners.copied().collect(), vertices);
            self.coverage(vertices).seen(&drawn, vertices)
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
            seen,
            coverage: self.coverage.get().filter(|_| is_whole),
            has_elements: self.has_elements,
        }
    }

    /// Whether a level with elements can be corrected: it has several groups, and what is seen of elements is known.
    pub(crate) fn can_be_corrected(
        &self,
        parts: &[Vec<Cluster>],
        vertices: &LevelVertices,
    ) -> bool {
        parts.len() > 1 && (self.is_plant || vertices.knows_what_is_cut_out())
    }

    /// Simplifies a level again with another gain of areas until it covers what it should. `simplify` takes the gain.
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
        for _ in 0..MOST_CORRECTIONS {
            let drawn = drawn_of(parts, &simplified, vertices);
            let lacking = coverage.lacking(&drawn, vertices);
            if (lacking - 1.0).abs() <= HARDLY_LACKING {
                break;
            }
            area_gain *= response.gain(area_gain, lacking);
            simplified = simplify(area_gain);
        }
        simplified
    }

    /// Measures the clusters that a level left, and sets the gain of the next level.
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
            let lacking = self.coverage(vertices).lacking(&drawn, vertices);
            self.area_gain = Response::default().gain(1.0, lacking);
        }
    }
}

impl PlantLevel<'_> {
    /// Lets a simplification of the whole plant cover what it should.
    pub(crate) fn fit_covered_area(&self, task: &Task<'_>, simplified: &mut Simplified) {
        let has_elements = self.has_elements || simplified.method == Method::Elements;
        if let Some(coverage) = self.coverage.filter(|_| has_elements) {
            coverage.set_right(task, simplified);
        }
    }
}

/// The share of its triangles that a level of a plant keeps, if the level has the share `left` of the source's.
fn ratio_of_plant(left: f32, config: &BakeConfig) -> f32 {
    let gone = 1.0 - left;
    if gone <= 0.0 {
        return config.simplify_ratio;
    }
    // The configuration may ask for levels closer together, but not farther apart.
    let wanted = config.simplify_ratio;
    let most = MOST_KEPT.min(config.stuck_ratio * ALL_BUT_STUCK);
    let most = most.max(wanted);
    let least = LEAST_KEPT.clamp(wanted, most);
    ((1.0 - MOST_MORE_GONE * gone) / left).clamp(least, most)
}

/// The triangles of a level, of which some groups may be stuck.
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
