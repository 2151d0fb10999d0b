//! Reads any bytes as a `.fieldlod` file: as they are, and with all checksums made to fit, so that
//! what lies behind them is reached.
//!
//! `cargo +nightly fuzz run read_file -- -max_total_time=600`, in `crates/fieldlod_hierarchy`. (Or
//! `RUSTC_BOOTSTRAP=1 cargo fuzz run read_file -s none -- -max_total_time=600` with a stable compiler.) To
//! begin with, put some files written by `fieldlod bake` into `fuzz/corpus/read_file`.

#![no_main]

use fieldlod_hierarchy::BakedFile;
use libfuzzer_sys::fuzz_target;

#[path = "../../tests/common/mod.rs"]
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
    let _ = BakedFile::from_bytes_coarse(bytes, 1);
}
