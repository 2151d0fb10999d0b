//! Source meshes are on the GPU only while they are drawn. Rays hit them at any level.

use bevy::asset::RenderAssetUsages;
use bevy::color::palettes::css;
use bevy::ecs::system::RunSystemOnce;
use bevy::picking::mesh_picking::ray_cast::{MeshRayCast, MeshRayCastSettings};
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy::render::{RenderApp, RenderStartup};
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::frame_times::drop_commands;
use fieldlod_tests::stage::{Eye, Stage};

use crate::picture::count_beyond;

/// A rock that is drawn as units.
struct Show {
    stage: Stage,
    rock: Entity,
    mesh: Handle<Mesh>,
    eye: Eye,
}

impl Show {
    fn new(sources_on_gpu: bool) -> Option<Self> {
        let mut stage = Stage::new()?;
        stage.config().advanced.sources_on_gpu = sources_on_gpu;
        let mesh = stage.add(bevy_mesh(&fieldlod_tests::rock(5, 5)));
        let white = stage.add(StandardMaterial {
            unlit: true,
            ..Color::WHITE.into()
        });
        let material = MeshMaterial3d(white);
        let rock = stage.spawn((Mesh3d(mesh.clone()), material, AutoLod::default()));
        let pose = Transform::from_xyz(0.0, 0.0, 4.0);
        let eye = stage.add_eye(pose, css::SKY_BLUE.into(), FieldLodCamera::default());
        let mut show = Self {
            stage,
            rock,
            mesh,
            eye,
        };
        show.wait();
        Some(show)
    }

    /// Runs frames until all levels are ready, and three more.
    fn wait(&mut self) {
        self.stage.run_until_ready();
        (0..3).for_each(|_| self.stage.app.update());
    }

    fn is_on_gpu(&self) -> bool {
        let render_world = self.stage.app.sub_app(RenderApp).world();
        let meshes = render_world.resource::<RenderAssets<RenderMesh>>();
        meshes.get(&self.mesh).is_some()
    }
}

/// Checks that two shows have the same picture in the next frame.
fn assert_alike(a: &mut Show, b: &mut Show) {
    let [a, b] = [a, b].map(|show| {
        let [picture] = show.stage.shoot([&show.eye]);
        picture
    });
    assert_eq!(count_beyond(&a, &b, 2), 0);
}

#[test]
fn released_source_returns_in_the_same_frame() {
    let Some(mut kept) = Show::new(true) else {
        return;
    };
    let mut released = Show::new(false).unwrap();
    assert!(kept.is_on_gpu() && !released.is_on_gpu());
    assert_alike(&mut kept, &mut released);
    let each = |shows: [&mut Show; 2], change: fn(&mut Show)| {
        let [kept, released] = shows;
        change(kept);
        change(released);
        assert_alike(kept, released);
        assert!(released.is_on_gpu());
    };
    each([&mut kept, &mut released], |show| {
        let full = FieldLodCamera::at_level(0);
        show.stage.insert(show.eye.entity, full);
    });
    let cut = FieldLodCamera::default();
    for show in [&mut kept, &mut released] {
        show.stage.insert(show.eye.entity, cut);
        show.stage.app.update();
    }
    assert!(!released.is_on_gpu());
    // The file is loaded again.
    for show in [&mut kept, &mut released] {
        let mut meshes = show.stage.app.world_mut().resource_mut::<Assets<Mesh>>();
        let same = meshes.get(&show.mesh).unwrap().clone();
        meshes.insert(&show.mesh, same).unwrap();
    }
    (0..4).for_each(|_| assert_alike(&mut kept, &mut released));
    assert!(!released.is_on_gpu());
    // The game edits the source.
    for show in [&mut kept, &mut released] {
        let mut meshes = show.stage.app.world_mut().resource_mut::<Assets<Mesh>>();
        let flatter = meshes.get(&show.mesh).unwrap().clone();
        let flatter = flatter.scaled_by(Vec3::new(1.0, 0.5, 1.0));
        *meshes.get_mut(&show.mesh).unwrap() = flatter;
    }
    (0..4).for_each(|_| assert_alike(&mut kept, &mut released));
    for show in [&mut kept, &mut released] {
        let eye = &show.eye;
        show.stage
            .run_until("units are drawn", |stage| stage.stats(eye).units_drawn > 0);
        show.wait();
    }
    assert!(!released.is_on_gpu());
    each([&mut kept, &mut released], |show| {
        let mut rock = show.stage.app.world_mut().entity_mut(show.rock);
        rock.remove::<AutoLod>();
    });
}

