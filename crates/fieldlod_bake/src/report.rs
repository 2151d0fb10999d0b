//! Report of a bake.

use std::fmt;

/// How a bake went: groups that got stuck, and the fallbacks that were used.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BakeReport {
    /// Groups that could not be simplified and were retried with other neighbours.
    pub stuck_groups: usize,
    /// Levels of the whole mesh above the last clusters.
    pub whole_mesh_levels: usize,
    /// Whether some groups are aggregates of many loose pieces, such as leaves.
    pub has_aggregates: bool,
    /// Vertices that were taken for others, whose positions differ by rounding.
    pub rounded_vertices: usize,
    /// Triangles of which another at the same places faces the other way: one side was simplified.
    pub two_sided_triangles: usize,
    /// Triangles of the coarsest level.
    pub coarsest_triangles: usize,
    /// Fallbacks for groups that no regular simplification could reduce. If `coarsest_triangles` is above
    /// [`MOST_COARSEST`](Self::MOST_COARSEST), they did not help.
    pub fallbacks: Vec<Fallback>,
}

impl BakeReport {
    /// More triangles than this at the coarsest level are a failure to simplify.
    pub const MOST_COARSEST: usize = 512;

    /// Whether the coarsest level has too many triangles, after all that was tried.
    #[must_use]
    pub fn is_stuck(&self) -> bool {
        self.coarsest_triangles > Self::MOST_COARSEST
    }
}

/// One step beyond plain simplification. Its deviation is measured as that of any group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fallback {
    /// The fallback.
    pub kind: FallbackKind,
    /// The group so simplified.
    pub group: u32,
    /// Triangles before.
    pub from: usize,
    /// Triangles after.
    pub to: usize,
}

/// Fallbacks, the gentlest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FallbackKind {
    /// Small components of the surface were left out.
    Pruned,
    /// Attributes were ignored, and textures may be torn at their seams.
    AttributesIgnored,
    /// Vertices were merged on a grid, which opens closed surfaces.
    Sloppy,
}

impl fmt::Display for FallbackKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pruned => "small components left out",
            Self::AttributesIgnored => "attributes ignored",
            Self::Sloppy => "vertices merged on a grid",
        })
    }
}
