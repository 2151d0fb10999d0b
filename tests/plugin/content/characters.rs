//! Characters: a bending tube of two primitives with one skin, and a ball with a morph target.

use std::path::Path;

use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::RenderLayers;
use bevy::ecs::system::RunSystemOnce;
use bevy::log::tracing::Level;
use bevy::mesh::morph::{MeshMorphWeights, MorphWeights};
use bevy::mesh::skinning::{SkinnedMesh, SkinnedMeshInverseBindposes};
use bevy::picking::mesh_picking::ray_cast::{MeshRayCast, MeshRayCastSettings};
use bevy::prelude::*;
use bevy_fieldlod::LodOrigin::{Baked, BesideAsset, Cache, File};
use bevy_fieldlod::prelude::*;
use bevy_fieldlod::{LodError, LodOrigin};
use fieldlod_bake::{BakeConfig, bake_file};

use super::scenes::spawn_scene;
use crate::character_files::{ball, tube};
use crate::gltf_file::GltfFile;
use crate::headless::{
    Events, app_in, entity_count, insert, level, logged, move_camera, origins, progress, ready,
    rock, run_until, spawn_camera, stats,
};

/// An app with a camera, and the file of its scene.
struct Show {
    app: App,
    camera: Entity,
    file: GltfFile,
}

impl Show {
    fn new(mut file: GltfFile, distance: f32) -> Self {
        file.glb();
        let mut app = app_in(file.folder());
        let camera = spawn_camera(&mut app, distance);
        Self { app, camera, file }
    }

    /// The scene at a distance, with its levels.
    fn ready(file: GltfFile, distance: f32) -> (Self, Entity) {
        let mut show = Self::new(file, distance);
        let root = show.spawn(AutoLod::default());
        let parts = show.parts_when_loaded(root).len() as u32;
        ready(&mut show.app, parts);
        (show, root)
    }

    fn spawn(&mut self, bundle: impl Bundle) -> Entity {
        let assets = self.app.world().resource::<AssetServer>();
        let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("mesh.glb"));
        self.app
            .world_mut()
            .spawn((WorldAssetRoot(scene), bundle))
            .id()
    }

    /// The mesh entities below `root`.
    fn parts(&mut self, root: Entity) -> Vec<Entity> {
        let find = move |children: Query<&Children>, meshes: Query<(), With<Mesh3d>>| {
            let below = children.iter_descendants(root);
            let with_mesh = below.filter(|entity| meshes.contains(*entity));
            with_mesh.collect::<Vec<Entity>>()
        };
        self.app.world_mut().run_system_once(find).unwrap()
    }

    fn parts_when_loaded(&mut self, root: Entity) -> Vec<Entity> {
        run_until(&mut self.app, "the scene is loaded", |app| {
            entity_count(app) > 0
        });
        self.parts(root)
    }

    /// The common level of all parts below `root`.
    fn level(&mut self, root: Entity) -> Option<u32> {
        let camera = self.camera;
        let parts = self.parts(root);
        let mut levels = parts.iter().map(|part| level(&mut self.app, *part, camera));
        let first = levels.next().unwrap();
        assert!(
            levels.all(|level| level == first),
            "a part has another level"
        );
        first
    }

    /// The first joint of the skin of the parts below `root`.
    fn joint(&mut self, root: Entity) -> Entity {
        let part = self.parts(root)[0];
        self.app.world().get::<SkinnedMesh>(part).unwrap().joints[0]
    }

    /// Moves an entity away from the camera, and draws a frame.
    fn move_away(&mut self, entity: Entity, distance: f32) {
        let mut transform = self.app.world_mut().get_mut::<Transform>(entity).unwrap();
        transform.translation.z = -distance;
        self.app.update();
    }
}

#[test]
fn parts_change_level_together() {
    let mut show = Show::new(tube(), 1.0);
    // Parts with few triangles have levels too.
    let mut config = show.app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.plain_below_triangles = u32::MAX;
    let root = show.spawn(AutoLod::default());
    show.parts_when_loaded(root);
    ready(&mut show.app, 2);
    assert_eq!(origins(&show.app), [Baked; 2]);
    let mut level_at = |step: i32| {
        move_camera(&mut show.app, show.camera, 1.2f32.powi(step));
        show.level(root).unwrap()
    };
    let away: Vec<u32> = (0..50).map(&mut level_at).collect();
    let back: Vec<u32> = (0..50).rev().map(&mut level_at).collect();
    assert!(away.is_sorted() && back.is_sorted_by(|a, b| a >= b));
    assert!(away[0] == 0 && away[49] >= 3 && back[49] == 0, "{away:?}");
    let near = stats(&show.app, show.camera);
    assert_eq!(near.triangles_drawn, near.triangles_full);
}

