//! Plants far away are drawn as cards, where their material allows it.

use std::sync::Arc;

use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{BakedLods, LodSimplified};
use fieldlod_bake::{SourceMesh, Surface, SurfaceAlpha, bake_mesh};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive};
use fieldlod_tests::apps::{bevy_mesh, with_cards};

use crate::headless::{add, app, insert, move_camera, origins, ready, spawn_camera, stats, units};

const NEAR: f32 = 3.0;
const FAR: f32 = 120.0;

fn crown() -> Mesh {
    bevy_mesh(&fieldlod_tests::crown(600, 3))
}

fn green() -> StandardMaterial {
    StandardMaterial::from(Color::linear_rgb(0.2, 0.5, 0.1))
}

/// A plant with a material, and a camera far away.
fn far_plant(material: StandardMaterial) -> (App, Entity, Entity) {
    let mut app = app();
    let camera = spawn_camera(&mut app, FAR);
    let plant = spawn(&mut app, material);
    ready(&mut app, 1);
    app.update();
    (app, camera, plant)
}

fn spawn(app: &mut App, material: StandardMaterial) -> Entity {
    let (mesh, material) = (add(app, crown()), add(app, material));
    let plant = (Mesh3d(mesh), MeshMaterial3d(material), with_cards());
    app.world_mut().spawn(plant).id()
}

fn component_count(app: &App, plant: Entity) -> usize {
    app.world().entity(plant).archetype().component_count()
}

/// Whether what an entity draws are cards: the source has no tangents.
fn draws_cards(app: &App, plant: Entity) -> bool {
    let mesh = app.world().get::<Mesh3d>(plant).unwrap();
    let meshes = app.world().resource::<Assets<Mesh>>();
    meshes
        .get(mesh)
        .unwrap()
        .contains_attribute(Mesh::ATTRIBUTE_TANGENT)
}

fn material_of(app: &App, plant: Entity) -> AssetId<StandardMaterial> {
    app.world()
        .get::<MeshMaterial3d<StandardMaterial>>(plant)
        .unwrap()
        .id()
}

#[test]
fn a_plant_far_away_is_cards_and_keeps_its_material() {
    let mut app = app();
    let camera = spawn_camera(&mut app, FAR);
    let plant = spawn(&mut app, green());
    app.world_mut().entity_mut(plant).remove::<AutoLod>();
    app.update();
    let before = component_count(&app, plant);
    insert(&mut app, plant, with_cards());
    ready(&mut app, 1);
    app.update();
    let material = material_of(&app, plant);
    assert!(draws_cards(&app, plant));
    let far = stats(&app, camera);
    assert!(far.triangles_drawn <= 128, "{far:?}");
    move_camera(&mut app, camera, NEAR);
    assert!(!draws_cards(&app, plant));
    move_camera(&mut app, camera, FAR);
    assert!(draws_cards(&app, plant));
    assert_eq!(material_of(&app, plant), material);
    // What was put on is taken off.
    app.world_mut().entity_mut(plant).remove::<AutoLod>();
    app.update();
    assert!(!draws_cards(&app, plant));
    assert_eq!(component_count(&app, plant), before);
}

#[test]
fn what_pictures_cannot_stand_for_is_drawn_with_triangles() {
    let image = Handle::<Image>::default();
    let glowing = StandardMaterial {
        emissive_texture: Some(image),
        ..green()
    };
    let clear = StandardMaterial {
        alpha_mode: AlphaMode::Blend,
        ..green()
    };
    for material in [glowing, clear] {
        let (app, camera, plant) = far_plant(material);
        assert!(!draws_cards(&app, plant));
        let far = stats(&app, camera);
        assert!(far.triangles_drawn * 10 < far.triangles_full, "{far:?}");
    }
}

