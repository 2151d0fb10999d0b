//! The levels: clusters are gathered in groups, each group is simplified, and what is left is split
//! into clusters again, until a dozen triangles are left.

use std::cell::OnceCell;

use rayon::prelude::*;

use crate::config::BakeConfig;
use crate::deviation::{Measured, Ruler};
use crate::levels::clusters::{
    Cluster, Place, clusters_of_source, partition, shared_positions, split_into_clusters,
    triangle_count,
};
use crate::levels::groups::Groups;
use crate::levels::simplify::{Means, Simplified, Task};
use crate::levels::vertices::{LevelVertices, NewVertex, Piece};
use crate::mesh::SourceMesh;
use crate::plants::aggregate::is_aggregate;
use crate::plants::appearance::MOST_VERTICES;
use crate::plants::coverage::{Coverage, Drawn};
use crate::report::{BakeReport, Fallback, FallbackKind};

/// Where simplification ends.
const FEWEST_TRIANGLES: usize = 12;
/// Most of a simplified surface that may have turned over, as a share of its area.
const MOST_TURNED: f32 = 0.003;
/// By how much groups grow where nothing gets on.
const GROWTH: usize = 4;
/// Elements grow and shrink no more than this at once, beyond what keeps their area.
const MOST_GAIN: f32 = 1.6;
/// How often a level is built again at most.
const MOST_BUILT_AGAIN: usize = 4;
/// A level that covers what it should but for this share is left as it is.
const HARDLY_LACKING: f32 = 0.01;
/// What is gone of an aggregate grows by no more than this from its second level on, as what is gone is what is seen of a
/// change of level; and each level keeps at least and at most such a share of the one before.
const MOST_MORE_GONE: f32 = 1.25;
const LEAST_KEPT: f32 = 0.6;
const MOST_KEPT: f32 = 0.74;
/// No more is kept than this share of what counts as stuck, as a level may end a little above what is wanted.
const ALL_BUT_STUCK: f32 = 0.9;
/// A level that keeps more than this share of the triangles hardly gets on.
const HARDLY: f32 = 0.98;

