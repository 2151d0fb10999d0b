//! Pictures that Bevy's renderer draws, on any Vulkan adapter.
//!
//! Without an adapter, these tests print a line and pass. They fail if `FIELDLOD_REQUIRE_ADAPTER` is set, as in
//! continuous integration.

mod cameras;
#[path = "../../crates/fieldlod_bake/tests/common/character.rs"]
mod character;
#[path = "../character_files.rs"]
mod character_files;
mod characters;
mod debug;
mod drawn_meshes;
#[path = "../../crates/fieldlod_bake/tests/common/gltf_file.rs"]
#[expect(
    dead_code,
    reason = "shared with the suites of the baker, which use more of it"
)]
mod gltf_file;
mod gpu_culling;
mod holes;
mod picture;
mod soak;
mod sources;
mod stock;
mod streamed;
mod swap;
