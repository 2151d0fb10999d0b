//! Coarser levels cast the shadows of props in the far cascades of a sun.

use bevy::color::palettes::css;
use bevy::light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap, NotShadowCaster};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::sync_world::MainEntity;
use bevy::render::view::{RenderShadowMapVisibleEntities, RenderVisibleEntities};
use bevy_fieldlod::LodUnit;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::{Eye, Stage};

use crate::picture::{count, difference};

const CASCADES: usize = 3;

/// A prop near the camera, whose shadow falls into the second of a sun's three cascades.
struct Noon {
    stage: Stage,
    prop: Entity,
    sun: Entity,
    eye: Eye,
}

impl Noon {
    fn new() -> Option<Self> {
        let mut stage = Stage::new()?;
        stage
            .app
            .insert_resource(DirectionalLightShadowMap { size: 512 });
        let stone = stage.add(StandardMaterial::from(Color::srgb(0.6, 0.5, 0.4)));
        let rock = stage.add(bevy_mesh(&fieldlod_tests::rock(4, 7)));
        let place = Transform::from_xyz(0.0, 1.2, 0.0);
        let material = MeshMaterial3d(stone.clone());
        let prop = stage.spawn((Mesh3d(rock), material, place, AutoLod::default()));
        let ground = stage.add(Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(100.0))));
        stage.spawn((Mesh3d(ground), MeshMaterial3d(stone)));
        let cascades = CascadeShadowConfigBuilder {
            num_cascades: CASCADES,
            first_cascade_far_bound: 2.0,
            maximum_distance: 100.0,
            ..default()
        };
        let sun = stage.spawn((
            DirectionalLight {
                shadow_maps_enabled: true,
                ..default()
            },
            cascades.build(),
            Transform::default().looking_to(Vec3::new(-1.0, -0.8, -0.3), Vec3::Y),
        ));
        let pose = Transform::from_xyz(1.0, 2.0, 4.0).looking_at(Vec3::new(0.0, 0.7, 0.0), Vec3::Y);
        let settings = FieldLodSettings {
            shadow_error_texels: 2.0,
            ..default()
        };
        let eye = stage.add_eye(pose, css::SKY_BLUE.into(), settings);
        let mut noon = Self {
            stage,
            prop,
            sun,
            eye,
        };
        noon.stage.run_until_ready();
        noon.stage.app.update();
        Some(noon)
    }

    fn set(&mut self, settings: FieldLodSettings) {
        self.stage.insert(self.eye.entity, settings);
        self.stage.app.update();
    }

    fn with_shadow_error(&mut self, shadow_error_texels: f32) {
        self.set(FieldLodSettings {
            shadow_error_texels,
            ..default()
        });
    }

    /// What the camera draws of the prop, and then each cascade: its triangles; 0 if it is not drawn.
    fn triangles(&mut self) -> [usize; 1 + CASCADES] {
        let render_world = self.stage.app.sub_app_mut(RenderApp).world_mut();
        let listed = |list: &RenderVisibleEntities| -> Vec<Entity> {
            let class = &list.classes[&std::any::TypeId::of::<Mesh3d>()];
            let entities = class.entities_gpu_culling.keys();
            entities
                .copied()
                .map(|entity: MainEntity| entity.id())
                .collect()
        };
        let mut cameras = render_world.query::<&RenderVisibleEntities>();
        let of_camera = listed(cameras.single(render_world).unwrap());
        let mut suns = render_world.query::<&RenderShadowMapVisibleEntities>();
        let cascades = &suns.single(render_world).unwrap().subviews;
        let mut cascades: Vec<_> = cascades.iter().collect();
        cascades.sort_by_key(|(key, _)| key.subview_index);
        let mut lists = vec![of_camera];
        lists.extend(cascades.into_iter().map(|(_, list)| listed(list)));
        let world = self.stage.app.world();
        let triangles = |entity: &Entity| {
            let entity = world.get_entity(*entity).expect("what is drawn is there");
            let is_ours = entity.contains::<LodUnit>() || entity.contains::<AutoLod>();
            let mesh = entity.get::<Mesh3d>().filter(|_| is_ours)?;
            let mesh = world.resource::<Assets<Mesh>>().get(mesh).unwrap();
            Some(mesh.indices().unwrap().len() / 3)
        };
        let sums = lists
            .iter()
            .map(|list| list.iter().filter_map(triangles).sum());
        sums.collect::<Vec<usize>>().try_into().unwrap()
    }

    fn unit_count(&mut self) -> usize {
        let world = self.stage.app.world_mut();
        world.query::<&LodUnit>().iter(world).count()
    }
}

#[test]
fn far_cascades_draw_coarser_levels_of_props() {
    let Some(mut noon) = Noon::new() else {
        return;
    };
    let [drawn, near, middle, far] = noon.triangles();
    assert_eq!(near, drawn);
    assert!(
        far < middle && middle < near && far > 0,
        "{middle}, {far} of {drawn}"
    );
    assert!(4 * far < drawn, "{far} of {drawn}");
    // The shadow is that of the prop: of another level, but there.
    let [coarse] = noon.stage.shoot([&noon.eye]);
    noon.with_shadow_error(0.0);
    assert_eq!(noon.triangles(), [drawn; 4]);
    let [exact] = noon.stage.shoot([&noon.eye]);
    noon.stage.insert(noon.prop, NotShadowCaster);
    let [without] = noon.stage.shoot([&noon.eye]);
    let [altered, all] = [&coarse, &without].map(|one| count(&difference(one, &exact)));
    assert!(
        altered > 0 && all > 2_000 && 10 * altered < all,
        "{altered} of {all}"
    );
}

