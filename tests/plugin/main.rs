//! The plugin in an app without a renderer.

#[path = "../../crates/fieldlod_bake/tests/common/character.rs"]
mod character;
#[path = "../character_files.rs"]
mod character_files;
#[path = "../../crates/fieldlod_bake/tests/common/gltf_file.rs"]
#[expect(
    dead_code,
    reason = "shared with the suites of the baker, which use more of it"
)]
mod gltf_file;
mod headless;
mod streamed;

/// Bakes and their cache.
mod baking {
    mod background;
    mod cache;
    mod processed;
}

/// Kinds of meshes and files.
mod content {
    mod characters;
    mod kinds;
    mod primitives;
    mod rejects;
    pub(crate) mod scenes;
    mod served;
    mod standalone;
    pub(crate) mod surfaces;
}

/// Features of Bevy and code of games.
mod game {
    mod copies;
    mod despawns;
    mod game_code;
    mod life;
    mod soak;
    mod stock;
}

/// Cameras and what they draw.
mod views {
    mod cameras;
    mod debug;
    mod settings;
    mod visible_flux;
}
