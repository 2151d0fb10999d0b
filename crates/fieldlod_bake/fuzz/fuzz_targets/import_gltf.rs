//! Imports any bytes as a glTF file. Nothing is beside it.
//!
//! `ASAN_OPTIONS=detect_odr_violation=0 cargo +nightly fuzz run import_gltf -- -max_total_time=600`,
//! in `crates/fieldlod_bake`. (meshoptimizer's C++ defines tables of the same name in several
//! files, which the address sanitizer takes for a fault.) To begin with, put some small `.glb`
//! files into `fuzz/corpus/import_gltf`.

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