#[test]
fn shadows_keep_up_with_what_casts_them() {
    let Some(mut noon) = Noon::new() else {
        return;
    };
    let [drawn, .., far] = noon.triangles();
    // Errors of what is twice as large are twice as large.
    let place = Transform::from_xyz(0.0, 1.2, 0.0);
    noon.stage
        .insert(noon.prop, place.with_scale(Vec3::splat(6.0)));
    noon.stage.app.update();
    assert!(noon.triangles()[CASCADES] > far);
    // One that is far away is drawn as coarsely as its shadow.
    noon.stage
        .insert(noon.prop, Transform::from_xyz(0.0, 1.2, -400.0));
    noon.stage.app.update();
    let [coarse, cascades @ ..] = noon.triangles();
    assert!(coarse < drawn && cascades == [coarse; CASCADES]);
    noon.stage.insert(noon.prop, place);
    noon.stage.app.update();
    assert_eq!(noon.triangles()[CASCADES], far);
    // A camera that leaves it out has no shadow of it.
    noon.set(FieldLodSettings {
        cull_below_px: Some(1e6),
        ..default()
    });
    assert_eq!(noon.triangles(), [0; 1 + CASCADES]);
    noon.with_shadow_error(2.0);
    assert_eq!(noon.triangles()[CASCADES], far);
    // Coarser shadows end with the cut.
    noon.set(FieldLodSettings {
        forced_level: Some(0),
        ..default()
    });
    let [full, cascades @ ..] = noon.triangles();
    assert!(full >= drawn && cascades == [full; CASCADES]);
    noon.with_shadow_error(2.0);
    assert_eq!(noon.triangles()[CASCADES], far);
    // What casts none has none in any cascade, until it does again.
    noon.stage.insert(noon.prop, NotShadowCaster);
    noon.stage.app.update();
    assert_eq!(noon.triangles(), [drawn, 0, 0, 0]);
    let mut prop = noon.stage.app.world_mut().entity_mut(noon.prop);
    prop.remove::<NotShadowCaster>();
    noon.stage.app.update();
    assert_eq!(noon.triangles()[CASCADES], far);
    // So do they with the sun.
    noon.stage.insert(noon.sun, Visibility::Hidden);
    noon.stage.app.update();
    noon.stage.insert(noon.sun, Visibility::Visible);
    noon.stage.app.update();
    assert_eq!(noon.triangles()[CASCADES], far);
    // What is gone leaves nothing behind.
    assert!(noon.unit_count() > 0);
    noon.stage
        .app
        .world_mut()
        .entity_mut(noon.prop)
        .remove::<AutoLod>();
    noon.stage.app.update();
    assert_eq!(noon.unit_count(), 0);
    noon.stage.insert(noon.prop, AutoLod::default());
    noon.stage.run_until_ready();
    noon.stage.app.update();
    assert_eq!(noon.triangles()[CASCADES], far);
    noon.stage.app.world_mut().entity_mut(noon.prop).despawn();
    noon.stage.app.update();
    assert_eq!(noon.triangles(), [0; 1 + CASCADES]);
    assert_eq!(noon.unit_count(), 0);
}

#[test]
fn a_caster_has_the_material_of_its_object() {
    let Some(mut noon) = Noon::new() else {
        return;
    };
    let glass = noon.stage.add(StandardMaterial::default());
    noon.stage.insert(noon.prop, MeshMaterial3d(glass.clone()));
    noon.stage.app.update();
    let world = noon.stage.app.world_mut();
    let mut units = world.query_filtered::<&MeshMaterial3d<StandardMaterial>, With<LodUnit>>();
    let materials: Vec<_> = units
        .iter(world)
        .map(|material| material.0.clone())
        .collect();
    assert!(!materials.is_empty() && materials.iter().all(|one| *one == glass));
}

#[test]
fn a_sun_that_was_dimmed_casts_its_shadows_again() {
    let Some(mut noon) = Noon::new() else {
        return;
    };
    let mut shine = |shadow_maps_enabled: bool, illuminance: f32| {
        let world = noon.stage.app.world_mut();
        let mut light = world.get_mut::<DirectionalLight>(noon.sun).unwrap();
        (light.shadow_maps_enabled, light.illuminance) = (shadow_maps_enabled, illuminance);
        noon.stage.app.update();
        let [picture] = noon.stage.shoot([&noon.eye]);
        picture
    };
    let [before, dark, after] =
        [(true, 5_000.0), (false, 0.0), (true, 5_000.0)].map(|(casts, lux)| shine(casts, lux));
    assert!(count(&difference(&before, &dark)) > 10_000);
    assert_eq!(count(&difference(&before, &after)), 0);
}
