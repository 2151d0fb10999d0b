//! Cuts of all kinds of cameras, and shadows of lights.

use std::path::Path;

use bevy::camera::visibility::{
    CascadesVisibleEntities, CubemapVisibleEntities, RenderLayers, VisibilityRange,
    VisibleMeshEntities,
};
use bevy::camera::{
    CameraProjection, RenderTarget, ScalingMode, ShadowLodOrigin, SubCameraView, Viewport,
};
use bevy::light::NotShadowCaster;
use bevy::math::Vec3A;
use bevy::prelude::*;
use bevy::window::{WindowRef, WindowResolution};
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::soak::{self, LOSSES};

use crate::headless::{
    IDLE_FRAMES, add, app, app_without_render_plugins, before_a_camera, insert, level, levels,
    move_camera, ready, rock, spawn_camera, spawn_rock, spawn_sun, stats, units, visible,
};

fn drawn(app: &App, camera: Entity) -> u64 {
    stats(app, camera).triangles_drawn
}

/// A camera that draws to the left or the right half of a target.
fn spawn_half(app: &mut App, target: &RenderTarget, is_left: bool, distance: f32) -> Entity {
    let pose = Transform::from_xyz(0.0, 0.0, distance).looking_at(Vec3::ZERO, Vec3::Y);
    let viewport = Viewport {
        physical_position: UVec2::new(if is_left { 0 } else { 640 }, 0),
        physical_size: UVec2::new(640, 720),
        ..default()
    };
    let camera = Camera {
        viewport: Some(viewport),
        order: isize::from(is_left),
        ..default()
    };
    let bundle = (Camera3d::default(), camera, target.clone(), pose);
    app.world_mut().spawn(bundle).id()
}

#[test]
fn split_screen_halves_have_independent_cuts() {
    let (mut app, screen, _) = before_a_camera(6, 5.0);
    let target = app.world().get::<RenderTarget>(screen).unwrap().clone();
    let left = spawn_half(&mut app, &target, true, 3.0);
    let right = spawn_half(&mut app, &target, false, 30.0);
    let mut with_active = |active: &[Entity]| {
        for camera in [screen, left, right] {
            let mut camera_mut = app.world_mut().get_mut::<Camera>(camera).unwrap();
            camera_mut.is_active = active.contains(&camera);
        }
        app.update();
        app.update();
        [left, right].map(|half| (visible(&app, half).len(), drawn(&app, half)))
    };
    let [left_alone, _] = with_active(&[left]);
    let [_, right_alone] = with_active(&[right]);
    assert!(
        left_alone.1 > 4 * right_alone.1,
        "{left_alone:?} {right_alone:?}"
    );
    assert_eq!(with_active(&[left, right]), [left_alone, right_alone]);
}

/// The meshes that each camera of `walking` draws in each frame of a walk. The other cameras are inactive.
fn walk(app: &mut App, cameras: &[Entity], walking: &[Entity]) -> Vec<Vec<AssetId<Mesh>>> {
    let mut activate = |active: &[Entity]| {
        for camera in cameras {
            let mut camera_mut = app.world_mut().get_mut::<Camera>(*camera).unwrap();
            camera_mut.is_active = active.contains(camera);
        }
        // An inactive camera draws nothing, and starts with a new cut.
        app.update();
    };
    activate(&[]);
    activate(walking);
    let mut drawn = Vec::new();
    for step in [2.0f32; 3].into_iter().chain([0.5; 3]) {
        for &camera in walking {
            let mut pose = app.world_mut().get_mut::<Transform>(camera).unwrap();
            pose.translation.z *= step;
        }
        app.update();
        for &camera in walking {
            let mesh = |&entity: &Entity| app.world().get::<Mesh3d>(entity).unwrap().id();
            let mut meshes: Vec<_> = visible(app, camera).iter().map(mesh).collect();
            meshes.sort_unstable();
            drawn.push(meshes);
        }
    }
    drawn
}

