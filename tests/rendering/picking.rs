//! Rays, where the renderer has taken the data of units.

use bevy::asset::RenderAssetUsages;
use bevy::color::palettes::css;
use bevy::ecs::system::RunSystemOnce;
use bevy::picking::mesh_picking::ray_cast::{MeshRayCast, MeshRayCastSettings};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::Stage;

#[test]
fn rays_hit_source_only() {
    Stage::with_each_culling().for_each(check_rays);
}

fn check_rays(mut stage: Stage) {
    let rock = stage.add(bevy_mesh(&fieldlod_tests::rock(5, 5)));
    let stone = stage.add(StandardMaterial::default());
    let object = stage.spawn((Mesh3d(rock), MeshMaterial3d(stone), AutoLod::default()));
    let pose = Transform::from_xyz(0.0, 0.0, 4.0);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), FieldLodCamera::default());
    stage.run_until_ready();
    stage.app.update();
    assert!(stage.stats(&eye).units_drawn > 0);
    assert_eq!(hits(&mut stage), [object]);
}

/// All that a ray down the middle of the picture hits.
fn hits(stage: &mut Stage) -> Vec<Entity> {
    let ray = Ray3d::new(Vec3::new(0.01, 0.02, 50.0), Dir3::NEG_Z);
    let cast = move |mut caster: MeshRayCast| {
        let settings = MeshRayCastSettings::default().never_early_exit();
        let hits = caster.cast_ray(ray, &settings).iter();
        hits.map(|(entity, _)| *entity).collect::<Vec<_>>()
    };
    stage.app.world_mut().run_system_once(cast).unwrap()
}

#[test]
fn main_world_source_is_drawn_and_hit() {
    for subdivisions in [4, 5] {
        let Some(mut stage) = Stage::new() else {
            return;
        };
        let mut rock = bevy_mesh(&fieldlod_tests::rock(subdivisions, 5));
        rock.asset_usage = RenderAssetUsages::MAIN_WORLD;
        let rock = stage.add(rock);
        let stone = stage.add(StandardMaterial::from(Color::WHITE));
        let material = MeshMaterial3d(stone);
        let object = stage.spawn((Mesh3d(rock.clone()), material, AutoLod::default()));
        stage.spawn((DirectionalLight::default(), Transform::default()));
        let pose = Transform::from_xyz(0.0, 0.0, 4.0);
        let eye = stage.add_eye(pose, css::BLACK.into(), FieldLodCamera::default());
        stage.run_until_ready();
        stage.app.update();
        let [picture] = stage.shoot([&eye]);
        let covered = picture.pixels().filter(|pixel| pixel.0[0] > 20).count();
        assert!(covered > 5_000, "{covered} pixels");
        let render_world = stage.app.sub_app(RenderApp).world();
        let on_gpu = render_world.resource::<RenderAssets<RenderMesh>>();
        assert!(on_gpu.get(&rock).is_none());
        assert_eq!(hits(&mut stage), [object]);
    }
}