#[test]
fn parts_get_levels_in_same_frame() {
    #[derive(Resource, Default)]
    struct ReadyFrames(Vec<u32>);
    let mut show = Show::new(tube(), 300.0);
    show.app.init_resource::<ReadyFrames>();
    let note = |_: On<LodReady>,
                frame: Res<bevy::diagnostic::FrameCount>,
                mut frames: ResMut<ReadyFrames>| {
        frames.0.push(frame.0);
    };
    let root = show.spawn(AutoLod::default());
    show.app.world_mut().entity_mut(root).observe(note);
    show.parts_when_loaded(root);
    // Until both parts are ready, their sources are drawn.
    assert_eq!(show.level(root), None);
    ready(&mut show.app, 2);
    let frames = &show.app.world().resource::<ReadyFrames>().0;
    assert!(frames.len() == 2 && frames[0] == frames[1], "{frames:?}");
    assert!(show.level(root) > Some(1));
}

#[test]
fn level_follows_joints() {
    let (mut show, root) = Show::ready(tube(), 8.0);
    let near = show.level(root).unwrap();
    // Bevy draws a skinned mesh by its joints alone.
    for part in show.parts(root) {
        show.move_away(part, 2000.0);
    }
    assert_eq!(show.level(root), Some(near));
    let joint = show.joint(root);
    show.move_away(joint, 2000.0);
    assert!(show.level(root) > Some(near + 1));
    show.move_away(joint, 0.0);
    assert_eq!(show.level(root), Some(near));
    let mut transform = show.app.world_mut().get_mut::<Transform>(joint).unwrap();
    transform.scale *= 0.01;
    show.app.update();
    assert!(show.level(root) > Some(near + 1));
}

#[test]
fn level_of_morphed_mesh_follows_its_transform() {
    let (mut show, root) = Show::ready(ball(), 3.0);
    let near = show.level(root).unwrap();
    let part = show.parts(root)[0];
    show.move_away(part, 2000.0);
    assert!(show.level(root) > Some(near + 1));
}

/// The components that the game or Bevy sets on the parts, as text.
fn components(show: &mut Show, root: Entity) -> Vec<String> {
    let describe = |entity: EntityRef| {
        let skin = entity.get::<SkinnedMesh>();
        let weights = entity.get::<MeshMorphWeights>().unwrap();
        let MeshMorphWeights::Reference(of) = weights else {
            panic!("loaded weights are references");
        };
        let (mesh, aabb) = (entity.get::<Mesh3d>(), entity.get::<Aabb>());
        format!("{mesh:?} {:?} {of} {aabb:?}", skin.map(|skin| &skin.joints))
    };
    let parts = show.parts(root);
    let world = show.app.world();
    parts
        .iter()
        .map(|part| describe(world.entity(*part)))
        .collect()
}

#[test]
fn level_change_keeps_components() {
    for file in [tube(), ball()] {
        let mut show = Show::new(file, 1.0);
        let root = show.spawn(());
        show.parts_when_loaded(root);
        let mut weights = show.app.world_mut().query::<&mut MorphWeights>();
        for mut weights in weights.iter_mut(show.app.world_mut()) {
            weights.weights_mut()[0] = 0.7;
        }
        (0..3).for_each(|_| show.app.update());
        let before = components(&mut show, root);
        insert(&mut show.app, root, AutoLod::default());
        ready(&mut show.app, before.len() as u32);
        for distance in [1.0, 3000.0, 1.0] {
            move_camera(&mut show.app, show.camera, distance);
            assert_eq!(components(&mut show, root), before);
        }
        let mut weights = show.app.world_mut().query::<&MorphWeights>();
        let mut weights = weights.iter(show.app.world());
        assert!(weights.all(|weights| weights.weights() == [0.7]));
    }
}