#[test]
fn parallel_selection_equals_sequential_selection() {
    let (mut app, first, _) = before_a_camera(6, 3.0);
    let other = spawn_rock(&mut app, 5);
    insert(&mut app, other, Transform::from_xyz(1.5, 0.5, -4.0));
    ready(&mut app, 2);
    let second = spawn_camera(&mut app, 9.0);
    insert(&mut app, second, FieldLodCamera::with_error_px(3.0));
    let third = spawn_camera(&mut app, 10.0);
    insert(&mut app, third, orthographic(4.0));
    let target = app.world().get::<RenderTarget>(first).unwrap().clone();
    let left = spawn_half(&mut app, &target, true, 3.5);
    let right = spawn_half(&mut app, &target, false, 20.0);
    let cameras = [first, second, third, left, right];
    let at_once = walk(&mut app, &cameras, &cameras);
    for (place, camera) in cameras.iter().enumerate() {
        let alone = walk(&mut app, &cameras, &[*camera]);
        let of_camera: Vec<_> = at_once.iter().skip(place).step_by(cameras.len()).collect();
        assert_eq!(of_camera, alone.iter().collect::<Vec<_>>(), "{place}");
        // All but the orthographic camera draw fewer triangles from farther away.
        let has_changed = alone.iter().any(|meshes| *meshes != alone[0]);
        assert_eq!(has_changed, *camera != third, "{place}");
    }
}

fn orthographic(height: f32) -> Projection {
    Projection::Orthographic(OrthographicProjection {
        scaling_mode: ScalingMode::FixedVertical {
            viewport_height: height,
        },
        ..OrthographicProjection::default_3d()
    })
}

#[test]
fn orthographic_cut_depends_on_scale_only() {
    let (mut app, camera, _) = before_a_camera(6, 10.0);
    let mut drawn_at = |height: f32, distance: f32| {
        let pose = Transform::from_xyz(0.0, 0.0, distance);
        insert(&mut app, camera, (orthographic(height), pose));
        app.update();
        app.update();
        drawn(&app, camera)
    };
    let near = drawn_at(4.0, 10.0);
    // The hysteresis has no effect, since no level changed in between.
    assert_eq!(drawn_at(4.0, 500.0), near);
    assert!(drawn_at(400.0, 10.0) * 4 < near);
}

/// A custom projection.
#[derive(Clone, Debug)]
struct Shifted(PerspectiveProjection);

impl CameraProjection for Shifted {
    fn get_clip_from_view(&self) -> Mat4 {
        let mut clip_from_view = self.0.get_clip_from_view();
        clip_from_view.z_axis.x += 0.2;
        clip_from_view
    }
    fn get_clip_from_view_for_sub(&self, sub_view: &SubCameraView) -> Mat4 {
        self.0.get_clip_from_view_for_sub(sub_view)
    }
    fn update(&mut self, width: f32, height: f32) {
        self.0.update(width, height);
    }
    fn far(&self) -> f32 {
        self.0.far()
    }
    fn get_frustum_corners(&self, z_near: f32, z_far: f32) -> [Vec3A; 8] {
        self.0.get_frustum_corners(z_near, z_far)
    }
}

#[test]
fn custom_projection_has_cut() {
    let (mut app, camera, _) = before_a_camera(6, 20.0);
    let shifted = Shifted(PerspectiveProjection::default());
    insert(&mut app, camera, Projection::custom(shifted));
    app.update();
    app.update();
    let stats = stats(&app, camera);
    assert!(stats.units_drawn > 0);
    assert!(
        stats.triangles_drawn * 2 < stats.triangles_full,
        "{stats:?}"
    );
}

#[test]
fn inactive_camera_keeps_no_units() {
    let (mut app, camera, _) = before_a_camera(6, 2.0);
    let far = spawn_camera(&mut app, 2000.0);
    app.world_mut().get_mut::<Camera>(camera).unwrap().is_active = false;
    let in_use = units_in_use(&mut app);
    assert_eq!(in_use, stats(&app, far).units_drawn as usize);
    app.world_mut().get_mut::<Camera>(camera).unwrap().is_active = true;
    app.update();
    assert!(drawn(&app, camera) > drawn(&app, far));
}

