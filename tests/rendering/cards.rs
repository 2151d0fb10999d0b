//! Plants that are drawn as cards look as they do with triangles.

use bevy::color::palettes::css;
use bevy::core_pipeline::prepass::{DepthPrepass, MotionVectorPrepass, NormalPrepass};
use bevy::light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::{bevy_mesh, windowless, with_cards};
use fieldlod_tests::stage::{Eye, Stage};
use image::RgbaImage;

use crate::picture::{count, difference, differs};

/// A crown of radius 1.3 at the origin under a sun, and an eye to which it has a radius of about 20 pixels.
fn plant_before_an_eye(stage: &mut Stage) -> (Entity, Handle<StandardMaterial>, Eye) {
    let crown = stage.add(bevy_mesh(&fieldlod_tests::crown(600, 3)));
    let green = stage.add(StandardMaterial {
        base_color: Color::linear_rgb(0.2, 0.6, 0.1),
        perceptual_roughness: 0.9,
        ..default()
    });
    stage.spawn((
        DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        },
        CascadeShadowConfigBuilder {
            maximum_distance: 60.0,
            ..default()
        }
        .build(),
        Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y),
    ));
    let pose = Transform::from_xyz(0.0, 4.0, 20.0).looking_at(Vec3::ZERO, Vec3::Y);
    let view = FieldLodSettings::with_error_px(3.0);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), view);
    let plant = stage.spawn((Mesh3d(crown), MeshMaterial3d(green.clone())));
    (plant, green, eye)
}

/// Whether what an entity draws are cards: the source has no tangents.
fn draws_cards(stage: &Stage, plant: Entity) -> bool {
    let world = stage.app.world();
    let mesh = world.resource::<Assets<Mesh>>();
    let mesh = mesh.get(world.get::<Mesh3d>(plant).unwrap());
    mesh.unwrap().contains_attribute(Mesh::ATTRIBUTE_TANGENT)
}

/// Draws frames until the plant has become cards, and a few more.
fn run_until_cards(stage: &mut Stage, plant: Entity) {
    stage.run_until_ready();
    for _ in 0..200 {
        if draws_cards(stage, plant) {
            break;
        }
        stage.app.update();
    }
    assert!(draws_cards(stage, plant), "it never became cards");
    (0..3).for_each(|_| stage.app.update());
}

/// Triangles of a mesh.
fn triangles_of(stage: &Stage, mesh: &Handle<Mesh>) -> usize {
    let meshes = stage.app.world().resource::<Assets<Mesh>>();
    meshes.get(mesh).unwrap().indices().unwrap().len() / 3
}

fn triangles_of_units(stage: &mut Stage) -> Vec<usize> {
    let world = stage.app.world_mut();
    let mut units = world.query_filtered::<&Mesh3d, With<LodUnit>>();
    let units: Vec<Mesh3d> = units.iter(world).cloned().collect();
    let triangles = units.iter().map(|unit| triangles_of(stage, &unit.0));
    triangles.collect()
}

/// How many entities let pipelines be made.
fn warm_up_count(stage: &mut Stage) -> usize {
    let world = stage.app.world_mut();
    let mut names = world.query::<&Name>();
    let names = names.iter(world);
    names
        .filter(|name| name.as_str() == "pipelines of cards")
        .count()
}

/// Pixels that show no sky, and their mean colour.
fn seen(picture: &RgbaImage) -> (usize, Vec3) {
    let sky = *picture.get_pixel(0, 0);
    let shown: Vec<Vec3> = picture
        .pixels()
        .filter(|pixel| differs(**pixel, sky))
        .map(|pixel| Vec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into()))
        .collect();
    let mean = shown.iter().sum::<Vec3>() / shown.len().max(1) as f32;
    (shown.len(), mean)
}

