//! Encodes and decodes sections: groups, units and triangles.
//!
//! Input: groups. Output: the bytes of a section.

pub(super) mod coded;
pub(super) mod numbers;
pub(super) mod records;
pub(super) mod references;
pub(super) mod section_reader;
pub(super) mod section_writer;
pub(super) mod triangles;
