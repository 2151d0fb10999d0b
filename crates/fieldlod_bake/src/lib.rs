//! Bakes meshes and glTF files into level-of-detail hierarchies, with meshoptimizer.
//!
//! [`bake_mesh`] is the recipe for one mesh: check it; cluster, group and simplify it level by
//! level, down to a dozen triangles, with vertices that move to where the error is least; measure
//! how far each simplified surface lies from the source; bound and order what is drawn together. [`verify()`] checks a hierarchy against its source without trusting the bake.
//! [`import_gltf`] reads the static triangle meshes of a glTF file exactly as Bevy does, and
//! [`bake_file`] does both for every primitive of a file.
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
//! | Step | Where |
//! |---|---|
//! | a whole file, several primitives at a time | `file` |
//! | JSON, buffers and accessors become a [`SourceMesh`], images its [`Surface`] | `import`: `document`, `buffers`, `primitive`, `accessor`, `material`, `images` |
//! | the recipe for one mesh | `bake` |
//! | scaled positions and weighted attributes of all levels, seams, borders | `vertices`, `attributes`, `edges` |
//! | the loop: groups, level by level | `levels`, `clusters`, `groups` |
//! | the simplification of one group, and that it stays closed | `simplify`, `closed` |
//! | leaves, blades and gravel, which keep their area | `aggregate`, `elements`, `components` |
//! | deviation from the source, and whether it faces as that does | `deviation`, `triangle_tree` |
//! | units, ordered and bounded | `assemble` |
//! | what levels of the whole mesh look like | `appearance`, `picture`, `surface`, `surfaces` |
//! | plants as cards: planes that leaves lie on, rectangles there, pictures of them, side by side in one | `cards`: `planes`, `frame`, `texels`, `pack` |
//! | primitives that are one plant, baked as one | `together` |
//! | bytes | `file` of `fieldlod_hierarchy` |
//!
//! # Conventions
//! Lengths are in the units of the mesh's own ("local") space; no node transform is applied.
//! Triangles wind counter-clockwise seen from outside. The same mesh and configuration give the
//! same bytes.
//!
//! # Simplifications
//! The error of a group is what meshoptimizer reports: a weighted mean of squared distances mixed
//! with attribute differences, neither a bound nor tight. Its deviation, the two-sided Hausdorff
//! distance of the simplified surface to the source, is measured at samples: as a rule ten times as
//! many elsewhere find no more than 5 % beyond it. Texture seams and borders keep the source's
//! positions: only their attributes are mixed anew, and not taken from the nearest point of the source,
//! where textures would slip more (measured in `benches/RECORD.md`). Every cut of a closed mesh is closed.
//!
//! # Out of scope
//! Skinned and morphed meshes, points and lines: they are reported as [`Skipped`]. Geometry
//! compressed with Draco: it is refused by name.
//!
//! # Fuzzing
//! `fuzz/` is a workspace of its own: with cargo-fuzz, in this crate's folder,
//! `ASAN_OPTIONS=detect_odr_violation=0 cargo +nightly fuzz run import_gltf -- -max_total_time=600`, or
//! with a stable compiler and without a sanitizer
//! `RUSTC_BOOTSTRAP=1 cargo fuzz run import_gltf -s none -- -max_total_time=600`.

mod bake;
mod config;
mod deviation;
mod file;
pub mod fixtures;
mod import;
mod levels;
mod mesh;
pub mod naive;
mod plants;
mod progress;
mod report;
mod verify;

/// Counts changes of what the same mesh and configuration are baked to within a version: whoever keeps bakes knows by
/// it which are out of date.
pub const REVISION: u32 = 7;

pub use bake::{bake_mesh, bake_mesh_with_report};
pub use config::BakeConfig;
pub use file::{BakeOutcome, bake_file, bake_file_bytes};
pub use import::{
    AccessorFault, BufferFault, ImageFault, Import, ImportError, ImportedPrimitive,
    PackedViewFault, PrimitivePlace, SkipReason, Skipped, UnreadImage, import_gltf,
    import_gltf_bytes,
};
#[doc(hidden)]
pub use levels::clusterlod::bare_clusterlod;
pub use levels::clusterlod::clusterlod_hierarchy;
pub use mesh::surface::{Surface, SurfaceAlpha, TextureMapping};
pub use mesh::triangle_tree::{NearestTriangle, TriangleTree};
pub use mesh::{MAX_COORDINATE, MeshError, SourceMesh};
pub use plants::together::{MOST_TOGETHER, bake_together};
pub use progress::BakeProgress;
pub use report::{BakeReport, Fallback, FallbackKind};
pub use verify::{Verified, VerifyError, VerifySettings, verify};
