//! Tests of the measurements and of the command.

mod baselines;
#[path = "../../../fieldlod_bake/tests/common/character.rs"]
mod character;
mod characters;
mod chart;
mod common;
#[path = "../../../fieldlod_bake/tests/common/gltf_file.rs"]
#[expect(
    dead_code,
    reason = "shared with the suites of the baker, which use more of it"
)]
mod gltf_file;
mod promise;
mod props;
mod render;
mod scenes;
mod stability;
