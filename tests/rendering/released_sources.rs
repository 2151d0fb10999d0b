//! Sources that the GPU does not have while their units are drawn.

use std::time::{Duration, Instant};

use bevy::color::palettes::css;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy::render::{RenderApp, RenderStartup};
use bevy_fieldlod::{AdvancedAppConfig, prelude::*};
use fieldlod_tests::apps::{bevy_mesh, drawn_level};
use fieldlod_tests::stage::{Eye, Stage};
use image::RgbaImage;

use crate::picture::count_beyond;

/// A stage with a rock and an eye that draws its cut.
fn stage_with(sources_on_gpu: bool) -> Option<(Stage, Entity, Handle<Mesh>, Eye)> {
    let mut stage = Stage::new()?;
    stage.app.insert_resource(FieldLodAppConfig {
        advanced: AdvancedAppConfig {
            sources_on_gpu,
            ..default()
        },
        ..default()
    });
    Some(with_rock(stage))
}

/// The same, as the plugin is by itself.
fn stage_by_default() -> Option<(Stage, Entity, Handle<Mesh>, Eye)> {
    Stage::new().map(with_rock)
}

fn with_rock(mut stage: Stage) -> (Stage, Entity, Handle<Mesh>, Eye) {
    let mesh = stage.add(bevy_mesh(&fieldlod_tests::rock(6, 5)));
    let white = stage.add(StandardMaterial {
        unlit: true,
        ..Color::WHITE.into()
    });
    let rock = (
        Mesh3d(mesh.clone()),
        MeshMaterial3d(white),
        AutoLod::default(),
    );
    let rock = stage.spawn(rock);
    let pose = Transform::from_xyz(0.0, 0.0, 4.0);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), FieldLodCamera::default());
    stage.run_until_ready();
    (0..3).for_each(|_| stage.app.update());
    (stage, rock, mesh, eye)
}

fn is_on_gpu(stage: &Stage, mesh: &Handle<Mesh>) -> bool {
    let render_world = stage.app.sub_app(RenderApp).world();
    let meshes = render_world.resource::<RenderAssets<RenderMesh>>();
    meshes.get(mesh).is_some()
}

#[test]
fn released_source_returns_in_the_same_frame() {
    let Some((mut kept, _, kept_mesh, its_eye)) = stage_with(true) else {
        return;
    };
    assert!(is_on_gpu(&kept, &kept_mesh));
    let [cut] = kept.shoot([&its_eye]);
    let full = FieldLodCamera::at_level(0);
    kept.insert(its_eye.entity, full);
    let [in_full] = kept.shoot([&its_eye]);

    let (mut stage, rock, mesh, eye) = stage_with(false).unwrap();
    assert!(!is_on_gpu(&stage, &mesh));
    let [picture] = stage.shoot([&eye]);
    assert_eq!(count_beyond(&picture, &cut, 2), 0);
    // A view in full detail, from its first frame on.
    stage.insert(eye.entity, full);
    let [picture] = stage.shoot([&eye]);
    assert_eq!(count_beyond(&picture, &in_full, 2), 0);
    assert!(is_on_gpu(&stage, &mesh));
    assert_eq!(stage.stats(&eye).triangles_drawn, 81_920);
    stage.insert(eye.entity, FieldLodCamera::default());
    stage.app.update();
    assert!(!is_on_gpu(&stage, &mesh));
    // An entity that is drawn as it is, and one that is no more cut.
    let other = stage.spawn((Mesh3d(mesh.clone()), Visibility::Hidden));
    stage.app.update();
    assert!(is_on_gpu(&stage, &mesh));
    stage.app.world_mut().despawn(other);
    (0..2).for_each(|_| stage.app.update());
    assert!(!is_on_gpu(&stage, &mesh));
    stage.app.world_mut().entity_mut(rock).remove::<AutoLod>();
    let [picture] = stage.shoot([&eye]);
    assert_eq!(count_beyond(&picture, &in_full, 2), 0);
    assert!(is_on_gpu(&stage, &mesh));
}

/// Meshes that are drawn by others are on the GPU for as long as these are there, whoever comes first.
#[test]
fn shared_source_stays_on_gpu() {
    let Some((mut stage, rock, mesh, _)) = stage_by_default() else {
        return;
    };
    assert!(!is_on_gpu(&stage, &mesh));
    // Other objects that are cut need it as little.
    let copy = stage.app.world_mut().entity_mut(rock).clone_and_spawn();
    stage.insert(copy, Transform::from_xyz(9.0, 0.0, 0.0));
    (0..2).for_each(|_| stage.app.update());
    assert!(!is_on_gpu(&stage, &mesh));
    let plain = (Mesh3d(mesh.clone()), NoLod);
    let flat = Mesh2d(mesh.clone());
    let other = stage.add(Mesh::from(Cuboid::default()));
    for index in 0..2 {
        let drawer = match index {
            0 => stage.spawn(plain.clone()),
            _ => stage.spawn(flat.clone()),
        };
        stage.app.update();
        assert!(is_on_gpu(&stage, &mesh), "{index}");
        // It stays while that is there, though objects come and go.
        let more = stage.app.world_mut().entity_mut(rock).clone_and_spawn();
        (0..2).for_each(|_| stage.app.update());
        stage.app.world_mut().despawn(more);
        (0..2).for_each(|_| stage.app.update());
        assert!(is_on_gpu(&stage, &mesh), "{index}");
        match index {
            0 => stage.insert(drawer, Mesh3d(other.clone())),
            _ => stage.insert(drawer, Mesh2d(other.clone())),
        }
        (0..2).for_each(|_| stage.app.update());
        assert!(!is_on_gpu(&stage, &mesh), "{index}");
        // Someone changes the handle in place.
        let mut drawer_mut = stage.app.world_mut().entity_mut(drawer);
        if index == 0 {
            drawer_mut.get_mut::<Mesh3d>().unwrap().0 = mesh.clone();
        } else {
            drawer_mut.get_mut::<Mesh2d>().unwrap().0 = mesh.clone();
        }
        stage.app.update();
        assert!(is_on_gpu(&stage, &mesh), "{index}");
        stage.app.world_mut().despawn(drawer);
        (0..2).for_each(|_| stage.app.update());
        assert!(!is_on_gpu(&stage, &mesh), "{index}");
    }
}

