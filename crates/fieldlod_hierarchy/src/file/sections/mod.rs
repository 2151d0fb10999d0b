//! Sections: groups, units and triangles as numbers, and their packing.
//!
//! In: the groups of one level. Out: the bytes of a section, and back.

pub(super) mod border;
pub(super) mod coded;
pub(super) mod numbers;
pub(super) mod records;
pub(super) mod references;
pub(super) mod section_reader;
pub(super) mod section_writer;
pub(super) mod triangles;