#[test]
fn cards_look_like_the_plant_and_follow_its_material() {
    for mut stage in Stage::with_each_culling() {
        let (plant, material, eye) = plant_before_an_eye(&mut stage);
        stage.run_until_ready();
        let [source] = stage.shoot([&eye]);
        stage.insert(plant, with_cards());
        run_until_cards(&mut stage, plant);
        assert_eq!(warm_up_count(&mut stage), 0);
        let [cards] = stage.shoot([&eye]);
        let ((area, color), (own_area, own_color)) = (seen(&source), seen(&cards));
        let share = own_area as f32 / area as f32;
        println!("{share}, {own_color} of {color}");
        assert!(area > 500 && (0.9..1.1).contains(&share), "{share}");
        let off = (own_color / color - 1.0).abs().max_element();
        assert!(off < 0.15, "{own_color}, not {color}");
        // Another colour.
        let mut materials = stage
            .app
            .world_mut()
            .resource_mut::<Assets<StandardMaterial>>();
        materials.get_mut(&material).unwrap().base_color = Color::linear_rgb(0.8, 0.1, 0.1);
        (0..3).for_each(|_| stage.app.update());
        let [red] = stage.shoot([&eye]);
        assert!(draws_cards(&stage, plant));
        let (red_area, red_color) = seen(&red);
        assert!(red_area.abs_diff(own_area) * 50 < own_area);
        assert!(red_color.x > 1.5 * red_color.y, "{red_color}");
        // And back to what it was.
        let mut materials = stage
            .app
            .world_mut()
            .resource_mut::<Assets<StandardMaterial>>();
        materials.get_mut(&material).unwrap().base_color = Color::linear_rgb(0.2, 0.6, 0.1);
        stage.app.world_mut().entity_mut(plant).remove::<AutoLod>();
        (0..3).for_each(|_| stage.app.update());
        let [again] = stage.shoot([&eye]);
        assert_eq!(count(&difference(&source, &again)), 0);
    }
}

#[test]
fn cards_throw_the_shadow_of_the_plant() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    let (plant, _, eye) = plant_before_an_eye(&mut stage);
    let ground = stage.add(Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(30.0))));
    let white = stage.add(StandardMaterial::from(Color::WHITE));
    let below = Transform::from_xyz(0.0, -1.5, 0.0);
    stage.spawn((Mesh3d(ground), MeshMaterial3d(white), below));
    // What is as gray as the ground, and darker than nearly all of it.
    let shadow = |picture: &RgbaImage| {
        let is_dark = |pixel: &image::Rgba<u8>| {
            let [r, g, b, _] = pixel.0;
            r.abs_diff(g) < 12 && g.abs_diff(b) < 24 && g < 110
        };
        picture.pixels().filter(|pixel| is_dark(pixel)).count()
    };
    stage.run_until_ready();
    let [source] = stage.shoot([&eye]);
    stage.insert(plant, with_cards());
    run_until_cards(&mut stage, plant);
    let [cards] = stage.shoot([&eye]);
    let (expected, found) = (shadow(&source), shadow(&cards));
    println!("{found} of {expected}");
    let share = found as f32 / expected as f32;
    assert!(
        expected > 200 && (0.8..1.25).contains(&share),
        "{found} of {expected}"
    );
}

/// Frames that wait for pipelines are not dear.
#[test]
fn coarse_triangles_stand_in_while_pipelines_are_made() {
    for mut stage in Stage::with_each_culling() {
        let (plant, _, eye) = plant_before_an_eye(&mut stage);
        let source = stage.app.world().get::<Mesh3d>(plant).unwrap().0.clone();
        let full = triangles_of(&stage, &source);
        stage.insert(plant, with_cards());
        let mut frames = 0;
        for _ in 0..20_000 {
            stage.app.update();
            let world = stage.app.world();
            let drawn = &world.get::<Mesh3d>(plant).unwrap().0;
            if draws_cards(&stage, plant) {
                break;
            }
            if *drawn != source {
                frames += 1;
                let triangles = triangles_of(&stage, drawn);
                let stats = world.get::<FieldLodViewStats>(eye.entity).unwrap();
                assert!(triangles * 10 < full, "{triangles} of {full}");
                assert_eq!(stats.triangles_drawn, triangles as u64);
            }
        }
        assert!(frames > 0 && draws_cards(&stage, plant), "{frames}");
    }
}

/// Units that draw cards, and whether each has the material of cards.
fn units_of_cards(stage: &mut Stage) -> Vec<bool> {
    let world = stage.app.world_mut();
    let mut units =
        world.query_filtered::<(&Mesh3d, &MeshMaterial3d<StandardMaterial>), With<LodUnit>>();
    let meshes = world.resource::<Assets<Mesh>>();
    let materials = world.resource::<Assets<StandardMaterial>>();
    let all = units.iter(world);
    let cards = all.filter(|(mesh, _)| {
        let mesh = meshes.get(*mesh).unwrap();
        mesh.contains_attribute(Mesh::ATTRIBUTE_TANGENT)
    });
    cards
        .map(|(_, material)| {
            let material = materials.get(material).unwrap();
            material.base_color_texture.is_some()
        })
        .collect()
}

