//! Settings of a bake.

use crate::mesh::MeshError;

/// How a mesh is baked. [`Default`] is meant for real-time rendering with one draw per unit.
///
/// # Size of units
/// Larger clusters and groups make larger units: fewer draws, but more triangles where only a few are wanted. The
/// default draws 10 to 32 % more triangles near by than [`fine_grained`](Self::fine_grained), with about a third of
/// the draws.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeConfig {
    /// Most triangles in a cluster, 4 to 256.
    pub cluster_triangles: usize,
    /// Number of clusters that are simplified together, 2 to 1024. A group may exceed it by a third.
    pub group_clusters: usize,
    /// Share of the triangles that a simplification aims to keep, above 0 and below
    /// [`stuck_ratio`](Self::stuck_ratio). From the second level on, plants with up to 65,536 vertices keep between
    /// 0.6 and 0.74, so that changes of their levels are less visible.
    pub simplify_ratio: f32,
    /// A group that keeps more than this share of its triangles is stuck, and retried with other neighbours on the next
    /// level. At most 1.
    pub stuck_ratio: f32,
    /// Keeps the vertices of open borders at all levels. Meshes that are baked separately, such as tiles of a terrain or
    /// parts of a kit, then still meet at any level, if they meet at equal vertices. Primitives of one glTF mesh, and
    /// meshes that a file places alike, keep meeting without.
    pub lock_borders: bool,
    /// Measures the deviation of each group from the source. Without it, a guarantee draws full detail.
    pub measure_deviation: bool,
    /// Measures on pictures how far away the levels of plants and other meshes of many loose pieces look right. Without
    /// it, a level is as bad as its worst piece.
    pub measure_appearance: bool,
    /// Up to four primitives of one glTF mesh with fewer triangles than this in total are baked
    /// [together](crate::bake_together) if many of their triangles are leaves or other loose pieces, such as the bark and
    /// the leaves of a tree. 0 disables it. [Files](crate::bake_file) with a primitive of 20,000 triangles or more in that
    /// mesh ignore it.
    pub together_below_triangles: usize,
}

impl Default for BakeConfig {
    fn default() -> Self {
        Self {
            cluster_triangles: 256,
            group_clusters: 16,
            simplify_ratio: 0.5,
            stuck_ratio: 0.85,
            lock_borders: false,
            measure_deviation: true,
            measure_appearance: true,
            together_below_triangles: 1 << 16,
        }
    }
}

impl BakeConfig {
    /// Smaller units than the default: fewer triangles near the camera, three times the draws.
    #[must_use]
    pub fn fine_grained() -> Self {
        Self {
            cluster_triangles: 128,
            group_clusters: 8,
            ..Self::default()
        }
    }

    /// For quick tests: neither deviations nor appearance are measured, so a guarantee draws full detail.
    #[must_use]
    pub fn fast() -> Self {
        Self {
            measure_deviation: false,
            measure_appearance: false,
            ..Self::default()
        }
    }

    /// Fewest triangles at equal quality: small units, and a third more levels (each keeps 0.6 of the triangles of the
    /// finer one).
    #[must_use]
    pub fn max_quality() -> Self {
        Self {
            simplify_ratio: 0.6,
            stuck_ratio: 0.9,
            ..Self::fine_grained()
        }
    }

    /// Checks every field against its documented range.
    ///
    /// # Errors
    /// [`MeshError::Config`] for the first field out of range.
    pub fn validate(&self) -> Result<(), MeshError> {
        let checks = [
            (
                "cluster_triangles",
                (4..=256).contains(&self.cluster_triangles),
            ),
            ("group_clusters", (2..=1024).contains(&self.group_clusters)),
            (
                "stuck_ratio",
                self.stuck_ratio > 0.0 && self.stuck_ratio <= 1.0,
            ),
            (
                "simplify_ratio",
                self.simplify_ratio > 0.0 && self.simplify_ratio < self.stuck_ratio,
            ),
        ];
        match checks.into_iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(MeshError::Config { field }),
            None => Ok(()),
        }
    }
}