#[test]
fn clone_has_level_of_its_own() {
    let (mut show, root) = Show::ready(tube(), 8.0);
    let near = show.level(root);
    let child = show.app.world().get::<Children>(root).unwrap()[0];
    let mut original = show.app.world_mut().entity_mut(child);
    let clone = original.clone_and_spawn_with_opt_out(|cloner| {
        cloner.linked_cloning(true);
    });
    insert(&mut show.app, clone, AutoLod::default());
    show.app.world_mut().entity_mut(clone).remove::<ChildOf>();
    ready(&mut show.app, 4);
    assert_eq!(origins(&show.app), [Baked; 2]);
    let joint = show.joint(clone);
    assert_ne!(joint, show.joint(root));
    show.move_away(joint, 2000.0);
    assert!(show.level(clone) > near);
    assert_eq!(show.level(root), near);
    show.app.world_mut().entity_mut(root).despawn();
    show.app.update();
    assert_eq!(progress(&show.app).ready, 2);
    show.app.world_mut().entity_mut(joint).despawn();
    show.app.update();
    show.app.world_mut().entity_mut(clone).despawn();
    (0..2).for_each(|_| show.app.update());
    assert_eq!(progress(&show.app), FieldLodProgress::default());
    assert_eq!(stats(&show.app, show.camera).triangles_full, 0);
}

#[test]
fn character_has_finest_level_of_all_views() {
    let (mut show, root) = Show::ready(tube(), 2000.0);
    let far = show.level(root);
    assert!(far > Some(2));
    let near = spawn_camera(&mut show.app, 2.0);
    (0..2).for_each(|_| show.app.update());
    assert_eq!(show.level(root), Some(0));
    insert(&mut show.app, near, RenderLayers::layer(3));
    show.app.update();
    assert_eq!(show.level(root), far);
    for part in show.parts(root) {
        insert(&mut show.app, part, RenderLayers::from_layers(&[0, 3]));
    }
    show.app.update();
    assert_eq!(show.level(root), Some(0));
}

#[test]
fn offscreen_character_has_level_of_its_shadow() {
    let (mut show, root) = Show::ready(tube(), 8.0);
    let away = Transform::from_xyz(0.0, 0.0, 8.0).looking_to(Vec3::Z, Vec3::Y);
    insert(&mut show.app, show.camera, away);
    show.app.update();
    let unlit = show.level(root);
    show.app.world_mut().spawn((
        DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::default().looking_to(Vec3::new(0.1, -0.1, 1.0), Vec3::Y),
    ));
    (0..2).for_each(|_| show.app.update());
    let lit = show.level(root);
    assert!(lit < unlit, "{lit:?} {unlit:?}");
}

#[test]
fn rays_hit_parts_at_any_level() {
    let hits = [true, false].map(|has_levels| {
        let mut show = Show::new(tube(), 2000.0);
        let root = show.spawn(());
        show.parts_when_loaded(root);
        if has_levels {
            insert(&mut show.app, root, AutoLod::default());
            ready(&mut show.app, 2);
            assert!(show.level(root) > Some(2));
        }
        (0..3).for_each(|_| show.app.update());
        let cast = |mut caster: MeshRayCast| {
            let heights = (0..30u8).map(|step| 0.05 + 0.13 * f32::from(step));
            let hits = heights.map(|height| {
                let ray = Ray3d::new(Vec3::new(0.05, height, 50.0), Dir3::NEG_Z);
                let hits = caster.cast_ray(ray, &MeshRayCastSettings::default());
                hits.first().map(|(_, hit)| (hit.point, hit.triangle_index))
            });
            hits.collect::<Vec<_>>()
        };
        show.app.world_mut().run_system_once(cast).unwrap()
    });
    assert_eq!(hits[0], hits[1]);
    assert!(hits[0].iter().flatten().count() > 20);
}

/// The origins of the levels of the parts.
fn run(file: &GltfFile, cache: Option<&Path>, lods: Option<&'static str>) -> Vec<LodOrigin> {
    let mut app = app_in(file.folder());
    app.world_mut()
        .resource_mut::<FieldLodAppConfig>()
        .cache_folder = cache.map(Path::to_owned);
    let camera = spawn_camera(&mut app, 2000.0);
    spawn_scene(&mut app, lods);
    ready(&mut app, 2);
    let drawn = stats(&app, camera);
    assert!(
        drawn.triangles_drawn * 4 < drawn.triangles_full,
        "{drawn:?}"
    );
    origins(&app)
}