#[test]
fn a_material_decides_at_any_time_whether_its_plants_are_cards() {
    let (mut app, camera, plant) = far_plant(green());
    assert!(draws_cards(&app, plant));
    let id = material_of(&app, plant);
    let set = |app: &mut App, alpha_mode: AlphaMode| {
        let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
        materials.get_mut(id).unwrap().alpha_mode = alpha_mode;
        (0..3).for_each(|_| app.update());
    };
    set(&mut app, AlphaMode::Blend);
    assert!(!draws_cards(&app, plant));
    let coarse = stats(&app, camera);
    assert!(coarse.triangles_drawn < coarse.triangles_full, "{coarse:?}");
    set(&mut app, AlphaMode::Mask(0.4));
    assert!(draws_cards(&app, plant));
    let clear = add(
        &mut app,
        StandardMaterial {
            alpha_mode: AlphaMode::Blend,
            ..green()
        },
    );
    insert(&mut app, plant, MeshMaterial3d(clear));
    (0..3).for_each(|_| app.update());
    assert!(!draws_cards(&app, plant));
    app.world_mut()
        .entity_mut(plant)
        .remove::<MeshMaterial3d<StandardMaterial>>();
    (0..3).for_each(|_| app.update());
    assert!(!draws_cards(&app, plant));
}

#[test]
fn rays_and_physics_get_triangles() {
    let mut app = app();
    spawn_camera(&mut app, FAR);
    let plant = spawn(&mut app, green());
    let coarse = AutoLod {
        simplified_level: Some(99),
        ..with_cards()
    };
    insert(&mut app, plant, coarse);
    ready(&mut app, 1);
    assert!(draws_cards(&app, plant));
    let simplified = app.world().get::<LodSimplified>(plant).unwrap();
    let mesh = app.world().resource::<Assets<Mesh>>().get(&simplified.mesh);
    // Corners of cards are used by two triangles at most, those of the surface by more.
    let mesh = mesh.unwrap();
    let corners = mesh.indices().unwrap().len();
    assert!(corners > 2 * mesh.count_vertices(), "{corners}");
}

#[test]
fn nothing_is_cards_unless_asked_for() {
    let (mut app, _, plant) = far_plant(green());
    assert!(draws_cards(&app, plant));
    let plain = AutoLod {
        bake: None,
        ..with_cards()
    };
    insert(&mut app, plant, plain);
    app.update();
    ready(&mut app, 1);
    assert!(!draws_cards(&app, plant));
}

/// A baked crown with levels of cards.
fn file_of_cards() -> BakedLods {
    let config = with_cards().bake.unwrap();
    let mesh = SourceMesh {
        surface: Some(Arc::new(Surface::new(Vec4::ONE, SurfaceAlpha::Opaque))),
        // As that of the entities.
        colors: Vec::new(),
        ..fieldlod_tests::crown(600, 3)
    };
    let baked = bake_mesh(&mesh, &config).unwrap();
    assert!(baked.cards.is_some());
    let primitives = vec![BakedPrimitive::new(0, 0, "crown", baked)];
    BakedLods::new(Arc::new(BakedFile { primitives }))
}

#[test]
fn what_is_drawn_in_pieces_has_no_cards() {
    let mut app = app();
    let camera = spawn_camera(&mut app, NEAR);
    let file = add(&mut app, file_of_cards());
    let plant = spawn(&mut app, green());
    let of = |kind| AutoLod {
        kind,
        baked: Some(file.clone()),
        bake: None,
        ..with_cards()
    };
    insert(&mut app, plant, of(LodKind::Clusters));
    ready(&mut app, 1);
    for distance in [FAR, NEAR] {
        move_camera(&mut app, camera, distance);
        let own = material_of(&app, plant);
        let units = units(&mut app);
        assert!(!units.is_empty());
        assert!(units.iter().all(|unit| material_of(&app, *unit) == own));
    }
    // As a whole it has those of the file.
    insert(&mut app, plant, of(LodKind::WholeMesh));
    app.update();
    ready(&mut app, 1);
    move_camera(&mut app, camera, FAR);
    assert!(draws_cards(&app, plant));
}

