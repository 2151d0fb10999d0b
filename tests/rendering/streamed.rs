//! Meshes of `.fieldpages` files, read from a folder, on the GPU.

use std::path::Path;

use bevy::light::GlobalAmbientLight;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_asset::RenderAssets;
use bevy::render::{RenderApp, RenderStartup};
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{BakeConfig, bake_mesh};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, PageOptions, PagedFile};
use fieldlod_tests::stage::{Eye, Stage};

use crate::picture::{count_beyond, enclosed};

const BACKGROUND: Color = Color::srgb(1.0, 0.0, 1.0);
const EMPTY: image::Rgba<u8> = image::Rgba([255, 0, 255, 255]);

/// Writes a rock to a `.fieldlod` file and to a `.fieldpages` file of small pages.
fn write_rock(folder: &Path) {
    let rock = bake_mesh(&fieldlod_tests::rock(6, 3), &BakeConfig::fast()).unwrap();
    let file = BakedFile {
        primitives: vec![BakedPrimitive::new(0, 0, "rock", rock)],
    };
    std::fs::write(folder.join("rock.fieldlod"), file.to_bytes()).unwrap();
    let options = PageOptions {
        page_bytes: 16 << 10,
        ..PageOptions::default()
    };
    let pages = PagedFile::to_bytes(&file, options);
    std::fs::write(folder.join("rock.fieldpages"), pages).unwrap();
}

/// A stage that draws a file of `folder`.
fn stage_of(folder: &Path, file: &'static str, memory: LodMemory) -> Option<(Stage, Eye)> {
    let mut stage = Stage::unfinished_in(folder)?;
    stage.config().memory = memory;
    stage.finish();
    let white = stage.add(StandardMaterial {
        unlit: true,
        ..Color::WHITE.into()
    });
    stage.app.insert_resource(GlobalAmbientLight::NONE);
    let file = stage.app.world().resource::<AssetServer>().load(file);
    stage.spawn((LodMesh3d::new(file, 0, 0), MeshMaterial3d(white)));
    let pose = Transform::from_xyz(0.0, 0.0, 2.2).looking_at(Vec3::ZERO, Vec3::Y);
    let eye = stage.add_eye(pose, BACKGROUND, FieldLodCamera::default());
    stage.run_until("the mesh is ready", |stage| stage.progress().ready > 0);
    Some((stage, eye))
}

fn memory(stage: &Stage) -> FieldLodMemory {
    *stage.app.world().resource::<FieldLodMemory>()
}

/// Draws frames until no page is missing, and checks that none has a hole.
fn run_until_sharp(stage: &mut Stage, eye: &Eye) {
    stage.run_until("no page is missing", |stage| {
        let [picture] = stage.shoot([eye]);
        assert_eq!(enclosed(&picture, EMPTY), 0);
        assert!(picture.pixels().any(|pixel| *pixel != EMPTY));
        let now = memory(stage);
        now.missing_pages == 0 && now.wanted_bytes > 0
    });
}

#[test]
fn streamed_picture_equals_whole_picture() {
    let folder = tempfile::tempdir().unwrap();
    write_rock(folder.path());
    let roomy = LodMemory::default();
    let Some((mut whole, its_eye)) = stage_of(folder.path(), "rock.fieldlod", roomy) else {
        return;
    };
    whole.run_until_ready();
    let [expected] = whole.shoot([&its_eye]);
    let (mut parts, eye) = stage_of(folder.path(), "rock.fieldpages", roomy).unwrap();
    run_until_sharp(&mut parts, &eye);
    assert!(memory(&parts).loaded_pages > 3, "{:?}", memory(&parts));
    let [picture] = parts.shoot([&eye]);
    assert_eq!(count_beyond(&picture, &expected, 2), 0);
    let drawn = |stage: &Stage, eye: &Eye| stage.stats(eye).triangles_drawn;
    assert_eq!(drawn(&parts, &eye), drawn(&whole, &its_eye));
    // On a new device, all pages are loaded again.
    let before = memory(&parts).loaded_pages;
    let render_app = parts.app.sub_app_mut(RenderApp);
    render_app.world_mut().run_schedule(RenderStartup);
    parts.app.update();
    parts.app.update();
    parts.run_until_ready();
    run_until_sharp(&mut parts, &eye);
    assert!(memory(&parts).loaded_pages > before);
    let [picture] = parts.shoot([&eye]);
    assert_eq!(count_beyond(&picture, &expected, 2), 0);
}

#[test]
fn small_budget_pictures_have_no_holes() {
    let folder = tempfile::tempdir().unwrap();
    write_rock(folder.path());
    let little = LodMemory {
        gpu_bytes: 700 << 10,
        main_bytes: 64 << 10,
        ..default()
    };
    let Some((mut stage, eye)) = stage_of(folder.path(), "rock.fieldpages", little) else {
        return;
    };
    // The camera moves around the rock: each side needs other pages.
    let mut frames = Vec::new();
    for index in 0..60u8 {
        let angle = f32::from(index / 6) * 1.2;
        let place = Vec3::new(angle.sin(), 0.2, angle.cos()) * 1.8;
        let pose = Transform::from_translation(place).looking_at(Vec3::ZERO, Vec3::Y);
        stage.insert(eye.entity, pose);
        frames.push(stage.draw(&eye));
        let now = memory(&stage);
        let held = now.resident_bytes + now.coming_bytes;
        assert!(held <= little.gpu_bytes, "{now:?}");
    }
    for frame in frames {
        assert_eq!(enclosed(&stage.wait(&frame), EMPTY), 0);
    }
    let now = memory(&stage);
    assert!(now.evicted_pages > 3 && now.coarsening > 1.0, "{now:?}");
    // All meshes are on the GPU, except the one of the entity, which is drawn as units.
    (0..3).for_each(|_| stage.app.update());
    let world = stage.app.world();
    let meshes = world.resource::<Assets<Mesh>>().len();
    let render_world = stage.app.sub_app(RenderApp).world();
    let on_gpu = render_world.resource::<RenderAssets<RenderMesh>>();
    assert_eq!(on_gpu.iter().count() + 1, meshes);
    let bytes = |(_, mesh): (_, &RenderMesh)| {
        u64::from(mesh.vertex_count) * mesh.layout.0.layout().array_stride
    };
    let bytes: u64 = on_gpu.iter().map(bytes).sum();
    assert!(bytes < little.gpu_bytes, "{bytes}");
}