/// Clusters and simplifies `mesh` level by level, and measures how far each simplification strays from
/// it. Groups come finer before coarser; the last one is terminal and holds what is left.
///
/// `on_triangles` hears how many triangles each group consumed. The mesh must be valid: nothing is
/// checked on the other side.
pub(crate) fn build_levels(
    mesh: &SourceMesh,
    vertices: &mut LevelVertices,
    config: &BakeConfig,
    on_triangles: &dyn Fn(usize),
) -> (Groups, BakeReport) {
    let (mut pool, ruler) = rayon::join(
        || clusters_of_source(&mesh.indices, vertices, config),
        || Ruler::of(mesh, vertices),
    );
    let mut groups = Groups::default();
    let mut report = BakeReport::default();
    let mut group_clusters = config.group_clusters;
    let mut level = 0;
    let coverage = OnceCell::new();
    let mut area_gain = 1.0;
    let is_aggregate = mesh.positions.len() <= MOST_VERTICES as usize && is_aggregate(mesh);
    while triangle_count(&pool) > FEWEST_TRIANGLES {
        let before = triangle_count(&pool);
        // Simplify neighbouring clusters together, and nothing that two groups share.
        let parts = partition(pool, vertices, group_clusters);
        let is_whole = parts.len() == 1;
        let is_shared = shared_positions(&parts, vertices);
        if is_whole && level == 0 {
            coverage.get_or_init(|| Coverage::of(&mesh.indices, vertices));
        }
        let seen = is_aggregate.then(|| {
            let coverage = coverage.get_or_init(|| Coverage::of(&mesh.indices, vertices));
            let corners = parts.iter().flatten().flat_map(|cluster| &cluster.corners);
            coverage.seen(&Drawn::of(corners.copied().collect(), vertices), vertices)
        });
        let mut builder = Builder {
            vertices,
            config,
            ruler: &ruler,
            groups: &groups,
            is_shared: &is_shared,
            is_whole,
            level,
            area_gain,
            triangles: before,
            coverage: coverage.get().filter(|_| is_whole),
            has_aggregates: report.has_aggregates,
            ratio: match is_aggregate {
                true => ratio_of_aggregate(before as f32 / mesh.triangle_count() as f32, config),
                false => config.simplify_ratio,
            },
            seen: seen.as_deref(),
        };
        let mut built = builder.build_all(&parts);
        let has_aggregates = built.iter().flatten().any(Built::is_aggregate);
        // Where it is known what is seen of elements, a level of several groups is built again with what they lack.
        if has_aggregates && !is_whole && (is_aggregate || vertices.knows_what_is_cut_out()) {
            let coverage = coverage.get_or_init(|| Coverage::of(&mesh.indices, vertices));
            let mut response = Response::default();
            for _ in 0..MOST_BUILT_AGAIN {
                let lacking = coverage.lacking(&drawn_of(&parts, &built, vertices), vertices);
                if (lacking - 1.0).abs() <= HARDLY_LACKING {
                    break;
                }
                builder.area_gain *= response.gain(builder.area_gain, lacking);
                built = builder.build_all(&parts);
            }
        }
        report.has_aggregates |= has_aggregates;
        // In the order of the groups, so that the result is the same for any number of threads.
        pool = Vec::new();
        for (part, built) in parts.into_iter().zip(built) {
            match built {
                Some(built) => {
                    on_triangles(triangle_count(&part));
                    built.note(&part, groups.0.len() as u32, &mut report);
                    pool.extend(built.add(part, &mut groups, vertices));
                }
                // What is stuck waits for other neighbours.
                None => {
                    report.stuck_groups += 1;
                    pool.extend(part);
                }
            }
        }
        report.whole_mesh_levels += usize::from(is_whole);
        // Elements cover as much as they did.
        if has_aggregates {
            let coverage = coverage.get_or_init(|| Coverage::of(&mesh.indices, vertices));
            let corners = pool.iter().flat_map(|cluster| &cluster.corners);
            let drawn = Drawn::of(corners.copied().collect(), vertices);
            area_gain = Response::default().gain(1.0, coverage.lacking(&drawn, vertices));
        }
        level += 1;
        if triangle_count(&pool) as f32 > before as f32 * config.stuck_ratio {
            if is_whole {
                break;
            }
            // Where hardly anything gets on, it is tried with all at once.
            let gets_on = triangle_count(&pool) as f32 <= before as f32 * HARDLY;
            group_clusters = if gets_on {
                group_clusters * GROWTH
            } else {
                usize::MAX
            };
        }
    }
    report.coarsest_triangles = triangle_count(&pool);
    groups.add_terminal(pool);
    (groups, report)
}

/// The share of its triangles that is kept of a level of an aggregate which has the share `left` of the source's.
fn ratio_of_aggregate(left: f32, config: &BakeConfig) -> f32 {
    let gone = 1.0 - left;
    if gone <= 0.0 {
        return config.simplify_ratio;
    }
    // Closer together may be asked for, but not further apart.
    let wanted = config.simplify_ratio;
    let most = MOST_KEPT.min(config.stuck_ratio * ALL_BUT_STUCK);
    let most = most.max(wanted);
    let least = LEAST_KEPT.clamp(wanted, most);
    ((1.0 - MOST_MORE_GONE * gone) / left).clamp(least, most)
}

/// What levels cover by how much their elements grow, as far as it was tried.
#[derive(Default)]
struct Response {
    /// A gain, and what the level should cover relative to what it covers then.
    last: Option<[f32; 2]>,
}

impl Response {
    /// By how much a gain should grow after which a level should cover `lacking` times as much.
    fn gain(&mut self, gain: f32, lacking: f32) -> f32 {
        let power = self.last.map_or(f32::NAN, |[last_gain, last_lacking]| {
            (gain / last_gain).ln() / (last_lacking / lacking).ln()
        });
        self.last = Some([gain, lacking]);
        // At first as areas go with lengths, as elements are only some of what is seen.
        let power = if power.is_finite() {
            power.clamp(0.5, 5.0)
        } else {
            2.0
        };
        lacking.powf(power).clamp(MOST_GAIN.recip(), MOST_GAIN)
    }
}

