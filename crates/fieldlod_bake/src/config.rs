//! Settings of a bake.

use crate::mesh::MeshError;

/// Configuration of a bake. [`Default`] suits real-time rendering with one draw call per unit.
///
/// # Size of units
/// Larger clusters and groups make larger units. They need fewer draw calls, but more triangles if only parts of a unit
/// need detail. Near the camera, the default draws 10 to 32 % more triangles than [`fine_grained`](Self::fine_grained),
/// with about a third of the draw calls.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeConfig {
    /// Maximum number of triangles in a cluster, 4 to 256.
    pub cluster_triangles: usize,
    /// Number of clusters that are simplified together, 2 to 1024. Groups may have up to a third more.
    pub group_clusters: usize,
    /// Share of the triangles that a simplification keeps, above 0 and below [`stuck_ratio`](Self::stuck_ratio). Plants
    /// with up to 65,536 vertices keep 0.6 to 0.74 from the second level on, so that changes between levels are less
    /// visible.
    pub simplify_ratio: f32,
    /// A group that keeps more than this share of its triangles is stuck. It is retried with other neighbours on the
    /// next level. At most 1.
    pub stuck_ratio: f32,
    /// Keeps the vertices of open borders at all levels. Separately baked meshes with equal border vertices, such as
    /// terrain tiles or parts of a kit, then have no cracks between any levels. Most primitives of one glTF mesh, and
    /// meshes that a [file](crate::bake_file) places by the same transform, keep their shared vertices without it.
    pub lock_borders: bool,
    /// Measures the deviation of each group from the source. Without it, settings that guarantee an error draw full
    /// detail.
    pub measure_deviation: bool,
    /// Measures on pictures at which distance levels of plants, other aggregates and torn textures look right. Without
    /// it, the error of an aggregate is estimated from the sizes of its elements. The error of a torn texture is then
    /// at least its longest edge.
    pub measure_appearance: bool,
    /// Triangle limit for primitives of one glTF mesh that change levels [together](crate::bake_together): plants such
    /// as a tree of bark and leaves, primitives that meet, and thin layers with what they lie on. 0 disables it.
    /// [`bake_adjacent`](crate::bake_adjacent), and glTF meshes of [files](crate::bake_file) with a primitive of 20,000
    /// triangles or more, use it only to avoid cracks.
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
    /// Smaller units than the default: fewer triangles near the camera, three times the draw calls.
    #[must_use]
    pub fn fine_grained() -> Self {
        Self {
            cluster_triangles: 128,
            group_clusters: 8,
            ..Self::default()
        }
    }

    /// For quick tests: measures neither deviation nor appearance. Settings that guarantee an error then draw full
    /// detail.
    #[must_use]
    pub fn fast() -> Self {
        Self {
            measure_deviation: false,
            measure_appearance: false,
            ..Self::default()
        }
    }

    /// Fewest triangles at equal quality: small units and a third more levels, because each level keeps 0.6 of the
    /// triangles.
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
