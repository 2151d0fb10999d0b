//! What a bake can be told.

use crate::MeshError;

/// How a mesh is baked. [`Default`] is meant for real-time rendering with one draw per unit.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeConfig {
    /// Most triangles in a cluster, 4 to 256. Larger clusters make larger units: fewer draws, but
    /// more triangles where only a few are wanted.
    pub cluster_triangles: usize,
    /// How many clusters are simplified together, 2 to 1024: a target that a group may exceed by a
    /// third. Beyond 64, units may need more vertices than their 16-bit indices reach.
    pub group_clusters: usize,
    /// How many triangles a simplification aims to keep, as a share of its input, above 0 and
    /// below [`stuck_ratio`](Self::stuck_ratio).
    pub simplify_ratio: f32,
    /// A group that keeps more than this share of its triangles is stuck, and left to the levels
    /// of the whole mesh. At most 1.
    pub stuck_ratio: f32,
    /// How much a change of the unit normal by 1 counts, as a share of the extent of the group
    /// that is simplified. 0 ignores normals.
    pub normal_weight: f32,
    /// How much a texture that slides along the surface counts, against an equal displacement of
    /// the surface, where a group is as large as the mesh; proportionally less where it is
    /// smaller. 0 ignores texture coordinates, apart from seams.
    pub uv_weight: f32,
    /// Whether texture seams are kept: without it, a texture may be torn along them.
    pub protect_uv_seams: bool,
    /// Whether a stuck group may be merged on a grid, without regard to its topology. It coarsens
    /// debris further, but moves borders and opens edges away from them.
    pub sloppy_fallback: bool,
}

impl Default for BakeConfig {
    fn default() -> Self {
        Self {
            cluster_triangles: 256,
            group_clusters: 16,
            simplify_ratio: 0.5,
            stuck_ratio: 0.85,
            normal_weight: 0.5,
            uv_weight: 0.5,
            protect_uv_seams: true,
            sloppy_fallback: false,
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

    /// For trying things out: neither normals nor texture coordinates are weighed (seams are still
    /// kept), and units are as large as the default's.
    #[must_use]
    pub fn fast() -> Self {
        Self {
            normal_weight: 0.0,
            uv_weight: 0.0,
            ..Self::default()
        }
    }

    /// Fewest triangles for a picture: small units, and levels closer together (each keeps 0.6 of
    /// the triangles of the one below, so that there are a third more of them).
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
        let weight = 0.0..=1e3;
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
            ("normal_weight", weight.contains(&self.normal_weight)),
            ("uv_weight", weight.contains(&self.uv_weight)),
        ];
        match checks.into_iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(MeshError::Config { field }),
            None => Ok(()),
        }
    }
}