#[test]
fn units_have_render_layers_of_source() {
    let (mut app, camera, rock) = before_a_camera(6, 4.0);
    let before = drawn(&app, camera);
    insert(&mut app, rock, RenderLayers::layer(2));
    app.update();
    app.update();
    assert_eq!(drawn(&app, camera), 0);
    let other = spawn_camera(&mut app, 4.0);
    insert(&mut app, other, RenderLayers::layer(2));
    app.update();
    app.update();
    assert_eq!(drawn(&app, other), before);
    app.world_mut().entity_mut(rock).remove::<RenderLayers>();
    app.update();
    app.update();
    assert_eq!((drawn(&app, camera), drawn(&app, other)), (before, 0));
}

/// The entities in all cascades of the sun for a camera.
fn cast(app: &mut App, camera: Entity) -> Vec<Entity> {
    let mut suns = app.world_mut().query::<&CascadesVisibleEntities>();
    let sun = suns.single(app.world()).unwrap();
    let cascades = sun.entities.get(&camera).into_iter().flatten();
    without_duplicates(cascades.flat_map(|list| list.entities.clone()).collect())
}

#[test]
fn offscreen_object_casts_shadow() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 10.0);
    spawn_sun(&mut app);
    let rock = spawn_rock(&mut app, 6);
    // Right of the image, towards the sun.
    insert(&mut app, rock, Transform::from_xyz(14.0, 5.0, 0.0));
    ready(&mut app, 1);
    app.update();
    assert_eq!(visible(&app, camera), []);
    let casting = cast(&mut app, camera);
    assert!(!casting.is_empty());
    let is_unit = |&entity: &Entity| app.world().get::<LodUnit>(entity).is_some();
    assert!(casting.iter().all(is_unit), "the source casts a shadow");
    insert(&mut app, rock, NotShadowCaster);
    app.update();
    app.update();
    assert_eq!(cast(&mut app, camera), []);
    app.world_mut().entity_mut(rock).remove::<NotShadowCaster>();
    app.update();
    app.update();
    assert!(!cast(&mut app, camera).is_empty());
}

#[test]
fn cascades_have_cut_of_their_camera() {
    let mut app = app();
    let near = spawn_camera(&mut app, 4.0);
    let far = spawn_camera(&mut app, 60.0);
    spawn_sun(&mut app);
    spawn_rock(&mut app, 6);
    ready(&mut app, 1);
    app.update();
    for camera in [near, far] {
        let drawn = visible(&app, camera);
        let cast = cast(&mut app, camera);
        assert!(!cast.is_empty());
        assert!(drawn.iter().all(|unit| cast.contains(unit)));
    }
    assert_ne!(cast(&mut app, near), cast(&mut app, far));
}

/// Checks that a lamp's shadows have the cut of the camera with [`ShadowLodOrigin`], which is near or far.
fn assert_lit_as_marked(lamp: impl Bundle, shadows: fn(&mut App) -> Vec<Entity>) {
    let mut app = app();
    let near = spawn_camera(&mut app, 4.0);
    let far = spawn_camera(&mut app, 60.0);
    let above = Transform::from_xyz(0.0, 5.0, 0.0).looking_at(Vec3::ZERO, Vec3::X);
    app.world_mut().spawn((lamp, above));
    spawn_rock(&mut app, 6);
    ready(&mut app, 1);
    let mut lit = |origin: Entity, other: Entity| {
        app.world_mut()
            .entity_mut(other)
            .remove::<ShadowLodOrigin>();
        insert(&mut app, origin, ShadowLodOrigin);
        app.update();
        app.update();
        let lit = shadows(&mut app);
        let drawn = visible(&app, origin);
        assert!(!drawn.is_empty() && drawn.iter().all(|unit| lit.contains(unit)));
        lit.len()
    };
    assert!(lit(near, far) > lit(far, near));
}

