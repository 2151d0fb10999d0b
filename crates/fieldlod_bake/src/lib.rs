//! Bakes meshes and glTF files into level-of-detail hierarchies, with meshoptimizer.
//!
//! [`bake_mesh`] is the recipe for one mesh. It groups and simplifies clusters level by level, down to a dozen
//! triangles, and moves vertices to reduce the error. It measures the deviation of each simplified surface from the
//! source, and bounds and orders the units. [`verify()`] checks a hierarchy against its source, independently of the
//! bake. [`import_gltf`] reads the triangle meshes of a glTF file as Bevy does. [`bake_file`] imports and bakes every
//! primitive of a file. [`bake_rigged`] bakes skinned and morphed primitives, which have whole-mesh levels.
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
//! | all primitives of a file, several in parallel | `file` |
//! | JSON, buffers and accessors become a [`SourceMesh`], images its [`Surface`] | `import` |
//! | the recipe for one mesh | `bake` |
//! | the source mesh, its surface, components, borders and nearest triangles | `mesh` |
//! | clusters, groups and their simplification, level by level; ordered and bounded units | `levels` |
//! | leaves, blades and gravel, which keep their area; primitives of one plant; pictures of levels | `plants` |
//! | thin layers, which stay in front of what they lie on | `layers` |
//! | skinned and morphed meshes | `characters` |
//! | deviation from the source, and tests for flipped triangles | `deviation` |
//! | bytes | `file` of `fieldlod_hierarchy` |
//! | checks that are independent of the bake | `verify` |
//!
//! # Conventions
//! Lengths are in the units of the mesh's own ("local") space; no node transform is applied. Triangles wind
//! counter-clockwise seen from outside. The same mesh and configuration give the same bytes. Every cut of a closed mesh
//! is closed.
//!
//! # Simplifications
//! - The error of a group is the one that meshoptimizer reports: the root of a weighted mean of squared distances and
//!   attribute differences. It is an estimate, not a bound.
//! - The deviation of a group is the two-sided Hausdorff distance between simplified surface and source, measured at
//!   samples. Ten times as many samples usually find at most 5 % more.
//! - Texture seams and borders keep the positions of the source, except in small loose elements and torn textures.
//! - Positions and attributes that differ only by rounding are welded, see `mesh/topology`.
//! - Thin layers, such as labels and clothes, stay in front at levels of the whole mesh. The layer and the surface behind
//!   it may be one mesh with fewer than 20,000 triangles, primitives of one glTF mesh, or meshes that a [file](bake_file)
//!   places by the same transform. Larger meshes, instances with different transforms and rigged meshes have no such
//!   promise; [`verify_layers`] finds lost layers of static meshes.
//! - Tangents do not affect the error. Tangents of the source are projected onto the simplified surface.
//!
//! Levels of skinned and morphed meshes use source vertices alone. Their deviation is 1.5 times the largest at samples
//! in the poses that the bake uses. It is not a bound for other poses. [`verify_rigged`] computes a bound for joints
//! that bend by up to an angle.
//!
//! # Out of scope
//! Points and lines are reported as [`Skipped`]. Draco compression is an error.
//!
//! # Fuzzing
//! `fuzz/` is a separate workspace. Run it in this crate's folder with cargo-fuzz:
//! `ASAN_OPTIONS=detect_odr_violation=0 cargo +nightly fuzz run import_gltf -- -max_total_time=600`.
//! With a stable compiler, sanitizers are not available:
//! `RUSTC_BOOTSTRAP=1 cargo fuzz run import_gltf -s none -- -max_total_time=600`.

// Without the feature, items for tests and measurements are not exported.
#![cfg_attr(not(any(test, feature = "test-support")), allow(unreachable_pub))]

#[cfg(feature = "glam_0_33")]
extern crate glam_0_33 as glam;

mod bake;
mod characters;
mod config;
mod deviation;
mod file;
#[cfg(any(test, feature = "test-support"))]
pub mod fixtures;
mod import;
mod layers;
mod levels;
mod mesh;
#[cfg(any(test, feature = "test-support"))]
pub mod naive;
mod plants;
mod progress;
mod report;
mod verify;

/// A hash of the baker's sources. Other sources may give other levels of the same mesh and configuration, so caches of
/// bakes use it in their keys.
pub const SOURCE_HASH: &str = env!("FIELDLOD_BAKE_SOURCES");

pub use bake::{bake_mesh, bake_mesh_with_report};
#[cfg(any(test, feature = "test-support"))]
pub use characters::support::{Character, Part, Pose, clip_poses, deviations, plain_levels};
pub use characters::{RiggedResult, RiggedVerified, bake_rigged, verify_rigged};
pub use config::BakeConfig;
pub use file::{BakeOutcome, bake_file, bake_import};
pub use import::{
    AccessorFault, BufferFault, Channel, Clip, ClipFault, ImageFault, Import, ImportError,
    ImportedPrimitive, Interpolation, Node, PackedViewFault, PrimitiveFault, PrimitivePlace,
    Property, Rig, RigFault, Skin, SkipReason, Skipped, UnpackedGltf, UnreadImage, import_gltf,
    import_gltf_bytes, unpack_gltf,
};
#[cfg(any(test, feature = "test-support"))]
pub use levels::clusterlod::{bare_clusterlod, clusterlod_hierarchy};
pub use mesh::surface::{Surface, SurfaceAlpha, TextureMapping};
#[cfg(any(test, feature = "test-support"))]
pub use mesh::triangle_tree::{NearestTriangle, TriangleTree};
pub use mesh::{MAX_COORDINATE, MeshError, SourceMesh};
pub use plants::together::{bake_adjacent, bake_together};
pub use progress::BakeProgress;
pub use report::{BakeReport, Fallback, FallbackKind};
#[cfg(any(test, feature = "test-support"))]
pub use verify::swallowed_share;
pub use verify::{Verified, VerifyError, VerifySettings, verify, verify_layers};
