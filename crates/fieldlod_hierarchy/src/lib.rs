//! Baked level-of-detail hierarchies: the data, its invariants and its file format.
//!
//! A [`Hierarchy`] holds one mesh at every level of detail at once. Triangles are gathered in
//! *groups*; each group is simplified as a whole, with its outline kept, and the triangles that
//! result form the groups of the next, coarser level, divided otherwise. A *cut* through this
//! directed acyclic graph picks, for each piece of the surface, exactly one level. What is drawn
//! with one command is a [`Unit`]: all triangles that the same group produced and the same group
//! consumes, so that a cut draws either all of them or none.
//!
//! This crate knows neither how hierarchies are made (`fieldlod_bake`) nor how a cut is chosen
//! (`fieldlod_select`) nor who draws it (`bevy_fieldlod`).
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
//! A vertex has the six attributes of [`Vertices`] and no others. What a source mesh has beyond them
//! is not simplified: a vertex of a coarser level names the source vertex that it came from
//! ([`Hierarchy::moved_from`]), and whoever draws takes the rest from there.
//!
//! Groups carry no cone around their normals: in the default bake of eight models (10,000 to 270,000
//! triangles) such cones have half angles of 150° and more as a rule, of terrain 20° to 90°, so that
//! they hardly ever tell that a group faces away.
//!
//! The deviation of a group, the two-sided Hausdorff distance of its simplified surface to the
//! source, is one length, without a part for each direction: of a dragon, a cloth, a helmet, a palm
//! tree and a golf ball the part across the mean normal alone is 0.7 to 1 of the whole (median of the
//! groups of a level), so that no direction of view could count on less. On terrain it is 0.2: seen
//! from straight above, and from there only, less would do.
//!
//! # Fuzzing
//! `fuzz/` is a workspace of its own: with cargo-fuzz, in this crate's folder,
//! `cargo +nightly fuzz run read_file -- -max_total_time=600`, or with a stable compiler and without a
//! sanitizer `RUSTC_BOOTSTRAP=1 cargo fuzz run read_file -s none -- -max_total_time=600`.

mod bounds;
mod build;
mod cards;
mod file;
pub mod fixtures;
mod hierarchy;
mod refinement;
mod source;
mod source_vertices;
pub mod srgb;
mod validate;
mod whole_mesh;

pub use bounds::{Aabb, Sphere};
pub use cards::{Card, CardLevel, CardPicture, Cards};
pub use file::{
    BakedFile, BakedPrimitive, FORMAT_VERSION, FileError, FileOptions, Page, PageOptions,
    PagedFile, PagedMesh, Precision,
};
pub use hierarchy::{Group, Hierarchy, NO_GROUP, Unit, Vertices};
pub use source::SourceHash;
pub use validate::InvalidHierarchy;
pub use whole_mesh::WholeMeshCut;