fn without_duplicates(mut entities: Vec<Entity>) -> Vec<Entity> {
    entities.sort_unstable();
    entities.dedup();
    entities
}

#[test]
fn lamps_use_cut_of_shadow_lod_origin() {
    let point = PointLight {
        shadow_maps_enabled: true,
        ..default()
    };
    assert_lit_as_marked(point, |app| {
        let mut lamps = app.world_mut().query::<&CubemapVisibleEntities>();
        let faces = lamps.single(app.world()).unwrap().iter();
        without_duplicates(faces.flat_map(|face| face.entities.clone()).collect())
    });
    let spot = SpotLight {
        shadow_maps_enabled: true,
        ..default()
    };
    assert_lit_as_marked(spot, |app| {
        let lamps = app.world_mut();
        let mut lamps = lamps.query_filtered::<&VisibleMeshEntities, With<SpotLight>>();
        without_duplicates(lamps.single(app.world()).unwrap().entities.clone())
    });
}

#[test]
fn camera_without_pixels_is_ignored() {
    for subdivisions in [4, 5] {
        let (mut app, far, rock) = before_a_camera(subdivisions, 300.0);
        let drawn_far = drawn(&app, far);
        let before = (levels(&mut app, rock, far), units(&mut app).len());
        let pose = Transform::from_xyz(0.0, 0.0, 2.0);
        // A minimised window, a missing window, and an empty viewport.
        let minimized = RenderTarget::None { size: UVec2::ZERO };
        let whole = RenderTarget::None {
            size: UVec2::new(640, 360),
        };
        let empty = Camera {
            viewport: Some(Viewport {
                physical_size: UVec2::ZERO,
                ..default()
            }),
            ..default()
        };
        let near = [
            (minimized.clone(), Camera::default()),
            (RenderTarget::default(), Camera::default()),
            (whole.clone(), empty),
        ];
        let near = near.map(|near| {
            app.world_mut()
                .spawn((Camera3d::default(), near, pose))
                .id()
        });
        app.update();
        app.update();
        assert_eq!((levels(&mut app, rock, far), units(&mut app).len()), before);
        assert_eq!(drawn(&app, far), drawn_far);
        // The window is restored, and minimised again.
        insert(&mut app, near[0], (whole, Projection::default()));
        app.update();
        app.update();
        assert!(drawn(&app, near[0]) > 2 * drawn_far);
        insert(&mut app, near[0], (minimized, Projection::default()));
        app.update();
        app.update();
        assert_eq!(levels(&mut app, rock, far), before.0);
        assert_eq!(stats(&app, near[0]), FieldLodViewStats::default());
    }
}

/// Runs frames until unused units are despawned, and counts the others.
fn units_in_use(app: &mut App) -> usize {
    (0..IDLE_FRAMES).for_each(|_| app.update());
    units(app).len()
}

/// An app with a rock at the origin, and a camera at a distance from it.
fn before_a_losing_camera(subdivisions: u32, distance: f32) -> (App, Entity, Entity) {
    let mut app = app_without_render_plugins(Path::new("."));
    let camera = spawn_losing_camera(&mut app, distance);
    let rock = spawn_rock(&mut app, subdivisions);
    ready(&mut app, 1);
    (app, camera, rock)
}

fn spawn_losing_camera(app: &mut App, distance: f32) -> Entity {
    let pose = Transform::from_xyz(0.0, 0.0, distance);
    let camera = app.world_mut().spawn(pose).id();
    restore_camera(app, camera);
    camera
}

fn restore_camera(app: &mut App, camera: Entity) {
    soak::restore_camera(
        &mut app.world_mut().entity_mut(camera),
        UVec2::new(1280, 720),
    );
}

