//! Baked level-of-detail hierarchies: the data, its invariants and its file format.
//!
//! A [`Hierarchy`] holds one mesh at every level of detail at once. Triangles are gathered in
//! *groups*; each group is simplified as a whole, with its outline kept, and the triangles that
//! result form the groups of the next, coarser level, divided otherwise. A *cut* through this
//! directed acyclic graph picks, for each piece of the surface, exactly one level. What is drawn
//! with one command is a [`Unit`]: all triangles that the same group produced and the same group
//! consumes, so that a cut draws either all of them or none.
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
//! Lengths are in the units of the mesh's own ("local") space. Triangles wind counter-clockwise
//! seen from outside. Level 0 is the finest. "Finer" and "coarser" name the links of the graph.
//!
//! # Simplifications
//! A vertex has the six attributes of [`Vertices`]. Other attributes of a source mesh are not simplified: each moved
//! vertex names the source vertex that it came from ([`Hierarchy::moved_from`]), which has them.
//!
//! Groups have no normal cones: in default bakes of eight models, such cones have half angles of 150° and more, so they
//! hardly ever prove that a group faces away.
//!
//! The deviation of a group, the two-sided Hausdorff distance of its simplified surface to the source, is one length for
//! all directions: on most models the part across the mean normal alone is 0.7 to 1 of the whole.
//!
//! # Fuzzing
//! `fuzz/` is a workspace of its own: with cargo-fuzz, in this crate's folder,
//! `cargo +nightly fuzz run read_file -- -max_total_time=600`, or with a stable compiler and without a
//! sanitizer `RUSTC_BOOTSTRAP=1 cargo fuzz run read_file -s none -- -max_total_time=600`.

mod bounds;
mod build;
mod file;
#[cfg(any(test, feature = "test-support"))]
pub mod fixtures;
mod hierarchy;
mod random;
mod refinement;
mod source_vertices;
mod validate;
mod vertices;
mod whole_mesh;

pub use bounds::{Aabb, Sphere};
pub use file::{
    BakedFile, BakedPrimitive, FORMAT_VERSION, FileError, FileOptions, Page, PageOptions,
    PagedFile, PagedMesh, Precision,
};
pub use hierarchy::{Group, Hierarchy, NO_GROUP, Unit};
#[doc(hidden)]
pub use random::Random;
pub use validate::InvalidHierarchy;
pub use vertices::{SourceHash, Vertices};
pub use whole_mesh::WholeMeshCut;