/// A source that other entities draw stays on the GPU while they exist.
#[test]
fn shared_source_stays_on_gpu() {
    let Some(mut show) = Show::new(false) else {
        return;
    };
    drop_commands(&mut show.stage.app);
    let mesh = show.mesh.clone();
    let other = show.stage.add(Mesh::from(Cuboid::default()));
    let far = Transform::from_xyz(0.0, 0.0, -500.0);
    // The users are a plain mesh, a 2D mesh, and a whole mesh, whose finest level is the source.
    for index in 0..3 {
        assert!(!show.is_on_gpu(), "{index}");
        let user = match index {
            0 => show.stage.spawn((Mesh3d(mesh.clone()), NoLod)),
            1 => show.stage.spawn(Mesh2d(mesh.clone())),
            _ => {
                let whole = AutoLod::of_kind(LodKind::WholeMesh);
                show.stage.spawn((Mesh3d(mesh.clone()), whole, far))
            }
        };
        show.stage.app.update();
        assert!(show.is_on_gpu(), "{index}");
        show.wait();
        // A copy with units is spawned and despawned.
        let mut rock = show.stage.app.world_mut().entity_mut(show.rock);
        let copy = rock.clone_and_spawn();
        show.wait();
        show.stage.app.world_mut().despawn(copy);
        show.wait();
        assert!(show.is_on_gpu(), "{index}");
        // A new component replaces the mesh of the user. Then its handle is changed back to the source.
        if index == 1 {
            show.stage.insert(user, Mesh2d(other.clone()));
        } else {
            show.stage.insert(user, Mesh3d(other.clone()));
        }
        (0..2).for_each(|_| show.stage.app.update());
        assert!(!show.is_on_gpu(), "{index}");
        let mut user_mut = show.stage.app.world_mut().entity_mut(user);
        if index == 1 {
            user_mut.get_mut::<Mesh2d>().unwrap().0 = mesh.clone();
        } else {
            user_mut.get_mut::<Mesh3d>().unwrap().0 = mesh.clone();
        }
        (0..2).for_each(|_| show.stage.app.update());
        assert!(show.is_on_gpu(), "{index}");
        show.stage.app.world_mut().despawn(user);
        (0..2).for_each(|_| show.stage.app.update());
    }
}

#[test]
fn new_device_draws_units_again() {
    let Some(mut show) = Show::new(false) else {
        return;
    };
    let [before] = show.stage.shoot([&show.eye]);
    // Bevy runs this schedule after it has replaced a lost device.
    let render_app = show.stage.app.sub_app_mut(RenderApp);
    render_app.world_mut().run_schedule(RenderStartup);
    (0..2).for_each(|_| show.stage.app.update());
    assert_eq!(show.stage.stats(&show.eye).units_drawn, 0);
    show.wait();
    assert!(!show.is_on_gpu());
    let [picture] = show.stage.shoot([&show.eye]);
    assert_eq!(count_beyond(&picture, &before, 2), 0);
    assert!(show.stage.stats(&show.eye).units_drawn > 0);
}

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

/// The entities that a ray through the middle of the picture hits.
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
    let Some(mut stage) = Stage::new() else {
        return;
    };
    let stone = stage.add(StandardMaterial::from(Color::WHITE));
    stage.spawn((DirectionalLight::default(), Transform::default()));
    let pose = Transform::from_xyz(0.0, 0.0, 4.0);
    let eye = stage.add_eye(pose, css::BLACK.into(), FieldLodCamera::default());
    // A prop and a mesh with units.
    for subdivisions in [4, 5] {
        let mut rock = bevy_mesh(&fieldlod_tests::rock(subdivisions, 5));
        rock.asset_usage = RenderAssetUsages::MAIN_WORLD;
        let rock = stage.add(rock);
        let material = MeshMaterial3d(stone.clone());
        let object = stage.spawn((Mesh3d(rock.clone()), material, AutoLod::default()));
        stage.run_until_ready();
        stage.app.update();
        let [picture] = stage.shoot([&eye]);
        let covered = picture.pixels().filter(|pixel| pixel.0[0] > 20).count();
        assert!(covered > 5_000, "{covered} pixels");
        let render_world = stage.app.sub_app(RenderApp).world();
        let on_gpu = render_world.resource::<RenderAssets<RenderMesh>>();
        assert!(on_gpu.get(&rock).is_none());
        assert_eq!(hits(&mut stage), [object]);
        stage.app.world_mut().despawn(object);
    }
}

#[test]
fn reinserted_mesh_is_drawn() {
    for mut stage in Stage::with_each_culling() {
        let white = stage.add(StandardMaterial {
            unlit: true,
            ..Color::WHITE.into()
        });
        let mut spawn = |subdivisions, x| {
            let mesh = stage.add(bevy_mesh(&fieldlod_tests::rock(subdivisions, 5)));
            let material = MeshMaterial3d(white.clone());
            let place = Transform::from_xyz(x, 0.0, 0.0);
            stage.spawn((Mesh3d(mesh), material, place, AutoLod::default()))
        };
        let rocks = [spawn(3, -1.2), spawn(5, 1.2)];
        let pose = Transform::from_xyz(0.0, 0.0, 6.0);
        let eye = stage.add_eye(pose, css::SKY_BLUE.into(), FieldLodCamera::default());
        stage.run_until_ready();
        let [before] = stage.shoot([&eye]);
        for frames in [0, 1, 3] {
            for rock in rocks {
                let mesh = stage.app.world_mut().entity_mut(rock).take::<Mesh3d>();
                (0..frames).for_each(|_| stage.app.update());
                stage.insert(rock, mesh.unwrap());
            }
            (0..3).for_each(|_| stage.app.update());
            stage.run_until_ready();
            let [after] = stage.shoot([&eye]);
            assert_eq!(count_beyond(&before, &after, 2), 0, "after {frames} frames");
        }
    }
}

/// Bevy draws a mesh that a game has removed from `Assets<Mesh>` as long as a handle exists.
#[test]
fn mesh_removed_from_assets_is_drawn() {
    let Some(mut show) = Show::new(true) else {
        return;
    };
    let full = FieldLodCamera::at_level(0);
    show.stage.insert(show.eye.entity, full);
    let [before] = show.stage.shoot([&show.eye]);
    show.stage.insert(show.eye.entity, FieldLodCamera::low());
    show.wait();
    let mut meshes = show.stage.app.world_mut().resource_mut::<Assets<Mesh>>();
    assert!(meshes.remove(&show.mesh).is_some());
    (0..4).for_each(|_| show.stage.app.update());
    let [after] = show.stage.shoot([&show.eye]);
    assert_eq!(count_beyond(&before, &after, 2), 0);
}
