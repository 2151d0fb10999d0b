//! Bakes meshes and glTF files into level-of-detail hierarchies, with meshoptimizer.
//!
//! [`bake_mesh`] is the recipe for one mesh. It groups and simplifies clusters level by level, down to a dozen triangles,
//! with vertices that move to where the error is least. It measures the deviation of each simplified surface from the
//! source, and bounds and orders the units. [`verify()`] checks a hierarchy against its source without trusting the bake.
//! [`import_gltf`] reads the triangle meshes of a glTF file as Bevy does, and [`bake_file`] does both for every primitive
//! of a file. [`bake_rigged`] bakes skinned and morphed primitives, which have whole-mesh levels.
//!
//! ```
//! use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
//!
//! let rock = fixtures::rock(5, 7);
//! let hierarchy = bake_mesh(&rock, &BakeConfig::default())?;
//! assert_eq!(hierarchy.source_triangle_count(), 20_480);
//! assert!(hierarchy.level_count() > 3);
//! # Ok::<(), fieldlod_bake::MeshError>(())
//! ```
//!
//! # From a glTF primitive to a unit in a file
//! | Step | Folder |
//! |---|---|
//! | a whole file, several primitives at a time | `file` |
//! | JSON, buffers and accessors become a [`SourceMesh`], images its [`Surface`] | `import` |
//! | the recipe for one mesh | `bake` |
//! | the source mesh, its surface, components, borders and nearest triangles | `mesh` |
//! | clusters, groups and their simplification, level by level; units, ordered and bounded | `levels` |
//! | leaves, blades and gravel, which keep their area; primitives that are one plant; pictures of levels | `plants` |
//! | skinned and morphed meshes | `characters` |
//! | deviation from the source, and whether triangles face as the source does | `deviation` |
//! | bytes | `file` of `fieldlod_hierarchy` |
//! | a check that does not trust the bake | `verify` |
//!
//! # Conventions
//! Lengths are in the units of the mesh's own ("local") space; no node transform is applied.
//! Triangles wind counter-clockwise seen from outside. The same mesh and configuration give the
//! same bytes.
//!
//! # Simplifications
//! The error of a group is the one that meshoptimizer reports: a weighted mean of squared distances and attribute
//! differences, neither a bound nor tight. Its deviation, the two-sided Hausdorff distance of the simplified surface to
//! the source, is measured at samples: ten times as many samples usually find at most 5 % more. Texture
//! seams and borders keep the positions of the source; only their attributes are mixed. Positions and attributes that
//! differ by rounding are one, see `mesh/topology`. Tangents count nothing: those of the source are turned into the
//! surface. Every cut of a closed mesh is closed.
//!
//! Levels of skinned and morphed meshes use source vertices alone. Their deviation is 1.5 times the largest at samples in the
//! poses that the bake goes by; it is no bound for other poses. [`verify_rigged`] gives one for joints that bend by up to an
//! angle.
//!
//! # Out of scope
//! Points and lines are reported as [`Skipped`]. Draco compression is an error.
//!
//! # Fuzzing
//! `fuzz/` is a workspace of its own: with cargo-fuzz, in this crate's folder,
//! `ASAN_OPTIONS=detect_odr_violation=0 cargo +nightly fuzz run import_gltf -- -max_total_time=600`, or
//! with a stable compiler and without a sanitizer
//! `RUSTC_BOOTSTRAP=1 cargo fuzz run import_gltf -s none -- -max_total_time=600`.

mod bake;
mod characters;
mod config;
mod deviation;
mod file;
#[cfg(any(test, feature = "test-support"))]
pub mod fixtures;
mod import;
mod levels;
mod mesh;
#[cfg(any(test, feature = "test-support"))]
pub mod naive;
mod plants;
mod progress;
mod report;
mod verify;

/// Changes whenever the same mesh and configuration give other levels. Caches of bakes use it in their keys.
pub const REVISION: u32 = 2;

pub use bake::{bake_mesh, bake_mesh_with_report};
#[doc(hidden)]
pub use characters::{Character, Distances, Part, Pose, clip_poses, distances, plain_levels};
pub use characters::{RiggedResult, RiggedVerified, bake_rigged, verify_rigged};
pub use config::BakeConfig;
pub use file::{BakeOutcome, bake_file, bake_file_bytes, bake_import};
pub use import::{
    AccessorFault, BufferFault, Channel, Clip, ImageFault, Import, ImportError, ImportedPrimitive,
    Interpolation, Node, PackedViewFault, PrimitiveFault, PrimitivePlace, Property, Rig, RigFault,
    Skin, SkipReason, Skipped, UnreadImage, import_gltf, import_gltf_bytes, unpack_gltf,
};
#[cfg(any(test, feature = "test-support"))]
pub use levels::clusterlod::{bare_clusterlod, clusterlod_hierarchy};
pub use mesh::surface::{Surface, SurfaceAlpha, TextureMapping};
#[doc(hidden)]
pub use mesh::triangle_tree::{NearestTriangle, TriangleTree};
pub use mesh::{MAX_COORDINATE, MeshError, SourceMesh};
pub use plants::together::{MOST_TOGETHER, bake_together};
pub use progress::BakeProgress;
pub use report::{BakeReport, Fallback, FallbackKind};
pub use verify::{Verified, VerifyError, VerifySettings, verify};