/// What a level draws, of which some parts may be stuck.
fn drawn_of(parts: &[Vec<Cluster>], built: &[Option<Built>], vertices: &LevelVertices) -> Drawn {
    let mut drawn = Drawn::default();
    for (part, built) in parts.iter().zip(built) {
        match built {
            Some(built) => drawn.push(&built.piece, &built.simplified),
            None => drawn.push_unchanged(part.iter().flat_map(|c| &c.corners), vertices),
        }
    }
    drawn
}

/// Builds the groups of one level.
struct Builder<'a> {
    vertices: &'a LevelVertices,
    config: &'a BakeConfig,
    ruler: &'a Ruler,
    groups: &'a Groups,
    is_shared: &'a [bool],
    is_whole: bool,
    level: u32,
    /// By how much elements grow beyond what keeps their area.
    area_gain: f32,
    /// Of all groups of the level.
    triangles: usize,
    /// What the level should cover, if it is one group.
    coverage: Option<&'a Coverage>,
    /// Whether there were aggregates on finer levels.
    has_aggregates: bool,
    /// The share of the triangles that should be left.
    ratio: f32,
    /// In how many pixels each vertex is seen, if that is known.
    seen: Option<&'a [f32]>,
}

/// A group that was simplified.
struct Built {
    piece: Piece,
    same_position: Vec<u32>,
    simplified: Simplified,
    /// Triangle lists of own vertices, and the places of the source near each.
    clusters: Vec<(Vec<u32>, Vec<Place>)>,
    error_in_local: f32,
    deviation_in_local: f32,
}

impl Builder<'_> {
    fn build_all(&self, parts: &[Vec<Cluster>]) -> Vec<Option<Built>> {
        parts.par_iter().map(|part| self.build(part)).collect()
    }

    /// `None` for a group that is stuck.
    fn build(&self, part: &[Cluster]) -> Option<Built> {
        let vertices = self.vertices;
        let corners = part.iter().flat_map(|cluster| &cluster.corners);
        let piece = Piece::of(corners.copied(), vertices);
        let is_locked = piece.vertices.iter().map(|&vertex| {
            let first = vertices.same_position[vertex as usize];
            self.is_shared[first as usize]
        });
        // No less than the finer groups.
        let (mut finer_deviation, mut finer_error) = (0.0f32, 0.0f32);
        for group in self.groups.finer_of(part) {
            let in_scaled = group.deviation_in_local / vertices.local_from_scaled;
            finer_deviation = finer_deviation.max(in_scaled);
            finer_error = finer_error.max(group.error_in_local);
        }
        let task = Task {
            vertices,
            config: self.config,
            same_position: piece.same_position(vertices),
            is_locked: is_locked.collect(),
            seen: self.seen.map(|pixels| {
                let own = piece.vertices.iter();
                own.map(|&vertex| pixels[vertex as usize]).collect()
            }),
            piece,
            ratio: self.ratio,
            is_whole: self.is_whole,
            may_move: self.level >= self.config.first_moved_level,
            area_gain: self.area_gain,
        };
        // The best that does not turn over.
        let mut attempts = task.attempts();
        let (simplified, clusters, measured) = attempts.find_map(|mut simplified| {
            let is_plant = self.has_aggregates || simplified.means == Means::Aggregate;
            if let Some(coverage) = self.coverage.filter(|_| is_plant) {
                coverage.set_right(&task, &mut simplified);
            }
            let (positions, corners) = (&simplified.positions, &simplified.corners);
            let clusters = split_into_clusters(positions, corners, self.config);
            let measured = self.measure(part, &simplified, &clusters, finer_deviation);
            let reach = match self.config.measure_deviation {
                true => measured.deviation_in_scaled,
                false => simplified
                    .error_in_scaled
                    .max(finer_error / vertices.local_from_scaled),
            };
            let turned = self.ruler.turned_share(&simplified, reach);
            (turned <= MOST_TURNED).then_some((simplified, clusters, measured))
        })?;
        drop(attempts);
        let own = simplified
            .error_in_scaled
            .max(simplified.least_deviation_in_scaled);
        let own = (own * vertices.local_from_scaled).min(f32::MAX);
        let deviation = measured.deviation_in_scaled * vertices.local_from_scaled;
        Some(Built {
            piece: task.piece,
            same_position: task.same_position,
            simplified,
            clusters: clusters.into_iter().zip(measured.places).collect(),
            error_in_local: own.max(finer_error),
            deviation_in_local: match self.config.measure_deviation {
                true => deviation.min(f32::MAX),
                false => f32::INFINITY,
            },
        })
    }

    /// How far a simplification strays from the source, if that is wanted.
    fn measure(
        &self,
        part: &[Cluster],
        simplified: &Simplified,
        clusters: &[Vec<u32>],
        finer_deviation: f32,
    ) -> Measured {
        if !self.config.measure_deviation {
            return Measured {
                deviation_in_scaled: f32::INFINITY,
                places: vec![Vec::new(); clusters.len()],
            };
        }
        self.ruler.measure(
            part,
            self.vertices,
            self.triangles,
            simplified,
            clusters,
            finer_deviation,
        )
    }
}

