//! The plugin in an app without a renderer: what it takes in, what it leaves alone, what it says.

mod background;
mod cache;
#[path = "../../crates/fieldlod_bake/tests/common/character.rs"]
mod character;
#[path = "../character_files.rs"]
mod character_files;
mod characters;
mod copies;
mod despawns;
mod game_code;
#[path = "../../crates/fieldlod_bake/tests/common/gltf_file.rs"]
#[expect(
    dead_code,
    reason = "shared with the suites of the baker, which use more of it"
)]
mod gltf_file;
mod headless;
mod kinds;
mod life;
mod rejects;
mod scenes;
mod settings;
mod soak;
mod standalone;
mod stock;
mod streamed;
mod surfaces;
mod textures;
mod views;
mod visible_flux;