/// In far cascades cards throw the shadow of what a view draws with triangles.
#[test]
fn cards_throw_shadows_in_their_own_material() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    stage
        .app
        .insert_resource(DirectionalLightShadowMap { size: 512 })
        .insert_resource(FieldLodConfig {
            idle_frames: 2,
            ..default()
        });
    let (plant, material, eye) = plant_before_an_eye(&mut stage);
    let source = stage.app.world().get::<Mesh3d>(plant).unwrap().0.clone();
    let full = triangles_of(&stage, &source);
    let near = Transform::from_xyz(0.0, 1.0, 4.0).looking_at(Vec3::ZERO, Vec3::Y);
    let view = FieldLodSettings::with_error_px(0.5);
    stage.insert(eye.entity, (near, view));
    stage.insert(plant, with_cards());
    stage.run_until_ready();
    let run = |stage: &mut Stage, frames: u32| (0..frames).for_each(|_| stage.app.update());
    run(&mut stage, 20);
    assert!(!draws_cards(&stage, plant));
    let units = units_of_cards(&mut stage);
    assert!(!units.is_empty() && units.iter().all(|is_dressed| *is_dressed));
    // Nothing throws the shadow of rectangles while the material blends, nor when it does no longer.
    for alpha_mode in [AlphaMode::Blend, AlphaMode::Opaque] {
        let mut materials = stage
            .app
            .world_mut()
            .resource_mut::<Assets<StandardMaterial>>();
        materials.get_mut(&material).unwrap().alpha_mode = alpha_mode;
        run(&mut stage, 20);
        if alpha_mode == AlphaMode::Blend {
            let least = triangles_of_units(&mut stage).into_iter().min();
            assert!(units_of_cards(&mut stage).is_empty());
            assert!(least.is_some_and(|least| least * 10 < full), "{least:?}");
        }
    }
    let units = units_of_cards(&mut stage);
    assert!(!units.is_empty() && units.iter().all(|is_dressed| *is_dressed));
}

/// What has no pipeline yet is not drawn.
#[test]
fn a_plant_does_not_vanish_while_pipelines_are_made() {
    let plugins = windowless()
        .disable::<PipelinedRenderingPlugin>()
        .set(RenderPlugin {
            synchronous_pipeline_compilation: false,
            ..default()
        });
    let Some(mut stage) = Stage::unfinished_with(plugins) else {
        return;
    };
    stage.finish();
    let (plant, _, eye) = plant_before_an_eye(&mut stage);
    // All that is drawn now has its pipelines.
    let mut area = 0;
    for _ in 0..200 {
        let [picture] = stage.shoot([&eye]);
        area = seen(&picture).0;
        if area > 500 {
            break;
        }
    }
    assert!(area > 500, "{area}");
    stage.insert(plant, with_cards());
    let mut pending = Vec::new();
    let mut frames_as_cards = 0;
    for _ in 0..6_000 {
        pending.extend(stage.request(&[&eye]));
        stage.app.update();
        frames_as_cards += u32::from(draws_cards(&stage, plant));
        if frames_as_cards == 20 {
            break;
        }
    }
    assert_eq!(frames_as_cards, 20, "it never became cards");
    // Those before are of the source.
    let first = pending.len().saturating_sub(40);
    for frame in &pending[first..] {
        let own = seen(&stage.wait(frame)).0;
        assert!(own * 10 > area * 8, "{own} of {area} pixels");
    }
}

fn plain(color: Color) -> StandardMaterial {
    StandardMaterial {
        base_color: color,
        perceptual_roughness: 0.9,
        ..default()
    }
}

/// The mean colours of the left and the right half, of what shows no sky.
fn halves(picture: &RgbaImage) -> [Vec3; 2] {
    let half = picture.width() / 2;
    [0, half].map(|x| {
        let view = image::imageops::crop_imm(picture, x, 0, half, picture.height());
        seen(&view.to_image()).1
    })
}

/// Two plants side by side, red and green, that are cards, and their materials.
fn two_plants() -> Option<(Stage, Eye, [(Entity, Handle<StandardMaterial>); 2])> {
    let mut stage = Stage::new()?;
    let mesh = stage.add(bevy_mesh(&fieldlod_tests::crown(600, 3)));
    stage.spawn((
        DirectionalLight::default(),
        Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y),
    ));
    let plants = [(-3.0, RED), (3.0, GREEN)].map(|(x, color)| {
        let material = stage.add(plain(color));
        let place = Transform::from_xyz(x, 0.0, 0.0);
        let own = MeshMaterial3d(material.clone());
        let plant = stage.spawn((Mesh3d(mesh.clone()), own, place, with_cards()));
        (plant, material)
    });
    let pose = Transform::from_xyz(0.0, 4.0, 20.0).looking_at(Vec3::ZERO, Vec3::Y);
    let view = FieldLodSettings::with_error_px(3.0);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), view);
    for (plant, _) in &plants {
        run_until_cards(&mut stage, *plant);
    }
    Some((stage, eye, plants))
}

