//! Sources that the GPU does not have while their units are drawn.

use bevy::color::palettes::css;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::{Eye, Stage};

use crate::picture::{count_beyond, enclosed};

/// A stage with a rock and an eye that draws its cut.
fn stage_with(sources_on_gpu: bool) -> Option<(Stage, Entity, Handle<Mesh>, Eye)> {
    let mut stage = Stage::new()?;
    stage.app.insert_resource(FieldLodConfig {
        sources_on_gpu,
        ..default()
    });
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
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), FieldLodSettings::default());
    stage.run_until_ready();
    (0..3).for_each(|_| stage.app.update());
    Some((stage, rock, mesh, eye))
}

fn is_on_gpu(stage: &Stage, mesh: &Handle<Mesh>) -> bool {
    let render_world = stage.app.sub_app(RenderApp).world();
    let meshes = render_world.resource::<RenderAssets<RenderMesh>>();
    meshes.get(mesh).is_some()
}

#[test]
fn a_source_leaves_the_gpu_and_is_there_in_the_frame_that_draws_it() {
    let Some((mut kept, _, kept_mesh, its_eye)) = stage_with(true) else {
        return;
    };
    assert!(is_on_gpu(&kept, &kept_mesh));
    let [cut] = kept.shoot([&its_eye]);
    let full = FieldLodSettings {
        forced_level: Some(0),
        ..default()
    };
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
    stage.insert(eye.entity, FieldLodSettings::default());
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

#[test]
fn sources_stay_where_units_come_a_few_at_a_time_and_nothing_is_missing() {
    let Some((mut stage, _, mesh, eye)) = stage_with(false) else {
        return;
    };
    assert!(!is_on_gpu(&stage, &mesh));
    stage
        .app
        .world_mut()
        .resource_mut::<FieldLodConfig>()
        .units_per_frame = Some(2);
    let blue = css::SKY_BLUE.to_u8_array().into();
    for distance in [4.0, 2.0, 9.0, 2.5f32] {
        let pose = Transform::from_xyz(0.3 * distance, 0.0, distance);
        stage.insert(eye.entity, pose.looking_at(Vec3::ZERO, Vec3::Y));
        for _ in 0..3 {
            let [picture] = stage.shoot([&eye]);
            assert_eq!(enclosed(&picture, blue), 0, "at {distance}");
            assert!(picture.pixels().any(|pixel| *pixel != blue));
        }
    }
    assert!(is_on_gpu(&stage, &mesh));
    assert!(stage.stats(&eye).units_drawn > 0);
}
