//! Corrupt, slow and removed files: valid pages are drawn, and one line of the log has file and fault.

use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::LodError;
use bevy_fieldlod::prelude::*;
use fieldlod_hierarchy::{FileError, PagedFile};

use super::shelf::Shelf;
use super::{
    PAGES, ROOMY, app_of, assert_no_hole, drawn, memory, one_rock, run_until_sharp, spawn,
};
use crate::headless::{failures, logged_times, move_camera, ready, run_until};

/// Runs frames until `count` reads have failed, and some more.
fn run_until_failed(app: &mut App, camera: Entity, count: u64) {
    run_until(app, "pages fail", |app| memory(app).failures >= count);
    for _ in 0..30 {
        app.update();
        assert_no_hole(app, camera);
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

/// The pages of the first rock, except the first page.
fn finer_pages() -> Vec<std::ops::Range<usize>> {
    let file = PagedFile::from_contents(&PAGES).unwrap();
    let pages = file.meshes[0].pages[1..].iter();
    pages
        .map(|page| page.bytes.start as usize..page.bytes.end as usize)
        .collect()
}

#[test]
fn corrupt_page_falls_back_to_coarser() {
    let (shelf, mut bytes) = (Shelf::default(), PAGES.clone());
    // The second and the third finer page: others depend on them.
    for page in &finer_pages()[1..3] {
        bytes[page.start + page.len() / 2] ^= 0x10;
    }
    shelf.put("corrupt.fieldpages", bytes);
    let (mut app, camera) = app_of(&shelf, ROOMY);
    spawn(&mut app, "corrupt.fieldpages", 0);
    ready(&mut app, 1);
    run_until_failed(&mut app, camera, 2);
    assert!(memory(&app).loaded_pages > 1, "{:?}", memory(&app));
    assert!(memory(&app).missing_pages > 0);
    let lines = logged_times(Level::ERROR, &["shelf://corrupt.fieldpages", "checksum"]);
    assert_eq!(lines, 1);
    // Reads are retried.
    shelf.put("corrupt.fieldpages", PAGES.clone());
    run_until(&mut app, "no page is missing", |app| {
        memory(app).missing_pages == 0
    });
}

#[test]
fn corrupt_first_page_fails_its_mesh_only() {
    let (shelf, mut bytes) = (Shelf::default(), PAGES.clone());
    let file = PagedFile::from_contents(&PAGES).unwrap();
    bytes[file.meshes[0].pages[0].bytes.start as usize + 9] ^= 0x10;
    shelf.put("coarsest.fieldpages", bytes);
    let (mut app, camera) = app_of(&shelf, ROOMY);
    spawn(&mut app, "coarsest.fieldpages", 0);
    spawn(&mut app, "coarsest.fieldpages", 1);
    ready(&mut app, 1);
    run_until_sharp(&mut app);
    assert_no_hole(&mut app, camera);
    let file = "shelf://coarsest.fieldpages";
    let failures = failures(&app);
    let unreadable = LodError::Unreadable {
        file: file.into(),
        fault: FileError::Checksum,
    };
    assert_eq!(failures, [unreadable]);
    assert_eq!(logged_times(Level::ERROR, &[file, "checksum"]), 1);
}

#[test]
fn truncated_file_is_drawn_up_to_its_end() {
    let (shelf, mut bytes) = (Shelf::default(), PAGES.clone());
    bytes.truncate(finer_pages()[5].start + 100);
    shelf.put("short.fieldpages", bytes);
    let (mut app, camera) = app_of(&shelf, ROOMY);
    spawn(&mut app, "short.fieldpages", 0);
    ready(&mut app, 1);
    run_until_failed(&mut app, camera, 1);
    assert!(memory(&app).loaded_pages > 3, "{:?}", memory(&app));
    let lines = logged_times(Level::ERROR, &["shelf://short.fieldpages", "truncated"]);
    assert_eq!(lines, 1);
}

#[test]
fn removed_file_keeps_its_loaded_pages() {
    let (shelf, mut app, camera) = one_rock("going.fieldpages", ROOMY);
    run_until_sharp(&mut app);
    let before = drawn(&app, camera);
    shelf.remove("going.fieldpages");
    move_camera(&mut app, camera, 2.7);
    run_until_failed(&mut app, camera, 1);
    assert!(drawn(&app, camera).len() >= before.len());
    let lines = logged_times(Level::ERROR, &["shelf://going.fieldpages", "not found"]);
    assert_eq!(lines, 1);
}

#[test]
fn replaced_file_is_never_mixed() {
    let (shelf, mut app, camera) = one_rock("new.fieldpages", ROOMY);
    // A file with the other rock first, at other offsets.
    let mut other = super::ROCKS.clone();
    other.primitives.swap(0, 1);
    for (index, primitive) in (0..).zip(&mut other.primitives) {
        primitive.primitive_index = index;
    }
    let options = fieldlod_hierarchy::PageOptions {
        page_bytes: 16 << 10,
        ..Default::default()
    };
    let other = PagedFile::to_bytes(&other, options);
    shelf.put("new.fieldpages", other.clone());
    run_until_failed(&mut app, camera, 1);
    let lines = logged_times(Level::ERROR, &["shelf://new.fieldpages", "checksum"]);
    assert_eq!(lines, 1);
    // After a reload, the other rock is drawn as in an app without the first.
    app.world()
        .resource::<AssetServer>()
        .reload("shelf://new.fieldpages");
    run_until(&mut app, "it is reloaded", |app| {
        memory(app).failures == 0 || memory(app).missing_pages == 0
    });
    shelf.put("alone.fieldpages", other);
    let (mut alone, its_camera) = app_of(&shelf, ROOMY);
    spawn(&mut alone, "alone.fieldpages", 0);
    ready(&mut alone, 1);
    run_until_sharp(&mut alone);
    let expected = drawn(&alone, its_camera);
    run_until(&mut app, "the other is drawn", |app| {
        drawn(app, camera) == expected
    });
    assert_no_hole(&mut app, camera);
}

#[test]
fn stalled_reader_blocks_no_frame() {
    let (shelf, mut app, camera) = one_rock("slow.fieldpages", ROOMY);
    shelf.stall(true);
    let coarse = drawn(&app, camera);
    let mut frames = 0;
    let file = "shelf://slow.fieldpages";
    move_camera(&mut app, camera, 2.5);
    run_until(&mut app, "the warning is logged", |app| {
        assert_no_hole(app, camera);
        frames += 1;
        logged_times(Level::WARN, &[file, "could not read page"]) > 0
    });
    assert!(frames > 10, "{frames} frames while the reader blocks");
    for _ in 0..50 {
        app.update();
    }
    assert_eq!(logged_times(Level::WARN, &[file, "could not read page"]), 1);
    assert!(memory(&app).missing_pages > 0);
    shelf.stall(false);
    run_until_sharp(&mut app);
    assert!(drawn(&app, camera).len() > coarse.len());
}

#[test]
fn coarsest_levels_exceed_tiny_budget() {
    let tiny = LodMemory {
        gpu_bytes: 100,
        main_bytes: 100,
        ..default()
    };
    let (_, mut app, camera) = one_rock("tiny.fieldpages", tiny);
    for _ in 0..50 {
        app.update();
        assert_no_hole(&mut app, camera);
    }
    assert_eq!(memory(&app).loaded_pages, 1);
    assert!(!drawn(&app, camera).is_empty());
    assert!(logged_times(Level::WARN, &["coarsest levels", "100 bytes"]) > 0);
}
