//! A world in which anything happens at any time, for as long as one likes, checked in every frame.
//!
//! Run with `cargo bench -p fieldlod_tests --bench soak -- SECONDS`; without a number it is one minute.

use std::time::{Duration, Instant};

use fieldlod_tests::soak::Soak;

fn main() {
    let seconds = std::env::args().find_map(|arg| arg.parse().ok());
    let deadline = Instant::now() + Duration::from_secs(seconds.unwrap_or(60));
    let mut soak = Soak::new(1);
    let before = soak.counts();
    let mut frames = 0u64;
    let mut used_mb = Vec::new();
    while Instant::now() < deadline {
        soak.fill();
        for _ in 0..2000 {
            soak.step();
        }
        frames += 2000;
        soak.clear();
        assert_eq!(soak.counts(), before, "after {frames} frames");
        used_mb.push(memory_in_use_mb());
        println!("{frames} frames, {} MB in use", memory_in_use_mb());
    }
    // What allocators keep settles in the first rounds.
    if let [_, _, settled, .., last] = used_mb[..] {
        assert!(
            last * 10 <= settled * 11,
            "{settled} MB have become {last} MB"
        );
    }
}

/// What the process has in memory; 0 where the system does not tell.
fn memory_in_use_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kb = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kb.unwrap_or_default() / 1024
}
