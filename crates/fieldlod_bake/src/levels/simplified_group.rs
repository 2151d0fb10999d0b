//! A simplified group, and how it is added to the groups and vertices of all levels.

use crate::levels::clusters::{Cluster, Sample, triangle_count};
use crate::levels::groups::Groups;
use crate::levels::simplify::{Method, Simplified};
use crate::levels::vertices::{LevelVertices, NewVertex, Piece};
use crate::report::{BakeReport, Fallback, FallbackKind};

const NONE: u32 = u32::MAX;

/// A simplified group.
pub(crate) struct SimplifiedGroup {
    pub(crate) piece: Piece,
    /// For each own vertex, the first own vertex at the same position.
    pub(crate) same_position: Vec<u32>,
    pub(crate) simplified: Simplified,
    /// Triangle lists of own vertices, with their samples on the source.
    pub(crate) clusters: Vec<(Vec<u32>, Vec<Sample>)>,
    pub(crate) error_in_local: f32,
    pub(crate) deviation_in_local: f32,
}

/// Adds the simplified groups of a level to `groups`, and their new vertices to `vertices`. Returns the clusters of the
/// next level. A group that could not be simplified is retried there with other neighbours.
pub(crate) fn emit(
    parts: Vec<Vec<Cluster>>,
    simplified: Vec<Option<SimplifiedGroup>>,
    groups: &mut Groups,
    vertices: &mut LevelVertices,
    report: &mut BakeReport,
) -> Vec<Cluster> {
    let mut next = Vec::new();
    for (part, simplified) in parts.into_iter().zip(simplified) {
        if let Some(simplified) = simplified {
            report.has_aggregates |= simplified.has_elements();
            let fallback = simplified.fallback(&part, groups.0.len() as u32);
            report.fallbacks.extend(fallback);
            next.extend(simplified.emit(part, groups, vertices));
        } else {
            report.stuck_groups += 1;
            next.extend(part);
        }
    }
    next
}

impl SimplifiedGroup {
    /// Whether loose elements such as leaves were simplified.
    pub(crate) fn has_elements(&self) -> bool {
        self.simplified.method == Method::Elements
    }

    /// The fallback that was used, if any.
    fn fallback(&self, part: &[Cluster], group: u32) -> Option<Fallback> {
        let kind = match self.simplified.method {
            Method::Moved | Method::Kept if self.simplified.is_pruned => FallbackKind::Pruned,
            Method::Elements | Method::Pieces | Method::Moved | Method::Kept => return None,
            Method::Torn => FallbackKind::TexturesTorn,
            Method::Sloppy => FallbackKind::Sloppy,
        };
        Some(Fallback {
            kind,
            group,
            from: triangle_count(part),
            to: self.simplified.corners.len() / 3,
        })
    }

    /// Adds the group that consumes `part`, and its new vertices. Returns the new clusters.
    fn emit(
        self,
        part: Vec<Cluster>,
        groups: &mut Groups,
        vertices: &mut LevelVertices,
    ) -> impl Iterator<Item = Cluster> {
        let first_new = vertices.positions.len() as u32;
        let to_all = self.add_vertices(vertices);
        let new = first_new..vertices.positions.len() as u32;
        let group = groups.add(part, self.error_in_local, self.deviation_in_local, new);
        self.clusters.into_iter().map(move |(corners, samples)| {
            let corners = corners.iter().map(|&own| to_all[own as usize]);
            Cluster {
                produced_by: group,
                corners: corners.collect(),
                samples,
            }
        })
    }

    /// Adds the new vertices. Returns the index in `vertices` of each used own vertex.
    fn add_vertices(&self, vertices: &mut LevelVertices) -> Vec<u32> {
        let width = vertices.layout.width();
        let mut to_all = vec![NONE; self.piece.vertices.len()];
        // The first vertex that moved away from each position, by the first own vertex at this position.
        let mut first_at = vec![NONE; self.piece.vertices.len()];
        for &own in self.clusters.iter().flat_map(|(corners, _)| corners) {
            let own = own as usize;
            if to_all[own] != NONE {
                continue;
            }
            let before = self.piece.vertices[own];
            // Unchanged vertices are shared with finer levels, which saves memory and keeps borders closed.
            if !self.simplified.is_new[own] {
                to_all[own] = before;
                continue;
            }
            let position = self.simplified.positions[own];
            let has_moved = position != self.piece.positions[own];
            let first = &mut first_at[self.same_position[own] as usize];
            // A vertex with new attributes at its old position stays welded to the old vertices there.
            let new = NewVertex {
                before,
                position,
                same_position: match (has_moved, *first) {
                    (false, _) => Some(vertices.same_position[before as usize]),
                    (true, NONE) => None,
                    (true, first) => Some(first),
                },
            };
            to_all[own] = vertices.push(&new, &self.simplified.rows[own * width..][..width]);
            if has_moved && *first == NONE {
                *first = to_all[own];
            }
        }
        to_all
    }
}
