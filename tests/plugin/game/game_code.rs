//! Game code sees the source of a prop that is drawn at a coarse level.

use std::collections::HashSet;
use std::fmt::Debug;

use bevy::camera::primitives::Aabb;
use bevy::ecs::system::RunSystemOnce;
use bevy::picking::mesh_picking::ray_cast::{MeshRayCast, MeshRayCastSettings};
use bevy::prelude::*;
use bevy::world_serialization::DynamicWorldBuilder;
use bevy_fieldlod::prelude::*;

use crate::headless::{add, app, level, origins, progress, ready, rock, run_until, spawn_camera};

/// A prop far from a camera: the app, the camera, the prop and its mesh.
struct FarProp {
    app: App,
    camera: Entity,
    prop: Entity,
    mesh: Handle<Mesh>,
}

impl FarProp {
    fn new(has_levels: bool) -> Self {
        let mut app = app();
        let camera = spawn_camera(&mut app, 1000.0);
        let mesh = add(&mut app, rock(4, 1));
        let material = MeshMaterial3d(add(&mut app, StandardMaterial::default()));
        let pose = Transform::from_xyz(0.3, 0.2, 0.1);
        let bundle = (Mesh3d(mesh.clone()), material, pose);
        let prop = app.world_mut().spawn(bundle).id();
        if has_levels {
            app.world_mut().entity_mut(prop).insert(AutoLod::default());
            ready(&mut app, 1);
            assert!(level(&mut app, prop, camera) > Some(2));
        }
        (0..3).for_each(|_| app.update());
        Self {
            app,
            camera,
            prop,
            mesh,
        }
    }

    /// The triangles of the mesh that `entity` refers to, as corners.
    fn collider(&self, entity: Entity) -> Vec<[Vec3; 3]> {
        let mesh = self.app.world().get::<Mesh3d>(entity).unwrap();
        let meshes = self.app.world().resource::<Assets<Mesh>>();
        let triangles = meshes.get(mesh).unwrap().triangles().unwrap();
        triangles.map(|triangle| triangle.vertices).collect()
    }
}

/// Calls `look` with levels and without, checks that the results are equal, and returns one.
fn as_in_stock_bevy<T: PartialEq + Debug>(look: impl Fn(&mut FarProp) -> T) -> T {
    let [seen, stock] = [true, false].map(|has_levels| look(&mut FarProp::new(has_levels)));
    assert_eq!(seen, stock);
    seen
}

/// The types of the components that a scene saves of `entity`, except those of the plugin.
fn mesh_components(app: &App, entity: Entity) -> HashSet<String> {
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let saved = DynamicWorldBuilder::from_world(app.world(), &registry)
        .extract_entity(entity)
        .build();
    let components = saved.entities[0].components.iter();
    let names = components.map(|component| component.reflect_type_path().to_owned());
    names
        .filter(|name| !name.starts_with("bevy_fieldlod::"))
        .collect()
}

#[test]
fn game_edits_the_source() {
    let edited = as_in_stock_bevy(|far| {
        let handle = far.app.world().get::<Mesh3d>(far.prop).unwrap().0.clone();
        let mut meshes = far.app.world_mut().resource_mut::<Assets<Mesh>>();
        let thinner = meshes.get(&handle).unwrap().clone();
        let thinner = thinner.scaled_by(Vec3::new(0.5, 1.0, 0.5));
        *meshes.get_mut(&handle).unwrap() = thinner;
        let bakes = origins(&far.app).len();
        let has_levels = bakes > 0;
        (0..3).for_each(|_| far.app.update());
        if has_levels {
            run_until(&mut far.app, "the edit is baked", |app| {
                origins(app).len() > bakes && progress(app).ready == 1
            });
            far.app.update();
            assert!(level(&mut far.app, far.prop, far.camera) > Some(2));
        }
        let aabb = *far.app.world().get::<Aabb>(far.prop).unwrap();
        (far.collider(far.prop), aabb)
    });
    assert_eq!(edited.0.len(), 5120);
}

/// A ray's hit: point, normal and index of the triangle.
type Hit = Option<(Vec3, Vec3, Option<usize>)>;

/// The hits of parallel rays at a grid of places.
fn cast_rays(app: &mut App) -> Vec<Hit> {
    let cast = |x: f32, y: f32| {
        let ray = Ray3d::new(Vec3::new(x, y, 50.0), Dir3::NEG_Z);
        move |mut caster: MeshRayCast| {
            let hits = caster.cast_ray(ray, &MeshRayCastSettings::default());
            let hit = hits.first();
            hit.map(|(_, hit)| (hit.point, hit.normal, hit.triangle_index))
        }
    };
    let places = (0..100u8).map(|place| (f32::from(place % 10), f32::from(place / 10)));
    let places = places.map(|(x, y)| (x * 0.3 - 1.2, y * 0.3 - 1.2));
    let hits = places.map(|(x, y)| app.world_mut().run_system_once(cast(x, y)).unwrap());
    hits.collect()
}

#[test]
fn game_code_sees_source_of_distant_prop() {
    let (found, triangles, components, _, hits) = as_in_stock_bevy(|far| {
        let mut meshes = far.app.world_mut().query::<&Mesh3d>();
        let meshes = meshes.iter(far.app.world());
        let found: Vec<bool> = meshes.map(|mesh| mesh.0 == far.mesh).collect();
        (
            found,
            far.collider(far.prop),
            mesh_components(&far.app, far.prop),
            *far.app.world().get::<Aabb>(far.prop).unwrap(),
            cast_rays(&mut far.app),
        )
    });
    assert_eq!(found, [true]);
    assert_eq!(triangles.len(), 5120);
    assert!(components.iter().any(|name| name.ends_with("Mesh3d")));
    let count = hits.iter().flatten().count();
    assert!(count > 20 && count < 100, "{count}");
}

#[test]
fn copies_of_distant_prop_have_the_source() {
    let (cloned, _, loaded) = as_in_stock_bevy(|far| {
        let clone = far.app.world_mut().entity_mut(far.prop).clone_and_spawn();
        far.app.world_mut().entity_mut(clone).remove::<AutoLod>();
        let world = far.app.world();
        let registry = world.resource::<AppTypeRegistry>().clone();
        let saved = DynamicWorldBuilder::from_world(world, &registry.read())
            .extract_entity(far.prop)
            .build();
        far.app.world_mut().entity_mut(far.prop).despawn();
        (0..3).for_each(|_| far.app.update());
        let cloned = (far.collider(clone), mesh_components(&far.app, clone));
        far.app.world_mut().entity_mut(clone).despawn();
        let world = far.app.world_mut();
        saved.write_to_world(world, &mut default()).unwrap();
        (0..3).for_each(|_| far.app.update());
        let mut meshes = far.app.world_mut().query::<(Entity, &Mesh3d)>();
        let (entity, mesh) = meshes.single(far.app.world()).unwrap();
        assert_eq!(mesh.0, far.mesh);
        (cloned.0, cloned.1, far.collider(entity))
    });
    assert_eq!([cloned.len(), loaded.len()], [5120; 2]);
}
