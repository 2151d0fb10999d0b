//! Scenes that name a `.fieldpages` file, as `fieldlod bake --scene` writes them.

use bevy::gltf::GltfAssetLabel;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::fixtures;
use serde_json::json;

use super::shelf::Shelf;
use super::{PAGES, ROOMY, app_of, assert_no_hole, drawn, memory, run_until_sharp};
use crate::gltf_file::GltfFile;
use crate::headless::{ready, run_until, stats};

#[test]
fn scene_streams_meshes_named_in_extras() {
    let shelf = Shelf::default();
    // A rock of 20 triangles in place of one of 81,920.
    let mut scene = GltfFile::of(&fixtures::rock(0, 1));
    scene.primitive()["extras"] = json!({
        "of": "the game",
        "fieldlod": { "pages": "large.fieldpages", "mesh": 0, "primitive": 1 },
    });
    scene.primitive()["material"] = json!(0);
    scene.json["materials"] = json!([{ "name": "stone" }]);
    scene.json["nodes"] = json!([{ "mesh": 0, "name": "rock" }]);
    scene.json["scenes"] = json!([{ "nodes": [0] }]);
    shelf.put("world/scene.glb", scene.glb_bytes());
    shelf.put("world/large.fieldpages", PAGES.clone());
    let (mut app, camera) = app_of(&shelf, ROOMY);
    let path = GltfAssetLabel::Scene(0).from_asset("shelf://world/scene.glb");
    let scene = app.world().resource::<AssetServer>().load(path);
    let finer = AutoLod {
        bias: 2.0,
        ..default()
    };
    let root = app.world_mut().spawn((WorldAssetRoot(scene), finer)).id();
    ready(&mut app, 1);
    run_until_sharp(&mut app);
    assert_no_hole(&mut app, camera);
    assert!(memory(&app).loaded_pages > 3);
    assert_eq!(stats(&app, camera).triangles_full, 81_920);
    let mut meshes = app.world_mut().query::<(Entity, &LodMesh3d)>();
    let (rock, mesh) = meshes.single(app.world()).unwrap();
    assert_eq!((mesh.mesh_index, mesh.primitive_index), (0, 1));
    let rock = app.world().entity(rock);
    assert!(rock.contains::<MeshMaterial3d<StandardMaterial>>());
    // The `AutoLod` of the scene is removed, then replaced.
    let fine = stats(&app, camera).triangles_drawn;
    app.world_mut().entity_mut(root).remove::<AutoLod>();
    run_until(&mut app, "it has no levels", |app| {
        drawn(app, camera).is_empty()
    });
    app.world_mut().entity_mut(root).insert(AutoLod {
        bias: 0.25,
        ..default()
    });
    ready(&mut app, 1);
    run_until_sharp(&mut app);
    let coarse = stats(&app, camera).triangles_drawn;
    assert!((1..fine / 2).contains(&coarse), "{coarse} of {fine}");
}
