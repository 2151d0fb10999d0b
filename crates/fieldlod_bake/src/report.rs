//! Report of a bake.

use std::fmt;

/// Result of a bake: stuck groups and fallbacks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BakeReport {
    /// Failed simplifications of groups, on all levels. Stuck groups are retried with other neighbours, if any.
    pub stuck_groups: usize,
    /// Levels with a single group.
    pub whole_mesh_levels: usize,
    /// Whether some groups are aggregates of many loose elements, such as leaves.
    pub has_aggregates: bool,
    /// Vertices that were welded to other vertices although their positions differ by rounding.
    pub rounded_vertices: usize,
    /// Triangles of two-sided sheets, both sides counted. Only one side is simplified.
    pub two_sided_triangles: usize,
    /// Triangles of the coarsest level, with both sides of two-sided sheets.
    pub coarsest_triangles: usize,
    /// Fallbacks for groups that no regular simplification could reduce. If `coarsest_triangles` is above
    /// [`MOST_COARSEST`](Self::MOST_COARSEST), the fallbacks were not enough.
    pub fallbacks: Vec<Fallback>,
}

impl BakeReport {
    /// A coarsest level with more triangles than this counts as stuck: the size of two default clusters.
    pub const MOST_COARSEST: usize = 512;

    /// Whether the coarsest level has too many triangles in spite of all fallbacks.
    #[must_use]
    pub fn is_stuck(&self) -> bool {
        self.coarsest_triangles > Self::MOST_COARSEST
    }

    /// Whether the result depends on the surfaces of the mesh, which affect leaves and torn textures.
    #[must_use]
    pub fn depends_on_surfaces(&self) -> bool {
        self.has_aggregates || self.first_torn_group().is_some()
    }

    /// The first group that tore texture seams.
    pub(crate) fn first_torn_group(&self) -> Option<u32> {
        let mut torn = self.fallbacks.iter();
        let torn = torn.find(|step| step.kind == FallbackKind::TexturesTorn);
        torn.map(|step| step.group)
    }
}

/// A fallback that simplified one group. Its deviation is measured like any other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fallback {
    /// Kind of the fallback.
    pub kind: FallbackKind,
    /// Index of the simplified group.
    pub group: u32,
    /// Number of triangles before the simplification.
    pub from: usize,
    /// Number of triangles after the simplification.
    pub to: usize,
}

/// Kinds of fallbacks, the least visible first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FallbackKind {
    /// Small components were removed.
    Pruned,
    /// Textures may be torn at seams.
    TexturesTorn,
    /// Vertices were merged on a grid.
    Sloppy,
}

impl fmt::Display for FallbackKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pruned => "small components removed",
            Self::TexturesTorn => "textures may be torn",
            Self::Sloppy => "vertices merged on a grid",
        })
    }
}
