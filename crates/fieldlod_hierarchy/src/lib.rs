//! Baked level-of-detail hierarchies: the data, its invariants and its file format.
//!
//! A [`Hierarchy`] holds all levels of detail of one mesh. Each *group* of triangles is simplified as
//! a whole, and its outline is kept. The resulting triangles are divided into the groups of the next
//! coarser level. A *cut* through this directed acyclic graph picks exactly one level for each piece
//! of the surface. A [`Unit`] is the smallest piece that is drawn: all triangles that one group
//! produced and one group consumes. A cut draws either all of them or none.
//!
//! `fieldlod_bake` makes hierarchies, `fieldlod_select` chooses cuts, and `bevy_fieldlod` draws them.
//!
//! ```
//! use fieldlod_hierarchy::{BakedFile, BakedPrimitive, fixtures};
//!
//! let hierarchy = fixtures::two_level_strip();
//! hierarchy.validate().unwrap();
//! assert_eq!(hierarchy.level_count(), 2);
//!
//! let file = BakedFile { primitives: vec![BakedPrimitive::new(0, 0, "strip", hierarchy)] };
//! let bytes = file.to_bytes();
//! assert_eq!(BakedFile::from_bytes(&bytes).unwrap(), file);
//! ```
//!
//! # Conventions
//! Lengths are in units of the mesh's local space. Triangles wind counter-clockwise, seen from
//! outside. Level 0 is the finest. "Finer" and "coarser" name the links of the graph.
//!
//! # Simplifications
//! A vertex has the six attributes of [`Vertices`]. Other attributes of the source mesh are not stored.
//! They are read from the source vertex that each moved vertex came from ([`Hierarchy::moved_from`]).
//!
//! A group has no normal cone and one deviation for all directions.
//!
//! # Fuzzing
//! `fuzz/` is a separate workspace. Run `cargo +nightly fuzz run read_file -- -max_total_time=600` in
//! the folder of this crate. A stable compiler needs
//! `RUSTC_BOOTSTRAP=1 cargo fuzz run read_file -s none -- -max_total_time=600`.

#[cfg(feature = "glam_0_33")]
extern crate glam_0_33 as glam;

mod bounds;
mod build;
mod file;
#[cfg(any(test, feature = "test-support"))]
pub mod fixtures;
pub mod glb;
mod hierarchy;
mod random;
mod refinement;
mod source_vertices;
mod validate;
mod vertices;
mod whole_mesh;

pub use bounds::{Aabb, Sphere};
pub use file::{
    BakedFile, BakedPrimitive, FORMAT_VERSION, FileError, Page, PageOptions, PagedFile, PagedMesh,
    Precision,
};
pub use hierarchy::{Group, Hierarchy, NO_GROUP, SILHOUETTE_WEIGHT, Unit, VISIBLE_WEIGHT};
#[doc(hidden)]
pub use random::Random;
pub use validate::InvalidHierarchy;
pub use vertices::{SourceHash, Vertices};
pub use whole_mesh::{CLUSTERS_FROM_TRIANGLES, WholeMeshCut};
