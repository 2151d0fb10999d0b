//! What a player sees: pictures drawn by Bevy's renderer, on whatever Vulkan adapter there is.
//!
//! Without an adapter these tests are skipped with a loud line, unless `FIELDLOD_REQUIRE_ADAPTER`
//! is set (as in continuous integration), which makes that a failure.

mod cameras;
#[path = "../../crates/fieldlod_bake/tests/common/character.rs"]
mod character;
#[path = "../character_files.rs"]
mod character_files;
mod characters;
mod debug;
mod device;
mod drawn_meshes;
#[path = "../../crates/fieldlod_bake/tests/common/gltf_file.rs"]
#[expect(
    dead_code,
    reason = "shared with the suites of the baker, which use more of it"
)]
mod gltf_file;
mod gpu_culling;
mod holes;
mod motion;
mod picking;
mod picture;
mod released_sources;
mod stock;
mod streamed;
mod swap;
