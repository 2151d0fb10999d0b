//! Decodes arbitrary bytes as a `.fieldlod` file: unchanged, and with matching checksums.
//!
//! Run `cargo +nightly fuzz run read_file -- -max_total_time=600` in `crates/fieldlod_hierarchy`. A stable
//! compiler needs `RUSTC_BOOTSTRAP=1 cargo fuzz run read_file -s none -- -max_total_time=600`. Files of
//! `fieldlod bake` in `fuzz/corpus/read_file` are good seeds.

#![no_main]

use fieldlod_hierarchy::BakedFile;
use libfuzzer_sys::fuzz_target;

#[path = "../../tests/suite/common.rs"]
mod common;

fuzz_target!(|bytes: &[u8]| {
    read(bytes);
    read(&common::sealed(bytes.to_vec()));
});

fn read(bytes: &[u8]) {
    if let Ok(file) = BakedFile::from_bytes(bytes) {
        let again = BakedFile::from_bytes(&file.to_bytes());
        assert_eq!(again.unwrap().primitives.len(), file.primitives.len());
    }
}