#[test]
fn camera_without_its_components_is_no_view() {
    for subdivisions in [4, 5] {
        let (mut app, far, rock) = before_a_losing_camera(subdivisions, 300.0);
        let alone = (levels(&mut app, rock, far), units_in_use(&mut app));
        for (index, loss) in LOSSES.iter().enumerate() {
            let near = spawn_losing_camera(&mut app, 2.0);
            app.update();
            assert!(drawn(&app, near) > 2 * drawn(&app, far));
            loss(&mut app.world_mut().entity_mut(near));
            app.update();
            assert_eq!(levels(&mut app, rock, far), alone.0, "{index}");
            assert_eq!(levels(&mut app, rock, near), None, "{index}");
            assert_eq!(units_in_use(&mut app), alone.1, "{index}");
            restore_camera(&mut app, near);
            app.update();
            assert!(drawn(&app, near) > 2 * drawn(&app, far), "{index}");
            app.world_mut().despawn(near);
            app.update();
        }
    }
}

/// A program that ran earlier in a game replaced all meshes while no camera was there.
#[test]
fn returning_camera_draws_meshes_with_reused_ids() {
    for (index, loss) in LOSSES.iter().enumerate().step_by(LOSSES.len() - 1) {
        let (mut app, camera, _) = before_a_losing_camera(5, 150.0);
        let mut spawn = |subdivisions| {
            let mesh = Mesh3d(add(&mut app, rock(subdivisions, 1)));
            let whole = AutoLod::of_kind(LodKind::WholeMesh);
            app.world_mut().spawn((mesh, whole)).id()
        };
        let rocks = [spawn(6), spawn(5)];
        ready(&mut app, 3);
        app.update();
        assert!(level(&mut app, rocks[0], camera) > Some(5));
        loss(&mut app.world_mut().entity_mut(camera));
        app.update();
        let mut objects = app.world_mut().query_filtered::<Entity, With<AutoLod>>();
        let objects: Vec<Entity> = objects.iter(app.world()).collect();
        objects.into_iter().for_each(|object| {
            app.world_mut().despawn(object);
        });
        (0..4).for_each(|_| app.update());
        let others = [1, 2, 3].map(|seed| {
            let mesh = Mesh3d(add(&mut app, rock(3, seed)));
            app.world_mut().spawn((mesh, AutoLod::default())).id()
        });
        ready(&mut app, 3);
        restore_camera(&mut app, camera);
        (0..2).for_each(|_| app.update());
        let stats = stats(&app, camera);
        assert_eq!(stats.units_drawn, 3, "{index}");
        assert!(stats.triangles_drawn < stats.triangles_full, "{index}");
        for other in others {
            assert!(level(&mut app, other, camera).is_some(), "{index}");
        }
    }
}

#[test]
fn triangle_budget_ignores_hidden_objects() {
    let (mut app, camera, shown) = before_a_camera(6, 4.0);
    let alone = stats(&app, camera);
    let budget = alone.triangles_drawn * 2 / 3;
    insert(
        &mut app,
        camera,
        FieldLodCamera::with_triangle_budget(budget),
    );
    (0..5).for_each(|_| app.update());
    let alone = stats(&app, camera);
    assert!(alone.error_px > 1.0 && alone.triangles_drawn <= budget);
    let in_use = units_in_use(&mut app);
    let hidden = spawn_rock(&mut app, 6);
    insert(&mut app, hidden, Visibility::Hidden);
    ready(&mut app, 2);
    assert_eq!(units_in_use(&mut app), in_use);
    assert!(stats(&app, camera).error_px <= alone.error_px);
    // The hidden rock is shown, then both are hidden.
    insert(&mut app, hidden, Visibility::Inherited);
    app.update();
    assert!(stats(&app, camera).error_px > alone.error_px);
    insert(&mut app, shown, Visibility::Hidden);
    insert(&mut app, hidden, Visibility::Hidden);
    app.update();
    assert_eq!(visible(&app, camera), []);
    assert_eq!(units_in_use(&mut app), 0);
}

