//! What a bake can be told.

use crate::mesh::MeshError;

/// How a mesh is baked. [`Default`] is meant for real-time rendering with one draw per unit.
///
/// # Size of units
/// In view with a quality threshold of 1 px, 1080 px high, 60° of view, from 1.5 and 3 radii of the
/// bounding sphere away from its centre, means of 24 directions: units, and thousand triangles.
/// Measured once, before clusters were split by place, by a program that is not part of the
/// repository.
///
/// | clusters | a unit | dragon, 203k | cloth, 115k | head, 269k |
/// |---|---|---|---|---|
/// | 128 by 8 | 340 | 340 105k, 254 53k | 164 37k, 82 17k | 267 63k, 168 32k |
/// | 128 by 16 | 640 | 195 109k, 136 53k | 90 39k, 38 16k | 166 72k, 92 33k |
/// | 128 by 32 | 1,290 | 108 116k, 71 54k | 47 41k, 19 16k | 101 86k, 50 35k |
/// | 256 by 8 | 660 | 184 110k, 133 53k | 84 38k, 39 17k | 162 72k, 97 34k |
/// | **256 by 16** | 1,300 | 105 115k, 72 54k | 48 42k, 16 16k | 94 84k, 51 36k |
/// | 256 by 32 | 2,620 | 57 123k, 38 57k | 22 45k, 7 17k | 58 106k, 29 42k |
///
/// The default draws 10 to 32 % more triangles near by than the smallest units, with 29 to 35 % of
/// the draws, and up to 12 % more from 3 radii. Its files are larger by 3 to 6 %.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeConfig {
    /// Most triangles in a cluster, 4 to 256. Larger clusters make larger units: fewer draws, but
    /// more triangles where only a few are wanted.
    pub cluster_triangles: usize,
    /// How many clusters are simplified together, 2 to 1024: a target that a group may exceed by a
    /// third.
    pub group_clusters: usize,
    /// How many triangles a simplification aims to keep, as a share of its input, above 0 and
    /// below [`stuck_ratio`](Self::stuck_ratio). Levels of plants and others of which a quarter of the
    /// triangles is that of six or more loose pieces, with no more than 65,536 vertices, keep at least 0.6 from the second on, and up to 0.74, so that their changes are seen less.
    pub simplify_ratio: f32,
    /// A group that keeps more than this share of its triangles is stuck, and merged with others.
    /// At most 1.
    pub stuck_ratio: f32,
    /// How much a change of the unit normal by 1 counts, as a share of the extent of the group
    /// that is simplified. 0 ignores normals.
    pub normal_weight: f32,
    /// How much a texture that slides along the surface counts, against an equal displacement of
    /// the surface, where a group is as large as the mesh; proportionally less where it is
    /// smaller. 0 ignores texture coordinates, apart from seams.
    pub uv_weight: f32,
    /// How much a change of a colour by 1 counts, as [`normal_weight`](Self::normal_weight) does.
    /// 0 ignores colours.
    pub color_weight: f32,
    /// From which level on simplification moves vertices to where the error is least: 0 moves them
    /// from the first. Levels before that use vertices of the source only, which files and memory
    /// need not hold twice.
    pub first_moved_level: u32,
    /// Whether deviations from the source are measured. Without, a guarantee draws full detail.
    pub measure_deviation: bool,
    /// Whether pictures tell how far away the levels of the whole mesh are good enough, of meshes of many
    /// loose pieces, such as leaves, with no more vertices than can be drawn as a whole. Without, a level is
    /// as bad as its worst piece.
    pub measure_appearance: bool,
    /// Whether plants and other loose pieces whose material is known get levels of cards below those of triangles:
    /// rectangles with pictures of them. Only where appearance is measured, and where levels of cards take no more than half
    /// of the triangles for as small errors, in the mean of those that take fewer; of meshes that are baked together each has its own, if the
    /// materials of all are known. They take the place of the first
    /// level of triangles that one of them beats, with no more triangles and no more error, and of all coarser ones. Errors
    /// hold where a pixel has several samples, in one picture or over time: with the one that MSAA takes of a
    /// texture, cards look worse than that.
    pub cards: bool,
    /// Up to four primitives of one glTF mesh that have fewer triangles than this in all, many of them those of
    /// leaves or other loose pieces, as the bark and the leaves of a tree, are baked [together](crate::bake_together). 0 for never.
    /// Not in [files](crate::bake_file) if one of them has 20,000 triangles or more: as a rule it is drawn in pieces.
    pub together_below_triangles: usize,
    /// Whether texture seams are kept: without it, a texture may be torn along them.
    pub protect_uv_seams: bool,
}

impl Default for BakeConfig {
    fn default() -> Self {
        Self {
            cluster_triangles: 256,
            group_clusters: 16,
            simplify_ratio: 0.5,
            stuck_ratio: 0.85,
            normal_weight: 0.45,
            uv_weight: 0.5,
            color_weight: 0.25,
            first_moved_level: 0,
            measure_deviation: true,
            measure_appearance: true,
            cards: false,
            together_below_triangles: 1 << 16,
            protect_uv_seams: true,
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

    /// For trying things out: units are as large as the default's, and neither deviations nor
    /// appearance are measured, so that a guarantee draws full detail.
    #[must_use]
    pub fn fast() -> Self {
        Self {
            measure_deviation: false,
            measure_appearance: false,
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
            ("color_weight", weight.contains(&self.color_weight)),
        ];
        match checks.into_iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(MeshError::Config { field }),
            None => Ok(()),
        }
    }
}
