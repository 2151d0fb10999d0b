//! Imports arbitrary bytes as a glTF file without other files.
//!
//! Run `ASAN_OPTIONS=detect_odr_violation=0 cargo +nightly fuzz run import_gltf -- -max_total_time=600` in
//! `crates/fieldlod_bake`. The option is needed because several C++ files of meshoptimizer define tables of the same
//! name. Small `.glb` files in `fuzz/corpus/import_gltf` are good seeds.

#![no_main]

use std::io::ErrorKind;

use fieldlod_bake::import_gltf_bytes;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(import) = import_gltf_bytes(bytes, &|_| Err(ErrorKind::NotFound.into())) {
        for primitive in import.primitives {
            let _ = primitive.mesh.validate();
        }
    }
});
