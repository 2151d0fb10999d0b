//! Rays, where the renderer has taken the data of units.

use bevy::color::palettes::css;
use bevy::ecs::system::RunSystemOnce;
use bevy::picking::mesh_picking::ray_cast::{MeshRayCast, MeshRayCastSettings};
use bevy::prelude::*;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::Stage;

#[test]
fn rays_hit_the_source_and_never_its_units() {
    let Some(mut stage) = Stage::new() else {
        return;
    };
    let rock = stage.add(bevy_mesh(&fieldlod_tests::rock(5, 5)));
    let stone = stage.add(StandardMaterial::default());
    let object = stage.spawn((Mesh3d(rock), MeshMaterial3d(stone), AutoLod::default()));
    let pose = Transform::from_xyz(0.0, 0.0, 4.0);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), FieldLodSettings::default());
    stage.run_until_ready();
    stage.app.update();
    assert!(stage.stats(&eye).units_drawn > 0);
    let ray = Ray3d::new(Vec3::new(0.01, 0.02, 50.0), Dir3::NEG_Z);
    let cast = move |mut caster: MeshRayCast| {
        let settings = MeshRayCastSettings::default().never_early_exit();
        let hits = caster.cast_ray(ray, &settings).iter();
        hits.map(|(entity, _)| *entity).collect::<Vec<_>>()
    };
    let hits = stage.app.world_mut().run_system_once(cast).unwrap();
    assert_eq!(hits, [object]);
}