impl Built {
    fn is_aggregate(&self) -> bool {
        self.simplified.means == Means::Aggregate
    }

    fn note(&self, part: &[Cluster], group: u32, report: &mut BakeReport) {
        let kind = match self.simplified.means {
            Means::Moved | Means::Kept if self.simplified.is_pruned => FallbackKind::Pruned,
            Means::Aggregate | Means::Moved | Means::Kept => return,
            Means::PositionsOnly => FallbackKind::AttributesIgnored,
            Means::Sloppy => FallbackKind::Sloppy,
        };
        report.fallbacks.push(Fallback {
            kind,
            group,
            from: triangle_count(part),
            to: self.simplified.corners.len() / 3,
        });
    }

    /// Adds the group that consumes `part`, and the vertices that it made; returns its clusters.
    fn add(
        self,
        part: Vec<Cluster>,
        groups: &mut Groups,
        vertices: &mut LevelVertices,
    ) -> impl Iterator<Item = Cluster> {
        let first_made = vertices.positions.len() as u32;
        let width = vertices.layout.width();
        const NONE: u32 = u32::MAX;
        let mut to_all = vec![NONE; self.piece.vertices.len()];
        // The first that was made at each new position, by the first own vertex there.
        let mut first_at = vec![NONE; self.piece.vertices.len()];
        for &own in self.clusters.iter().flat_map(|(corners, _)| corners) {
            let own = own as usize;
            if to_all[own] != NONE {
                continue;
            }
            let before = self.piece.vertices[own];
            if !self.simplified.is_new[own] {
                to_all[own] = before;
                continue;
            }
            let position = self.simplified.positions[own];
            let has_moved = position != self.piece.positions[own];
            let place = &mut first_at[self.same_position[own] as usize];
            let new = NewVertex {
                before,
                position,
                same_position: match (has_moved, *place) {
                    (false, _) => Some(vertices.same_position[before as usize]),
                    (true, NONE) => None,
                    (true, first) => Some(first),
                },
            };
            to_all[own] = vertices.push(&new, &self.simplified.rows[own * width..][..width]);
            if has_moved && *place == NONE {
                *place = to_all[own];
            }
        }
        let made = first_made..vertices.positions.len() as u32;
        let group = groups.add(part, self.error_in_local, self.deviation_in_local, made);
        self.clusters.into_iter().map(move |(corners, places)| {
            let corners = corners.iter().map(|&own| to_all[own as usize]);
            Cluster {
                produced_by: group,
                corners: corners.collect(),
                places,
            }
        })
    }
}
