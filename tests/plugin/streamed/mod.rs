//! Meshes of `.fieldpages` files.

mod faults;
mod scene;
pub(crate) mod shelf;
mod sources;

use std::sync::LazyLock;
use std::time::Duration;

use bevy::asset::io::AssetSourceBuilder;
use bevy::prelude::*;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, PageOptions, PagedFile};
use fieldlod_tests::apps::finish;
use fieldlod_tests::soak::ClosedSurfaces;

use crate::headless::{
    insert, move_camera, ready, run_until, spawn_camera, stats, unfinished_in, units, visible,
};
use shelf::Shelf;

/// Levels of two rocks of 81,920 triangles.
static ROCKS: LazyLock<BakedFile> = LazyLock::new(|| {
    let bake = |seed| {
        let rock = bake_mesh(&fixtures::rock(6, seed), &BakeConfig::fast()).unwrap();
        BakedPrimitive::new(0, seed, "rock", rock)
    };
    BakedFile {
        primitives: [0, 1].map(bake).into(),
    }
});

/// A file of both rocks with many small pages.
static PAGES: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let options = PageOptions {
        page_bytes: 16 << 10,
        ..PageOptions::default()
    };
    PagedFile::to_bytes(&ROCKS, options)
});

const ROOMY: LodMemory = LodMemory {
    gpu_bytes: 1 << 30,
    main_bytes: 1 << 20,
    keep_unused: Duration::MAX,
};

/// An app with a memory budget that reads from `shelf`, and its camera, which sees whole rocks.
fn app_of(shelf: &Shelf, memory: LodMemory) -> (App, Entity) {
    let mut app = App::new();
    let shelf = shelf.clone();
    let source = AssetSourceBuilder::new(move || Box::new(shelf.clone()));
    app.register_asset_source("shelf", source);
    app_from(app, AssetPlugin::default(), memory)
}

/// [`app_of`] with an app that has asset sources.
fn app_from(app: App, assets: AssetPlugin, memory: LodMemory) -> (App, Entity) {
    let mut app = unfinished_in(app, assets);
    app.insert_resource(FieldLodAppConfig {
        memory,
        ..default()
    });
    finish(&mut app);
    let camera = spawn_camera(&mut app, 3.0);
    (app, camera)
}

fn spawn(app: &mut App, file: &str, primitive: u32) -> Entity {
    let assets = app.world().resource::<AssetServer>();
    let mesh = LodMesh3d::new(assets.load(format!("shelf://{file}")), 0, primitive);
    app.world_mut().spawn(mesh).id()
}

/// One rock of a valid file.
fn one_rock(file: &str, memory: LodMemory) -> (Shelf, App, Entity) {
    let shelf = Shelf::default();
    shelf.put(file, PAGES.clone());
    let (mut app, camera) = app_of(&shelf, memory);
    spawn(&mut app, file, 0);
    ready(&mut app, 1);
    (shelf, app, camera)
}

fn memory(app: &App) -> FieldLodMemory {
    *app.world().resource::<FieldLodMemory>()
}

/// Runs frames until no page is missing.
fn run_until_sharp(app: &mut App) {
    (0..3).for_each(|_| app.update());
    run_until(app, "no page is missing", |app| {
        memory(app).missing_pages == 0 && memory(app).wanted_bytes > 0
    });
    (0..2).for_each(|_| app.update());
}

/// Each unit that a camera draws: its level and triangles, sorted.
fn drawn(app: &App, camera: Entity) -> Vec<(u32, usize)> {
    let (world, meshes) = (app.world(), app.world().resource::<Assets<Mesh>>());
    let visible = visible(app, camera).into_iter();
    let units = visible.filter_map(|entity| {
        let unit = world.get::<LodUnit>(entity)?;
        let mesh = meshes.get(world.get::<Mesh3d>(entity).unwrap());
        let mesh = mesh.expect("a drawn mesh exists");
        Some((unit.level, mesh.indices().unwrap().len() / 3))
    });
    let mut drawn: Vec<(u32, usize)> = units.collect();
    drawn.sort_unstable();
    drawn
}

