//! Tests of the cut rule, the invariants and the file format.

mod common;
mod cut_rule;
mod files;
mod pages;
mod rejects_files;
mod rejects_hierarchies;
mod rejects_sections;
