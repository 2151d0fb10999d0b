//! Undoes simplifications that open a closed surface.

use rustc_hash::FxHashMap;

use crate::levels::simplify::{Simplified, Task};
use crate::mesh::edges::Links;

impl Task<'_> {
    /// Restores the components that a simplification opens. In a group of many parts, the other parts stay simplified.
    /// Returns `None` if more than the share `ratio` of the triangles is left, or if an edge is still opened.
    pub(crate) fn restore_opened(
        &self,
        mut simplified: Simplified,
        ratio: f32,
    ) -> Option<Simplified> {
        let mut is_opened = vec![false; self.piece.vertices.len()];
        let opened = self.opened_positions(&simplified).into_iter();
        opened.for_each(|first| is_opened[first as usize] = true);
        let mut is_restored = vec![false; self.piece.vertices.len()];
        let mut corners = Vec::new();
        for component in &self.components(&self.piece.corners, &self.piece.positions) {
            let mut firsts = component
                .corners()
                .map(|own| self.same_position[own as usize]);
            if firsts.any(|first| is_opened[first as usize]) {
                let own = component.corners();
                own.for_each(|own| is_restored[own as usize] = true);
                corners.extend(component.corners());
                self.restore(&mut simplified, component);
            }
        }
        // Components share no vertices, so a triangle belongs to a restored component if its first corner does.
        let simplified_triangles = simplified.corners.as_chunks::<3>().0.iter();
        let others = simplified_triangles.filter(|[own, ..]| !is_restored[*own as usize]);
        corners.extend(others.flatten());
        simplified.corners = corners;
        let has_progress =
            simplified.corners.len() as f32 <= self.piece.corners.len() as f32 * ratio;
        (has_progress && self.opens_no_edge(&simplified)).then_some(simplified)
    }

    /// Whether open edges change only on borders of the source, and not on borders that other groups share.
    pub(crate) fn opens_no_edge(&self, simplified: &Simplified) -> bool {
        self.opened_positions(simplified).is_empty()
    }

    /// The first own vertex at each position where open edges change, except on borders of the source. Changed borders
    /// that other groups share are included.
    fn opened_positions(&self, simplified: &Simplified) -> Vec<u32> {
        let welded = |&own: &u32| self.same_position[own as usize];
        let mut links = Links::of(self.piece.vertices.len());
        links.add(self.piece.corners.iter().map(welded));
        links.remove(simplified.corners.iter().map(welded));
        // The difference of both sums is zero where the open edges at a vertex stay the same.
        let firsts = self.same_position.iter().copied();
        let mut opened: Vec<u32> = firsts
            .filter(|&own| links.is_open(own) && !self.is_border(own))
            .collect();
        // The border of the source may change, except where another group has the same border.
        opened.extend(self.changed_shared_borders(simplified));
        opened
    }

    /// Ends of changed edges between locked vertices on a border of the source. Other groups may use these edges.
    fn changed_shared_borders(&self, simplified: &Simplified) -> Vec<u32> {
        let is_shared = |own: u32| self.is_locked[own as usize] && self.is_border(own);
        let mut balance: FxHashMap<(u32, u32), i32> = FxHashMap::default();
        for (list, sign) in [(&self.piece.corners, 1), (&simplified.corners, -1)] {
            let (triangles, _) = list.as_chunks::<3>();
            for triangle in triangles {
                let [a, b, c] = triangle.map(|own| self.same_position[own as usize]);
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    if from != to && is_shared(from) && is_shared(to) {
                        let sign = if from < to { sign } else { -sign };
                        *balance.entry((from.min(to), from.max(to))).or_default() += sign;
                    }
                }
            }
        }
        // The order of the map does not matter: callers only set flags, or check whether the list is empty.
        let changed = balance.into_iter().filter(|(_, balance)| *balance != 0);
        changed.flat_map(|((from, to), _)| [from, to]).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use super::*;
    use crate::config::BakeConfig;
    use crate::fixtures;
    use crate::levels::simplify::Method;
    use crate::levels::vertices::{LevelVertices, NORMAL_WEIGHT, Piece};
    use crate::mesh::SourceMesh;
    use crate::mesh::surfaces::Surfaces;
    use crate::mesh::topology::Topology;

    fn vertices_of(mesh: &SourceMesh) -> LevelVertices {
        let surfaces = Surfaces::of([mesh]);
        let topology = Topology::of(mesh, &surfaces);
        LevelVertices::of(mesh, topology, surfaces, NORMAL_WEIGHT)
    }

    /// The whole mesh as one group.
    fn task<'a>(
        vertices: &'a LevelVertices,
        mesh: &SourceMesh,
        config: &'a BakeConfig,
    ) -> Task<'a> {
        let corners = mesh.indices.iter().map(|&v| vertices.corner[v as usize]);
        let piece = Piece::of(corners, vertices);
        Task {
            vertices,
            config,
            same_position: piece.same_position(vertices),
            uv_ranges: OnceLock::new(),
            is_locked: vec![false; piece.vertices.len()],
            visible_px: None,
            ratio: config.simplify_ratio,
            loose: Method::Elements,
            is_whole: true,
            area_gain: 1.0,
            piece,
        }
    }

    /// One triangle of a part of a machine is removed. Only this part is restored; the other parts stay simplified.
    #[test]
    fn opened_part_does_not_block_others() {
        let mesh = fixtures::machine(2);
        let (config, vertices) = (BakeConfig::default(), vertices_of(&mesh));
        let task = task(&vertices, &mesh, &config);
        let mut moved = task.attempts().filter(|it| it.method == Method::Moved);
        let mut opened = moved.next().unwrap();
        opened.corners.truncate(opened.corners.len() - 3);
        assert!(!task.opens_no_edge(&opened));
        let restored = task.restore_opened(opened, 0.7).unwrap();
        assert!(task.opens_no_edge(&restored));
        let share = restored.corners.len() as f32 / task.piece.corners.len() as f32;
        assert!(share < 0.65, "{share}");
    }
}
