//! Tests of files: glTF input, characters, and errors.

#[path = "../common/mod.rs"]
mod common;

mod characters;
mod end_to_end;
mod files;
mod import;
mod quantized;
mod rejects_files;
mod rejects_meshes;