#[test]
fn levels_come_from_cache_and_files() {
    let mut file = tube();
    let glb = file.glb();
    let cache = tempfile::tempdir().unwrap();
    assert_eq!(run(&file, Some(cache.path()), None), [Baked; 2]);
    assert_eq!(run(&file, Some(cache.path()), None), [Cache; 2]);
    let baked = bake_file(&glb, &BakeConfig::default(), &|_| ())
        .unwrap()
        .file;
    let bytes = baked.to_bytes();
    file.write("lods.fieldlod", &bytes);
    assert_eq!(run(&file, None, Some("lods.fieldlod")), [File; 2]);
    file.write("mesh.fieldlod", &bytes);
    assert_eq!(run(&file, None, None), [BesideAsset; 2]);
    // Levels depend on the clips of the file.
    std::fs::remove_file(file.folder().join("mesh.fieldlod")).unwrap();
    file.list("animations").pop();
    file.glb();
    assert_eq!(run(&file, Some(cache.path()), None), [Baked; 2]);
}

#[test]
fn reloaded_character_is_baked_again() {
    let (mut show, root) = Show::ready(tube(), 2000.0);
    assert_eq!(origins(&show.app).len(), 2);
    // Without a watcher, Bevy reloads only files that were loaded as a whole.
    let assets = show.app.world().resource::<AssetServer>();
    let _whole = assets.load::<Gltf>("mesh.glb");
    // The first coordinate of the first vertex.
    show.file.binary[..4].copy_from_slice(&0.4f32.to_le_bytes());
    show.file.glb();
    show.app
        .world()
        .resource::<AssetServer>()
        .reload("mesh.glb");
    run_until(&mut show.app, "both are baked again", |app| {
        origins(app).len() == 4
    });
    let parts = show.parts_when_loaded(root).len() as u32;
    ready(&mut show.app, parts);
    assert!(show.level(root) > Some(2));
}

#[test]
fn edited_part_draws_its_source() {
    let (mut show, root) = Show::ready(tube(), 2000.0);
    let part = show.parts(root)[0];
    let mesh = show.app.world().get::<Mesh3d>(part).unwrap().0.clone();
    let mut meshes = show.app.world_mut().resource_mut::<Assets<Mesh>>();
    let scaled = meshes.get(&mesh).unwrap().clone();
    meshes
        .insert(&mesh, scaled.scaled_by(Vec3::splat(1.5)))
        .unwrap();
    // The mesh is prepared again after 30 frames without a change.
    run_until(&mut show.app, "it has failed", |app| {
        let mut events = app.world().resource::<Events>().0.iter();
        events.any(is_rigged)
    });
    show.app.update();
    let progress = progress(&show.app);
    assert_eq!((progress.ready, progress.plain), (1, 1));
}

/// Whether a mesh failed with [`LodError::Rigged`].
fn is_rigged(event: &FieldLodEvent) -> bool {
    let FieldLodEvent::Failed { error, .. } = event else {
        return false;
    };
    *error == LodError::Rigged
}

#[test]
fn skin_without_file_draws_its_source() {
    let mut app = app_in(Path::new("."));
    let mesh = rock(4, 1);
    let count = mesh.count_vertices();
    let mesh = mesh
        .with_inserted_attribute(
            Mesh::ATTRIBUTE_JOINT_INDEX,
            bevy::mesh::VertexAttributeValues::Uint16x4(vec![[0; 4]; count]),
        )
        .with_inserted_attribute(
            Mesh::ATTRIBUTE_JOINT_WEIGHT,
            vec![[1.0f32, 0.0, 0.0, 0.0]; count],
        );
    let mesh = crate::headless::add(&mut app, mesh);
    let binds = SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY]);
    let inverse_bindposes = crate::headless::add(&mut app, binds);
    let joint = app.world_mut().spawn(Transform::default()).id();
    let skin = SkinnedMesh {
        inverse_bindposes,
        joints: vec![joint],
    };
    app.world_mut()
        .spawn((Mesh3d(mesh), skin, AutoLod::default()));
    run_until(&mut app, "it is plain", |app| progress(app).plain == 1);
    let events = &app.world().resource::<Events>().0;
    assert!(events.len() == 1 && is_rigged(&events[0]), "{events:?}");
    assert!(logged(Level::INFO, &["skinned or has morph targets"]));
}