const RED: Color = Color::linear_rgb(0.8, 0.1, 0.1);
const GREEN: Color = Color::linear_rgb(0.1, 0.7, 0.1);

fn are_red_and_green([left, right]: [Vec3; 2]) -> bool {
    left.x > 1.5 * left.y && right.y > 1.5 * right.x
}

/// The renderer is told of what it does not see change.
#[test]
fn cards_follow_other_materials_and_changes_of_several() {
    let Some((mut stage, eye, plants)) = two_plants() else {
        return;
    };
    let shoot = |stage: &mut Stage| halves(&stage.shoot([&eye])[0]);
    let drawn = shoot(&mut stage);
    assert!(are_red_and_green(drawn), "{drawn:?}");
    // In place, both in a frame, and so that they need other pipelines.
    let mut materials = stage
        .app
        .world_mut()
        .resource_mut::<Assets<StandardMaterial>>();
    for ((_, material), color) in plants.iter().zip([GREEN, RED]) {
        let changed = StandardMaterial {
            clearcoat: 1.0,
            ..plain(color)
        };
        materials.insert(material, changed).unwrap();
    }
    (0..4).for_each(|_| stage.app.update());
    let [changed] = stage.shoot([&eye]);
    let [left, right] = halves(&changed);
    assert!(are_red_and_green([right, left]), "{left} {right}");
    // As if the renderer had looked at all again.
    for (plant, _) in &plants {
        let mesh = stage.app.world_mut().get_mut::<Mesh3d>(*plant);
        mesh.unwrap().set_changed();
    }
    (0..4).for_each(|_| stage.app.update());
    let [again] = stage.shoot([&eye]);
    assert_eq!(count(&difference(&changed, &again)), 0);
    // Others, that are not known yet.
    for ((plant, _), color) in plants.iter().zip([RED, GREEN]) {
        let other = stage.add(plain(color));
        stage.insert(*plant, MeshMaterial3d(other));
    }
    stage.app.update();
    for (plant, _) in &plants {
        run_until_cards(&mut stage, *plant);
    }
    let drawn = shoot(&mut stage);
    assert!(are_red_and_green(drawn), "{drawn:?}");
    // And known ones.
    for ((plant, _), (_, material)) in plants.iter().zip(plants.iter()) {
        stage.insert(*plant, MeshMaterial3d(material.clone()));
    }
    stage.app.update();
    for (plant, _) in &plants {
        run_until_cards(&mut stage, *plant);
    }
    let [left, right] = shoot(&mut stage);
    assert!(are_red_and_green([right, left]), "{left} {right}");
}

/// Also where all meshes get levels of detail.
#[test]
fn nothing_is_left_of_pipelines_of_plants_that_went() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    stage.app.insert_resource(FieldLodConfig {
        whole_world: true,
        ..default()
    });
    let (plant, _, _) = plant_before_an_eye(&mut stage);
    stage.insert(plant, with_cards());
    let mut went = false;
    for _ in 0..10_000 {
        stage.app.update();
        if !went && warm_up_count(&mut stage) > 0 {
            stage.app.world_mut().entity_mut(plant).despawn();
            went = true;
        } else if went && warm_up_count(&mut stage) == 0 {
            break;
        }
    }
    assert!(went && warm_up_count(&mut stage) == 0);
    let progress = stage.app.world().resource::<FieldLodProgress>();
    assert_eq!((progress.waiting, progress.ready), (0, 0), "{progress:?}");
}

#[test]
fn cards_are_drawn_with_prepasses_and_samples() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    let (plant, _, eye) = plant_before_an_eye(&mut stage);
    stage.insert(plant, with_cards());
    run_until_cards(&mut stage, plant);
    let (area, color) = seen(&stage.shoot([&eye])[0]);
    stage.insert(
        eye.entity,
        (DepthPrepass, NormalPrepass, MotionVectorPrepass),
    );
    (0..3).for_each(|_| stage.app.update());
    let with_prepasses = seen(&stage.shoot([&eye])[0]);
    stage.insert(eye.entity, Msaa::Sample4);
    (0..3).for_each(|_| stage.app.update());
    let with_samples = seen(&stage.shoot([&eye])[0]);
    for (own_area, own_color) in [with_prepasses, with_samples] {
        let share = own_area as f32 / area as f32;
        let off = (own_color / color - 1.0).abs().max_element();
        assert!((0.95..1.15).contains(&share) && off < 0.1, "{share} {off}");
    }
    assert!(area > 500 && draws_cards(&stage, plant));
}