/// Beside what is cut, a whole mesh has the same source: as its finest level.
#[test]
fn source_stays_for_whole_meshes() {
    let Some((mut stage, rock, mesh, eye)) = stage_by_default() else {
        return;
    };
    let prop = stage.app.world_mut().entity_mut(rock).clone_and_spawn();
    let far = Transform::from_xyz(0.0, 0.0, -500.0);
    stage.insert(prop, (AutoLod::of_kind(LodKind::WholeMesh), far));
    stage.run_until_ready();
    (0..3).for_each(|_| stage.app.update());
    let camera = eye.entity;
    let level = |stage: &mut Stage| drawn_level(stage.app.world_mut(), prop, camera);
    assert!(level(&mut stage) > Some(0));
    // Another one that is cut has all looked at again.
    stage.app.world_mut().entity_mut(rock).clone_and_spawn();
    (0..3).for_each(|_| stage.app.update());
    assert!(is_on_gpu(&stage, &mesh));
    // In the frame in which the prop is near, it is drawn in full.
    stage.insert(prop, Transform::from_xyz(0.0, 0.0, 2.6));
    let [picture] = stage.shoot([&eye]);
    assert_eq!(level(&mut stage), Some(0));
    let blue = css::SKY_BLUE.to_u8_array().into();
    assert!(picture.pixels().filter(|pixel| **pixel != blue).count() > 40_000);
}

/// A program changes a source that the GPU has not: each frame is as if the GPU had it.
#[test]
fn changed_released_source_is_drawn() {
    let Some(kept) = stage_with(true) else {
        return;
    };
    let mut stages = [kept, stage_by_default().unwrap()];
    let [before, _] = shoot_each(&mut stages);
    for (stage, _, mesh, _) in &mut stages {
        let mut meshes = stage.app.world_mut().resource_mut::<Assets<Mesh>>();
        let flatter = meshes.get(&*mesh).unwrap().clone();
        let flatter = flatter.scaled_by(Vec3::new(1.0, 0.5, 1.0));
        *meshes.get_mut(&*mesh).unwrap() = flatter;
    }
    for frame in 0..4 {
        let [expected, picture] = shoot_each(&mut stages);
        assert_eq!(count_beyond(&picture, &expected, 2), 0, "{frame}");
        assert!(frame < 2 || count_beyond(&picture, &before, 2) > 500);
    }
    // Its levels are made anew once it rests.
    let deadline = Instant::now() + Duration::from_secs(120);
    for (stage, _, _, eye) in &mut stages {
        while stage.stats(eye).units_drawn == 0 {
            assert!(Instant::now() < deadline, "no levels");
            stage.app.update();
        }
    }
    let [expected, picture] = shoot_each(&mut stages);
    assert_eq!(count_beyond(&picture, &expected, 2), 0);
    let [is_kept, is_left] = stages
        .each_ref()
        .map(|(stage, _, mesh, _)| is_on_gpu(stage, mesh));
    assert!(is_kept && !is_left);
    for (stage, _, _, eye) in &mut stages {
        let full = FieldLodCamera::at_level(0);
        stage.insert(eye.entity, full);
    }
    let [expected, picture] = shoot_each(&mut stages);
    assert_eq!(count_beyond(&picture, &expected, 2), 0);
}

fn shoot_each(stages: &mut [(Stage, Entity, Handle<Mesh>, Eye); 2]) -> [RgbaImage; 2] {
    stages.each_mut().map(|(stage, _, _, eye)| {
        let [picture] = stage.shoot([&*eye]);
        picture
    })
}

/// On a new device all begins anew, sources included.
#[test]
fn released_source_survives_new_device() {
    let Some((mut stage, _, mesh, eye)) = stage_by_default() else {
        return;
    };
    let [before] = stage.shoot([&eye]);
    let render_app = stage.app.sub_app_mut(RenderApp);
    render_app.world_mut().run_schedule(RenderStartup);
    (0..2).for_each(|_| stage.app.update());
    stage.run_until_ready();
    (0..3).for_each(|_| stage.app.update());
    assert!(!is_on_gpu(&stage, &mesh));
    let [picture] = stage.shoot([&eye]);
    assert_eq!(count_beyond(&picture, &before, 2), 0);
    assert!(stage.stats(&eye).units_drawn > 0);
}
