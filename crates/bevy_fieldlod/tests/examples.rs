//! Every example draws a picture that shows something, except the one without a renderer.
//!
//! Without an adapter, this test prints a line and passes. It fails if `FIELDLOD_REQUIRE_ADAPTER` is set, as in
//! continuous integration.

use std::collections::HashMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use image::RgbImage;

/// The message that Bevy prints without an adapter.
const NO_ADAPTER: &str = "Unable to find a GPU";

/// The example without a renderer.
const HEADLESS: &str = "headless";

#[test]
fn every_example_draws_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let names = example_names();
    assert!(names.len() > 5, "{names:?}");
    // Two examples run at a time, because most of an example's start uses one core.
    let (half, rest) = names.split_at(names.len() / 2);
    std::thread::scope(|scope| {
        for names in [half, rest] {
            scope.spawn(|| names.iter().all(|name| draw(name, folder.path())));
        }
    });
}

/// The examples that draw, and are built with the features of this test.
fn example_names() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let paths = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let sources = paths.filter(|path| path.extension().is_some_and(|extension| extension == "rs"));
    let names = sources.map(|path| path.file_stem().unwrap().to_string_lossy().into_owned());
    let mut names: Vec<_> = names.collect();
    names.retain(|name| cfg!(feature = "debug") || name != "debug_view");
    names.retain(|name| name != HEADLESS);
    names.sort();
    names
}

#[test]
fn headless_example_selects_coarser_levels_with_distance() {
    let output = Command::new(program(HEADLESS)).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let drawn = text.lines().filter_map(|line| {
        let (_, counts) = line.split_once(" m: ")?;
        counts.split(' ').next()?.parse().ok()
    });
    let drawn: Vec<u32> = drawn.collect();
    assert_eq!(drawn.len(), 3, "{text}");
    assert!(drawn.is_sorted_by(|near, far| near > far), "{drawn:?}");
}

/// Runs an example and checks its picture. Returns `false` if there is no adapter.
fn draw(name: &str, folder: &Path) -> bool {
    let program = program(name);
    assert!(
        program.is_file(),
        "`cargo build --examples` makes {}",
        program.display()
    );
    let picture = folder.join(name).with_extension("png");
    let output = Command::new(program)
        .arg("--picture")
        .arg(&picture)
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    if log.contains(NO_ADAPTER) {
        let is_required = std::env::var_os("FIELDLOD_REQUIRE_ADAPTER").is_some();
        assert!(
            !is_required,
            "no Vulkan adapter: install mesa-vulkan-drivers"
        );
        // The test harness hides the output of `eprintln!` when a test passes.
        let line = "SKIPPED: no Vulkan adapter; the Debian package mesa-vulkan-drivers has one\n";
        std::io::stderr().write_all(line.as_bytes()).unwrap();
        return false;
    }
    assert!(
        output.status.success() && !log.contains("ERROR"),
        "{name}: {log}"
    );
    let picture = image::open(&picture).unwrap().into_rgb8();
    let share = share_beside_background(&picture);
    assert!(
        share > 0.05,
        "{name}: only {share} of the picture is not background"
    );
    true
}

/// The program that cargo builds beside the tests.
fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let examples = test.ancestors().nth(2).unwrap().join("examples");
    examples
        .join(name)
        .with_extension(std::env::consts::EXE_EXTENSION)
}

/// The share of pixels that differ from the most frequent colour by more than rounding.
fn share_beside_background(picture: &RgbImage) -> f32 {
    let mut counts = HashMap::new();
    for pixel in picture.pixels() {
        *counts.entry(pixel.0).or_insert(0u32) += 1;
    }
    let (background, _) = counts.into_iter().max_by_key(|(_, count)| *count).unwrap();
    let differs = |pixel: &&image::Rgb<u8>| {
        pixel
            .0
            .iter()
            .zip(background)
            .any(|(a, b)| a.abs_diff(b) > 8)
    };
    let others = picture.pixels().filter(differs).count();
    others as f32 / (picture.width() * picture.height()) as f32
}
