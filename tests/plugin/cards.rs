//! Plants far away are drawn as cards, where their material allows it.

use std::sync::{Arc, LazyLock};

use bevy::camera::primitives::Aabb;
use bevy::math::Vec3A;
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{BakedLods, LodSimplified, LodSource};
use fieldlod_bake::{SourceMesh, Surface, SurfaceAlpha, bake_mesh};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy};
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

/// Triangles of the mesh that an entity draws, and of its source.
fn triangles_of_meshes(app: &App, plant: Entity) -> [usize; 2] {
    let plant = app.world().entity(plant);
    let meshes = app.world().resource::<Assets<Mesh>>();
    let handles = [
        &plant.get::<Mesh3d>().unwrap().0,
        &plant.get::<LodSource>().unwrap().mesh,
    ];
    handles.map(|mesh| meshes.get(mesh).unwrap().indices().unwrap().len() / 3)
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

/// A crown with levels of cards.
static BAKED_CROWN: LazyLock<Hierarchy> = LazyLock::new(|| {
    let config = with_cards().bake.unwrap();
    let mesh = SourceMesh {
        surface: Some(Arc::new(Surface::new(Vec4::ONE, SurfaceAlpha::Opaque))),
        // As that of the entities.
        colors: Vec::new(),
        ..fieldlod_tests::crown(600, 3)
    };
    let baked = bake_mesh(&mesh, &config).unwrap();
    assert!(baked.cards.is_some());
    baked
});

/// The same without them.
fn baked_without_cards() -> Hierarchy {
    Hierarchy {
        cards: None,
        ..BAKED_CROWN.clone()
    }
}

fn file_of(baked: &Hierarchy) -> BakedLods {
    let primitives = vec![BakedPrimitive::new(0, 0, "crown", baked.clone())];
    BakedLods::new(Arc::new(BakedFile { primitives }))
}

#[test]
fn what_is_drawn_in_pieces_has_no_cards() {
    let mut app = app();
    let camera = spawn_camera(&mut app, NEAR);
    let file = add(&mut app, file_of(&BAKED_CROWN));
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
    let file = add(&mut app, file_of(&BAKED_CROWN));
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
    let [drawn, full] = triangles_of_meshes(&app, plant);
    assert!(drawn * 10 < full, "{drawn} of {full}");
    let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    materials.insert(&later, green()).unwrap();
    insert(&mut app, plant, Visibility::Inherited);
    (0..3).for_each(|_| app.update());
    assert!(draws_cards(&app, plant));
}

/// The triangles and the error of each level of the mesh as a whole.
fn levels_of(baked: &Hierarchy) -> Vec<(u64, f32)> {
    let levels = baked.whole_mesh_levels().unwrap();
    let errors = levels.groups.iter().map(|group| group.error_in_local);
    let errors = std::iter::once(0.0).chain(errors);
    let triangles = levels.units.iter().map(|unit| unit.triangle_count.into());
    triangles.zip(errors).collect()
}

/// A plant with the levels of a file, whose material is not there yet, and a camera far away.
fn waiting_plant(baked: &Hierarchy) -> (App, Entity, Entity, Handle<StandardMaterial>) {
    let mut app = app();
    let camera = spawn_camera(&mut app, FAR);
    let file = add(&mut app, file_of(baked));
    let later = app.world().resource::<Assets<StandardMaterial>>();
    let later = later.reserve_handle();
    let mesh = add(&mut app, crown());
    let plant = app.world_mut().spawn((
        Mesh3d(mesh),
        MeshMaterial3d(later.clone()),
        AutoLod {
            baked: Some(file),
            bake: None,
            ..with_cards()
        },
    ));
    let plant = plant.id();
    ready(&mut app, 1);
    (app, camera, plant, later)
}

/// Sets a material, and runs some frames.
fn set(app: &mut App, material: &Handle<StandardMaterial>, value: StandardMaterial) {
    let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    materials.insert(material, value).unwrap();
    (0..3).for_each(|_| app.update());
}

/// Whether the mesh that an entity draws is inside the box by which it is culled.
fn is_in_its_box(app: &App, plant: Entity) -> bool {
    let plant = app.world().entity(plant);
    let aabb = plant.get::<Aabb>().unwrap();
    let meshes = app.world().resource::<Assets<Mesh>>();
    let mesh = meshes.get(plant.get::<Mesh3d>().unwrap()).unwrap();
    let positions = mesh.attribute(Mesh::ATTRIBUTE_POSITION).unwrap();
    let positions = positions.as_float3().unwrap().iter();
    let off = positions.map(|&position| (Vec3A::from(position) - aabb.center).abs());
    off.map(|off| (off - aabb.half_extents).max_element())
        .all(|outside| outside < 1e-5)
}

/// The triangles that a camera draws at each of so many levels.
fn drawn_at_levels(app: &mut App, camera: Entity, plant: Entity, count: usize) -> Vec<u64> {
    let drawn = (0..count as u32).map(|level| {
        let mut lod = app.world_mut().get_mut::<AutoLod>(plant).unwrap();
        lod.forced_level = Some(level);
        (0..2).for_each(|_| app.update());
        assert!(is_in_its_box(app, plant), "{level}");
        stats(app, camera).triangles_drawn
    });
    drawn.collect()
}

#[test]
fn the_coarsest_triangles_that_err_no_more_stand_in_for_cards() {
    let levels = levels_of(&BAKED_CROWN);
    let without_cards = levels_of(&baked_without_cards());
    let above_cards = |(own, other): &(&(u64, f32), &(u64, f32))| own == other;
    let first = levels.iter().zip(&without_cards).take_while(above_cards);
    let first = first.count();
    let stand_in = |error: f32| without_cards.iter().rfind(|level| level.1 <= error);
    // Triangles above cards are drawn as they are, though a coarser level may err as much.
    let of_cards = levels[first..].iter();
    let of_cards = of_cards.map(|level| stand_in(level.1).unwrap().0);
    let above = levels[..first].iter().map(|level| level.0);
    let stand_ins: Vec<u64> = above.chain(of_cards).collect();
    assert!(first < levels.len() && stand_ins[levels.len() - 1] * 4 < levels[first - 1].0);
    let (mut app, camera, plant, material) = waiting_plant(&BAKED_CROWN);
    let drawn = drawn_at_levels(&mut app, camera, plant, levels.len());
    assert_eq!(drawn, stand_ins);
    set(&mut app, &material, green());
    let drawn = drawn_at_levels(&mut app, camera, plant, levels.len());
    let all: Vec<u64> = levels.iter().map(|level| level.0).collect();
    assert_eq!(drawn, all);
}

/// Of which nothing coarser is known.
#[test]
fn the_last_triangles_stand_in_for_cards_of_a_file_of_whole_meshes() {
    let whole = BAKED_CROWN.whole_mesh_levels().unwrap();
    let above_cards = &whole.units[whole.card_units().start - 1];
    let (app, camera, ..) = waiting_plant(&whole);
    let drawn = stats(&app, camera).triangles_drawn;
    assert_eq!(drawn, u64::from(above_cards.triangle_count));
}

#[test]
fn a_plant_that_waits_for_cards_draws_what_it_would_without_or_little_more() {
    let triangles = |baked: &Hierarchy, waits: bool| {
        let (mut app, camera, plant, material) = waiting_plant(baked);
        if !waits {
            set(&mut app, &material, green());
        }
        let distances = [3.0, 10.0, 20.0, 40.0, 60.0, 80.0, FAR, 2.0 * FAR];
        distances.map(|distance| {
            move_camera(&mut app, camera, distance);
            let drawn = stats(&app, camera).triangles_drawn;
            (drawn, draws_cards(&app, plant))
        })
    };
    let waiting = triangles(&BAKED_CROWN, true);
    let cards = triangles(&BAKED_CROWN, false);
    let without = triangles(&baked_without_cards(), true);
    let mut above_cards = u64::MAX;
    for ((waiting, cards), without) in waiting.into_iter().zip(cards).zip(without) {
        assert!(!waiting.1 && !without.1);
        if cards.1 {
            // What is asked for errs less than what is allowed.
            let range = without.0..above_cards.min(3 * without.0);
            assert!(range.contains(&waiting.0), "{waiting:?} {without:?}");
        } else {
            assert_eq!((waiting.0, waiting.0), (without.0, cards.0));
            above_cards = waiting.0;
        }
    }
    assert!(!cards[0].1 && cards[7].1);
}

/// Though nothing moves.
#[test]
fn a_still_plant_becomes_cards_and_triangles_again() {
    let (mut app, camera, plant, material) = waiting_plant(&BAKED_CROWN);
    let drawn = |app: &App| (draws_cards(app, plant), stats(app, camera).triangles_drawn);
    let waiting = drawn(&app);
    assert!(!waiting.0 && waiting.1 * 10 < stats(&app, camera).triangles_full);
    set(&mut app, &material, green());
    let cards = drawn(&app);
    assert!(cards.0 && cards.1 < waiting.1, "{cards:?} {waiting:?}");
    let clear = StandardMaterial {
        alpha_mode: AlphaMode::Blend,
        ..green()
    };
    set(&mut app, &material, clear.clone());
    assert_eq!(drawn(&app), waiting);
    set(&mut app, &material, green());
    assert_eq!(drawn(&app), cards);
    // In the very frame in which it gets another material, there is nothing to draw cards with any more.
    let clear = add(&mut app, clear);
    insert(&mut app, plant, MeshMaterial3d(clear));
    for _ in 0..3 {
        app.update();
        assert_eq!(drawn(&app), waiting);
    }
}