/// Checks that the units that a camera draws form a closed surface.
fn assert_no_hole(app: &mut App, camera: Entity) {
    let visible = visible(app, camera);
    assert!(!visible.is_empty(), "nothing is drawn");
    let world = app.world_mut();
    world.init_resource::<ClosedSurfaces>();
    world.resource_scope(|world, mut surfaces: Mut<ClosedSurfaces>| {
        surfaces.check(world, &visible);
    });
}

#[test]
fn streamed_mesh_equals_unstreamed_mesh() {
    let shelf = Shelf::default();
    shelf.put("whole.fieldlod", ROCKS.to_bytes());
    shelf.put("parts.fieldpages", PAGES.clone());
    // The second round uses a reader that cannot seek.
    for _ in 0..2 {
        let [whole, parts] = ["whole.fieldlod", "parts.fieldpages"].map(|file| {
            let (mut app, camera) = app_of(&shelf, ROOMY);
            let rock = spawn(&mut app, file, 1);
            ready(&mut app, 1);
            assert_no_hole(&mut app, camera);
            if file == "parts.fieldpages" {
                run_until_sharp(&mut app);
            }
            let state = app.world().get::<LodState>(rock);
            assert_eq!(state, Some(&LodState::Ready(LodKind::Clusters)));
            assert_no_hole(&mut app, camera);
            let stats = stats(&app, camera);
            (
                drawn(&app, camera),
                stats.triangles_drawn,
                stats.triangles_full,
            )
        });
        assert_eq!(whole, parts);
        assert!(whole.0.len() > 10, "{whole:?}");
        shelf.stream_only();
    }
}

/// The bytes of pages that the camera's view needs.
fn wanted_bytes() -> u64 {
    let (_, mut app, _) = one_rock("wanted.fieldpages", ROOMY);
    run_until_sharp(&mut app);
    memory(&app).wanted_bytes
}