#[test]
fn objects_outside_get_coarser_over_some_frames() {
    let (mut app, camera, rock) = before_a_camera(4, 30.0);
    // Source meshes do not wait.
    let seen = level(&mut app, rock, camera).unwrap();
    assert!(seen > 0);
    let mesh = app.world().get::<Mesh3d>(rock).unwrap().clone();
    let copies = (0..99).map(|_| (mesh.clone(), AutoLod::default()));
    let copies: Vec<Entity> = app.world_mut().spawn_batch(copies).collect();
    ready(&mut app, 100);
    let turn = |app: &mut App| {
        let mut pose = app.world_mut().get_mut::<Transform>(camera).unwrap();
        pose.rotate_y(std::f32::consts::PI);
        app.update();
    };
    let seen_ones = |app: &mut App| {
        let levels = copies.iter().map(|rock| level(app, *rock, camera));
        levels.filter(|level| *level == Some(seen)).count()
    };
    assert_eq!(seen_ones(&mut app), 99);
    turn(&mut app);
    let left: Vec<usize> = (0..4)
        .map(|_| {
            let left = seen_ones(&mut app);
            app.update();
            left
        })
        .collect();
    assert!(left[0] >= 60 && left.is_sorted_by(|a, b| a > b), "{left:?}");
    assert_eq!(left[3], 0);
    turn(&mut app);
    assert_eq!(seen_ones(&mut app), 99);
}

#[test]
fn shown_object_has_its_level_at_once() {
    let (mut app, camera, shown) = before_a_camera(4, 500.0);
    let hidden = spawn_rock(&mut app, 4);
    ready(&mut app, 2);
    let layer = RenderLayers::layer(3);
    for by_layer in [false, true] {
        move_camera(&mut app, camera, 500.0);
        if by_layer {
            insert(&mut app, hidden, layer.clone());
        } else {
            insert(&mut app, hidden, Visibility::Hidden);
        }
        app.update();
        let alone = stats(&app, camera);
        let far = level(&mut app, shown, camera);
        assert_eq!(level(&mut app, hidden, camera), None);
        move_camera(&mut app, camera, 3.0);
        assert_eq!(level(&mut app, hidden, camera), None);
        assert!(level(&mut app, shown, camera) < far);
        let near = stats(&app, camera);
        assert_eq!(near.triangles_full, alone.triangles_full);
        if by_layer {
            app.world_mut().entity_mut(hidden).remove::<RenderLayers>();
        } else {
            insert(&mut app, hidden, Visibility::Inherited);
        }
        app.update();
        let near_level = level(&mut app, shown, camera);
        assert_eq!(level(&mut app, hidden, camera), near_level);
        let both = stats(&app, camera);
        assert_eq!(both.triangles_drawn, 2 * near.triangles_drawn);
    }
}

#[test]
fn object_on_layer_of_light_casts_shadow() {
    let mut app = app();
    let camera = spawn_camera(&mut app, 10.0);
    spawn_sun(&mut app);
    let rock = spawn_rock(&mut app, 6);
    insert(&mut app, rock, RenderLayers::layer(1));
    ready(&mut app, 1);
    app.update();
    assert_eq!(
        (visible(&app, camera), cast(&mut app, camera)),
        (vec![], vec![])
    );
    let mut suns = app
        .world_mut()
        .query_filtered::<Entity, With<DirectionalLight>>();
    let sun = suns.single(app.world()).unwrap();
    insert(&mut app, sun, RenderLayers::from_layers(&[0, 1]));
    app.update();
    app.update();
    assert_eq!(visible(&app, camera), []);
    let casting = cast(&mut app, camera);
    let is_unit = |&entity: &Entity| app.world().get::<LodUnit>(entity).is_some();
    assert!(!casting.is_empty() && casting.iter().all(is_unit));
}

