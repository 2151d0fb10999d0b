//! The plugin in an app without a renderer: what it takes in, what it leaves alone, what it says.

#[path = "../../crates/fieldlod_bake/tests/common/gltf_file.rs"]
#[expect(
    dead_code,
    reason = "shared with the suites of the baker, which use more of it"
)]
mod gltf_file;
mod headless;
mod life;
mod rejects;
mod scenes;
