//! Files in the asset folder, which the plugin reads without Bevy's reader.

use std::path::Path;

use bevy::asset::io::{AssetSourceBuilder, AssetSourceId};
use bevy::log::tracing::Level;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;

use super::shelf::Shelf;
use super::{PAGES, ROOMY, app_from, assert_no_hole, drawn, memory, one_rock, run_until_sharp};
use crate::headless::{logged_times, move_camera, ready, run_until};

/// An app with a file in its asset folder and a shelf as its default source, and its camera.
fn rock_in(folder: &Path, file: &str, shelf: &Shelf) -> (App, Entity) {
    let mut app = App::new();
    let shelf = shelf.clone();
    let source = AssetSourceBuilder::new(move || Box::new(shelf.clone()));
    app.register_asset_source(AssetSourceId::Default, source);
    let assets = AssetPlugin {
        file_path: folder.display().to_string(),
        ..default()
    };
    let (mut app, camera) = app_from(app, assets, ROOMY);
    let mesh = app.world().resource::<AssetServer>().load(file.to_owned());
    app.world_mut().spawn(LodMesh3d::new(mesh, 0, 0));
    ready(&mut app, 1);
    run_until_sharp(&mut app);
    (app, camera)
}

#[test]
fn asset_folder_file_is_read_in_parts() {
    let (_, mut other, its_camera) = one_rock("other.fieldpages", ROOMY);
    run_until_sharp(&mut other);
    let (folder, shelf) = (tempfile::tempdir().unwrap(), Shelf::default());
    let path = folder.path().join("of-folder.fieldpages");
    std::fs::write(&path, &*PAGES).unwrap();
    shelf.put("of-folder.fieldpages", PAGES.clone());
    let (mut app, camera) = rock_in(folder.path(), "of-folder.fieldpages", &shelf);
    assert_eq!(drawn(&app, camera), drawn(&other, its_camera));
    assert_no_hole(&mut app, camera);
    // Of the file on the shelf, the plugin reads only the last 64 bytes, to compare them with the file in the folder.
    assert_eq!(shelf.bytes_read(), 64);
    // A truncated file is logged, and drawn again once it is whole.
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    file.set_len(PAGES.len() as u64 / 4).unwrap();
    move_camera(&mut app, camera, 2.5);
    run_until(&mut app, "the error is logged", |app| {
        assert_no_hole(app, camera);
        logged_times(Level::ERROR, &["of-folder.fieldpages", "truncated"]) == 1
    });
    std::fs::write(&path, &*PAGES).unwrap();
    run_until(&mut app, "no page is missing", |app| {
        memory(app).missing_pages == 0
    });
}