/// The first entity of a mesh does not decide for all.
#[test]
fn a_plant_is_cards_though_another_of_its_mesh_blends() {
    let mut app = app();
    spawn_camera(&mut app, FAR);
    let file = add(&mut app, file_of_cards());
    let clear = StandardMaterial {
        alpha_mode: AlphaMode::Blend,
        ..green()
    };
    let mesh = add(&mut app, crown());
    let mut spawn = |material| {
        let material = MeshMaterial3d(add(&mut app, material));
        let lod = AutoLod {
            baked: Some(file.clone()),
            bake: None,
            ..with_cards()
        };
        let plant = (Mesh3d(mesh.clone()), material, lod);
        app.world_mut().spawn(plant).id()
    };
    let (blended, plain) = (spawn(clear), spawn(green()));
    ready(&mut app, 2);
    app.update();
    assert!(draws_cards(&app, plain) && !draws_cards(&app, blended));
}

/// Nor are cards baked that nothing is drawn as, or triangles missing that stand in their place.
#[test]
fn what_is_no_cards_from_the_first_has_all_levels_of_triangles() {
    let triangles_of = |spoil: &dyn Fn(&mut App, Entity)| {
        let mut app = app();
        let camera = spawn_camera(&mut app, FAR);
        let plant = spawn(&mut app, green());
        spoil(&mut app, plant);
        ready(&mut app, 1);
        app.update();
        assert!(!draws_cards(&app, plant));
        assert_eq!(origins(&app).len(), 1);
        stats(&app, camera).triangles_drawn
    };
    let without = triangles_of(&|app, plant| {
        let plain = AutoLod {
            bake: None,
            ..with_cards()
        };
        insert(app, plant, plain);
    });
    let with_lightmap = triangles_of(&|app, plant| {
        let image = add(app, Image::default());
        insert(app, plant, Lightmap { image, ..default() });
    });
    let that_blends = triangles_of(&|app, plant| {
        let id = material_of(app, plant);
        let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
        materials.get_mut(id).unwrap().alpha_mode = AlphaMode::Blend;
    });
    assert_eq!((with_lightmap, that_blends), (without, without));
}

#[test]
fn cards_follow_a_material_that_was_taken_out_and_put_back() {
    let (mut app, _, plant) = far_plant(green());
    let id = material_of(&app, plant);
    let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    let mut own = materials.remove(id).unwrap();
    own.alpha_mode = AlphaMode::Blend;
    materials.insert(id, own).unwrap();
    (0..3).for_each(|_| app.update());
    assert!(!draws_cards(&app, plant));
}

#[test]
fn a_lightmap_has_no_place_on_cards() {
    let (mut app, _, plant) = far_plant(green());
    let image = add(&mut app, Image::default());
    insert(&mut app, plant, Lightmap { image, ..default() });
    (0..2).for_each(|_| app.update());
    assert!(!draws_cards(&app, plant));
    app.world_mut().entity_mut(plant).remove::<Lightmap>();
    (0..2).for_each(|_| app.update());
    assert!(draws_cards(&app, plant));
}

/// What no view sees stays as it is, but for cards that nothing draws as such any more.
#[test]
fn a_hidden_plant_is_no_cards_without_their_material() {
    let (mut app, _, plant) = far_plant(green());
    insert(&mut app, plant, Visibility::Hidden);
    (0..2).for_each(|_| app.update());
    assert!(draws_cards(&app, plant));
    let later = app.world().resource::<Assets<StandardMaterial>>();
    let later = later.reserve_handle();
    insert(&mut app, plant, MeshMaterial3d(later.clone()));
    (0..2).for_each(|_| app.update());
    assert!(!draws_cards(&app, plant));
    let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    materials.insert(&later, green()).unwrap();
    insert(&mut app, plant, Visibility::Inherited);
    (0..3).for_each(|_| app.update());
    assert!(draws_cards(&app, plant));
}