#[test]
fn lamp_in_range_refines_casters() {
    let mut app = app();
    spawn_camera(&mut app, 10.0);
    let rock = spawn_rock(&mut app, 6);
    // Behind the camera.
    insert(&mut app, rock, Transform::from_xyz(0.0, 0.0, 16.0));
    ready(&mut app, 1);
    let dark = units_in_use(&mut app);
    let point = PointLight {
        shadow_maps_enabled: true,
        range: 30.0,
        ..default()
    };
    let spot = SpotLight {
        shadow_maps_enabled: true,
        range: 30.0,
        ..default()
    };
    let near = Transform::from_xyz(0.0, 0.0, 20.0);
    let far = Transform::from_xyz(0.0, 0.0, 100.0);
    let point = app.world_mut().spawn((point, near)).id();
    let spot = app.world_mut().spawn((spot, far)).id();
    let assert_refined = |app: &mut App| {
        app.update();
        app.update();
        assert!(units(app).len() > dark);
    };
    for [lit, unlit] in [[point, spot], [spot, point]] {
        insert(&mut app, lit, near);
        insert(&mut app, unlit, far);
        assert_refined(&mut app);
        insert(&mut app, lit, Visibility::Hidden);
        assert_eq!(units_in_use(&mut app), dark);
        insert(
            &mut app,
            lit,
            (Visibility::Inherited, RenderLayers::layer(3)),
        );
        assert_eq!(units_in_use(&mut app), dark);
        app.world_mut().entity_mut(lit).remove::<RenderLayers>();
        assert_refined(&mut app);
        insert(&mut app, lit, far);
        assert_eq!(units_in_use(&mut app), dark);
    }
}

/// A camera that draws to its own window, with this size in physical pixels.
fn spawn_window(app: &mut App, size_px: UVec2, scale_factor: f32) -> Entity {
    let resolution = WindowResolution::new(size_px.x, size_px.y);
    let window = Window {
        resolution: resolution.with_scale_factor_override(scale_factor),
        ..default()
    };
    let window = app.world_mut().spawn(window).id();
    let target = RenderTarget::Window(WindowRef::Entity(window));
    let pose = Transform::from_xyz(0.0, 0.0, 20.0);
    let camera = (Camera3d::default(), target, pose);
    app.world_mut().spawn(camera).id()
}

#[test]
fn windows_use_physical_pixels() {
    let mut app = app();
    let sizes = [(1280, 720, 1.0), (1280, 720, 2.0), (2560, 1440, 2.0)];
    let [plain, scaled, large] =
        sizes.map(|(x, y, scale)| spawn_window(&mut app, UVec2::new(x, y), scale));
    spawn_rock(&mut app, 6);
    ready(&mut app, 1);
    app.update();
    assert!(drawn(&app, plain) > 0);
    assert_eq!(visible(&app, plain), visible(&app, scaled));
    assert!(drawn(&app, large) > 2 * drawn(&app, plain));
}

#[test]
fn objects_out_of_visibility_range_are_not_selected() {
    for subdivisions in [4, 5] {
        let (mut app, camera, object) = before_a_camera(subdivisions, 5.0);
        let all = stats(&app, camera).triangles_full;
        assert!(all > 0 && drawn(&app, camera) > 0);
        insert(&mut app, object, VisibilityRange::abrupt(0.0, 10.0));
        for (distance, is_near) in [(5.0, true), (20.0, false), (5.0, true)] {
            move_camera(&mut app, camera, distance);
            app.update();
            let expected = if is_near { all } else { 0 };
            assert_eq!(stats(&app, camera).triangles_full, expected);
            assert_eq!(drawn(&app, camera) > 0, is_near);
            assert_eq!(levels(&mut app, object, camera).is_some(), is_near);
        }
        // Another camera is near.
        let near = spawn_camera(&mut app, 5.0);
        move_camera(&mut app, camera, 20.0);
        app.update();
        assert!(drawn(&app, near) > 0);
        app.world_mut().get_mut::<Camera>(near).unwrap().is_active = false;
        app.update();
        assert_eq!(drawn(&app, camera), 0);
        insert(&mut app, object, VisibilityRange::abrupt(0.0, 100.0));
        app.update();
        assert!(drawn(&app, camera) > 0);
    }
}