/// The budgets are half and a tenth of the bytes that a view needs.
#[test]
fn small_budget_is_kept_without_holes() {
    let wanted = wanted_bytes();
    for share in [2, 10] {
        let budget = LodMemory {
            gpu_bytes: wanted / share,
            main_bytes: 256 << 10,
            ..default()
        };
        let (_, mut app, camera) = one_rock("small.fieldpages", budget);
        let (mut peak, mut loading) = (0, 0);
        let mut frames = |app: &mut App, count: u32| {
            for _ in 0..count {
                app.update();
                let now = memory(app);
                peak = peak.max(now.resident_bytes + now.coming_bytes);
                loading = loading.max(now.loading_bytes);
                assert_no_hole(app, camera);
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
        };
        // Memory and units stay unchanged for two seconds of a game.
        let mut last = (memory(&app), drawn(&app, camera));
        run_until(&mut app, "the memory is steady", |app| {
            frames(app, 120);
            let now = (memory(app), drawn(app, camera));
            std::mem::replace(&mut last, now.clone()) == now
        });
        let before = last.0;
        assert!(
            before.coarsening > 1.0 && before.missing_pages == 0,
            "{before:?}"
        );
        assert!(peak <= budget.gpu_bytes, "{peak} of {budget:?}");
        assert!(loading <= budget.main_bytes, "{loading} of {budget:?}");
        assert!(stats(&app, camera).error_px > 1.0);
        assert!(drawn(&app, camera).len() > 1);
    }
}

#[test]
fn evicted_pages_free_their_meshes() {
    let wanted = wanted_bytes();
    let budget = LodMemory {
        gpu_bytes: wanted * 6 / 5,
        main_bytes: 1 << 20,
        ..default()
    };
    let (_, mut app, camera) = one_rock("walk.fieldpages", budget);
    run_until_sharp(&mut app);
    let fine = drawn(&app, camera);
    // The camera moves near, which evicts pages of the far view, and moves back.
    move_camera(&mut app, camera, 1.6);
    run_until(&mut app, "pages are evicted", |app| {
        assert!(!drawn(app, camera).is_empty());
        let near = memory(app);
        near.evicted_pages > 0 && near.missing_pages == 0
    });
    let near = memory(&app);
    let held = near.resident_bytes + near.coming_bytes;
    assert!(held <= budget.gpu_bytes, "{near:?}");
    // Only resident pages and the coarsest level have meshes.
    let meshes = app.world().resource::<Assets<Mesh>>();
    let bytes = |mesh: &Mesh| mesh.get_vertex_size() as usize * mesh.count_vertices();
    let there: usize = meshes.iter().map(|(_, mesh)| bytes(mesh)).sum();
    assert!((there as u64) < budget.gpu_bytes * 5 / 4, "{there}");
    move_camera(&mut app, camera, 3.0);
    run_until(&mut app, "the first cut is drawn", |app| {
        drawn(app, camera) == fine
    });
}

#[test]
fn forced_level_0_streams_full_detail() {
    let (_, mut app, camera) = one_rock("full.fieldpages", ROOMY);
    let full = FieldLodCamera::at_level(0);
    insert(&mut app, camera, full);
    run_until_sharp(&mut app);
    let all = stats(&app, camera);
    assert_eq!(all.triangles_drawn, 81_920);
    assert_eq!(all.triangles_full, 81_920);
    assert!(drawn(&app, camera).iter().all(|(level, _)| *level == 0));
    assert_no_hole(&mut app, camera);
}

/// There is no light, so the reason is not a shadow.
#[test]
fn streamed_mesh_behind_camera_keeps_detail() {
    let (_, mut app, camera) = one_rock("behind.fieldpages", ROOMY);
    run_until_sharp(&mut app);
    let coarsest = ROCKS.primitives[0].hierarchy.units.last().unwrap();
    let mut pose = app.world_mut().get_mut::<Transform>(camera).unwrap();
    pose.rotate_y(std::f32::consts::PI);
    run_until_sharp(&mut app);
    let behind = stats(&app, camera).triangles_drawn;
    assert!(behind > 4 * u64::from(coarsest.triangle_count), "{behind}");
}

#[test]
fn despawned_mesh_frees_its_pages() {
    let shelf = Shelf::default();
    shelf.put("gone.fieldpages", PAGES.clone());
    let (mut app, _) = app_of(&shelf, ROOMY);
    app.update();
    let meshes = |app: &App| app.world().resource::<Assets<Mesh>>().len();
    let before = meshes(&app);
    let rock = spawn(&mut app, "gone.fieldpages", 0);
    ready(&mut app, 1);
    run_until_sharp(&mut app);
    assert!(meshes(&app) > before + 10);
    app.world_mut().despawn(rock);
    run_until(&mut app, "all pages are freed", |app| {
        memory(app).resident_bytes == 0 && memory(app).coarsening == 1.0
    });
    assert!(units(&mut app).is_empty());
    run_until(&mut app, "no mesh is left", |app| meshes(app) == before);
}

#[test]
fn fieldpages_file_needs_lod_mesh_3d() {
    let shelf = Shelf::default();
    shelf.put("beside.fieldpages", PAGES.clone());
    let (mut app, _) = app_of(&shelf, ROOMY);
    let file = app
        .world()
        .resource::<AssetServer>()
        .load("shelf://beside.fieldpages");
    let rock = crate::headless::spawn_rock(&mut app, 5);
    insert(&mut app, rock, AutoLod::from_file(file));
    run_until(&mut app, "it is plain", |app| {
        crate::headless::progress(app).plain == 1
    });
    assert!(crate::headless::logged(
        bevy::log::tracing::Level::ERROR,
        &["beside.fieldpages", "LodMesh3d"]
    ));
}

#[test]
fn view_reports_missing_pieces() {
    let (shelf, mut app, camera) = one_rock("missing.fieldpages", ROOMY);
    run_until_sharp(&mut app);
    shelf.stall(true);
    move_camera(&mut app, camera, 1.5);
    (0..3).for_each(|_| app.update());
    let while_missing = stats(&app, camera);
    assert!(while_missing.missing_pieces > 0 && while_missing.missing_px > 1.0);
    shelf.stall(false);
    run_until(&mut app, "nothing is missing", |app| {
        stats(app, camera).missing_pieces == 0
    });
}
