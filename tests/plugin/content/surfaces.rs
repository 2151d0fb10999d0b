//! Bakes at run time read the material of the first entity with a mesh.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bevy::asset::RenderAssetUsages;
use bevy::pbr::{ExtendedMaterial, MaterialExtension};
use bevy::prelude::*;
use bevy::render::render_resource::{AsBindGroup, Extent3d, TextureDimension, TextureFormat};
use bevy_fieldlod::LodOrigin;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{
    BakeConfig, SourceMesh, Surface, SurfaceAlpha, TextureMapping, bake_file, bake_mesh, fixtures,
};
use fieldlod_hierarchy::{BakedFile, BakedPrimitive, Hierarchy};
use fieldlod_tests::apps::bevy_mesh;
use serde_json::json;

use crate::gltf_file::GltfFile;
use crate::headless::{add, app_in, origins, ready, rock};

const SIDE: u32 = 16;

/// A texture of needles that are `width` texels wide.
fn needles(width: u32) -> impl Fn(u32, u32) -> [u8; 4] {
    move |x, _| [40, 90, 20, if x % 8 < width { 255 } else { 0 }]
}

fn image(width: u32, usage: RenderAssetUsages) -> Image {
    let texels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
    let needles = needles(width);
    let bytes = texels.flat_map(|(x, y)| needles(x, y)).collect();
    let size = Extent3d {
        width: SIDE,
        height: SIDE,
        ..default()
    };
    let format = TextureFormat::Rgba8UnormSrgb;
    Image::new(size, TextureDimension::D2, bytes, format, usage)
}

/// Saves the texture of [`tree`] beside it.
pub(crate) fn save(folder: &Path, width: u32) {
    let picture = image(width, RenderAssetUsages::all());
    let picture = picture.try_into_dynamic().unwrap();
    picture.save(folder.join("needles.png")).unwrap();
}

fn material(texture: Handle<Image>) -> StandardMaterial {
    StandardMaterial {
        base_color: Color::linear_rgb(0.5, 1.0, 1.0),
        base_color_texture: Some(texture),
        alpha_mode: AlphaMode::Mask(0.5),
        ..default()
    }
}

/// The cache entry of cards with this surface.
fn entry(surface: Option<Surface>) -> Vec<u8> {
    let mesh = SourceMesh {
        surface: surface.map(Arc::new),
        ..fixtures::cards(300, 3)
    };
    entry_of(bake_mesh(&mesh, &run_time_config()).unwrap())
}

/// The settings of bakes without a camera that needs deviations.
pub(crate) fn run_time_config() -> BakeConfig {
    BakeConfig {
        measure_deviation: false,
        ..BakeConfig::default()
    }
}

pub(crate) fn entry_of(hierarchy: Hierarchy) -> Vec<u8> {
    let primitives = vec![BakedPrimitive::new(0, 0, "", hierarchy)];
    BakedFile { primitives }.to_bytes()
}

/// The cache entry of cards with [`needles`].
fn known(width: u32) -> Vec<u8> {
    let color = Vec4::new(0.5, 1.0, 1.0, 1.0);
    let plain = Surface::new(color, SurfaceAlpha::Mask { cutoff: 0.5 });
    let mapping = TextureMapping::default();
    entry(Some(plain.with_texture(
        UVec2::splat(SIDE),
        mapping,
        needles(width),
    )))
}

/// The origin of the levels of cards with a texture, and all cache entries.
fn baked(
    folder: &Path,
    texture: impl FnOnce(&mut App) -> Handle<Image>,
) -> (LodOrigin, Vec<Vec<u8>>) {
    let mut app = app_in(folder);
    let cache = set_cache(&mut app, folder);
    let texture = texture(&mut app);
    let material = add(&mut app, material(texture));
    spawn_cards(&mut app, MeshMaterial3d(material));
    ready(&mut app, 1);
    (origins(&app)[0], entries(&cache))
}

fn spawn_cards(app: &mut App, material: impl Component) {
    let cards = fixtures::cards(300, 3);
    let uvs: Vec<[f32; 2]> = cards.uvs.iter().map(Vec2::to_array).collect();
    let mesh = bevy_mesh(&cards).with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs);
    let mesh = add(app, mesh);
    let object = (Mesh3d(mesh), material, AutoLod::default());
    app.world_mut().spawn(object);
}

/// An extension of a game, such as wind.
#[derive(Asset, AsBindGroup, TypePath, Clone, Default)]
struct Wind {}

impl MaterialExtension for Wind {}

#[test]
fn bakes_read_the_base_of_extended_materials() {
    for is_read in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let mut app = app_in(folder.path());
        let cache = set_cache(&mut app, folder.path());
        if is_read {
            app.bake_extended_material::<Wind>();
            // The plugin of the material may be missing.
            app.update();
        }
        app.init_asset::<ExtendedMaterial<StandardMaterial, Wind>>();
        let texture = add(&mut app, image(4, RenderAssetUsages::all()));
        let base = material(texture);
        let extension = Wind {};
        let material = add(&mut app, ExtendedMaterial { base, extension });
        spawn_cards(&mut app, MeshMaterial3d(material));
        ready(&mut app, 1);
        let expected = if is_read { known(4) } else { entry(None) };
        assert!(entries(&cache) == [expected], "{is_read}");
    }
}

/// Sets a cache in `folder`, and returns its path.
pub(crate) fn set_cache(app: &mut App, folder: &Path) -> PathBuf {
    let cache = folder.join("cache");
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.cache_folder = Some(cache.clone());
    cache
}

pub(crate) fn entries(cache: &Path) -> Vec<Vec<u8>> {
    let entries = fs::read_dir(cache).unwrap();
    let bytes = entries.map(|entry| fs::read(entry.unwrap().path()).unwrap());
    bytes.collect()
}

/// A glTF mesh of bark and leaves. A texture beside the file cuts out the leaves.
pub(crate) fn tree() -> GltfFile {
    let mut file = GltfFile::of(&fieldlod_tests::rock(3, 1));
    file.add_mesh(&fixtures::cards(1_000, 3));
    file.join_meshes();
    for primitive in 0..2 {
        file.json["meshes"][0]["primitives"][primitive]["material"] = json!(primitive);
    }
    file.json["materials"] = json!([
        { "pbrMetallicRoughness": { "baseColorFactor": [0.25, 0.125, 0.125, 1.0] } },
        { "alphaMode": "MASK", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } },
    ]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file.json["images"] = json!([{ "uri": "needles.png" }]);
    file.json["nodes"] = json!([{ "mesh": 0 }]);
    file.json["scenes"] = json!([{ "nodes": [0] }]);
    file
}

/// The cache entries of all primitives of a file, sorted.
pub(crate) fn baked_entries(glb: &Path) -> Vec<Vec<u8>> {
    let outcome = bake_file(glb, &run_time_config(), &|_| ()).unwrap();
    let primitives = outcome.file.primitives.into_iter();
    let mut entries: Vec<_> = primitives.map(|p| entry_of(p.hierarchy)).collect();
    entries.sort();
    entries
}

#[test]
fn leaves_are_baked_with_their_texture() {
    let folder = tempfile::tempdir().unwrap();
    let wide = |app: &mut App| add(app, image(6, RenderAssetUsages::all()));
    let narrow = |app: &mut App| add(app, image(1, RenderAssetUsages::all()));
    let (origin, entries) = baked(folder.path(), wide);
    assert_eq!((origin, entries.len()), (LodOrigin::Baked, 1));
    assert!(entries[0] == known(6) && entries[0] != entry(None));
    // Another texture is another entry.
    let (origin, entries) = baked(folder.path(), narrow);
    assert_eq!((origin, entries.len()), (LodOrigin::Baked, 2));
    assert!(entries.contains(&known(1)));
    let (origin, entries) = baked(folder.path(), wide);
    assert_eq!((origin, entries.len()), (LodOrigin::Cache, 2));
}

#[test]
fn tinted_copies_of_a_rock_are_baked_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut app = app_in(folder.path());
    let cache = set_cache(&mut app, folder.path());
    // Bakes at the same time would not find the entry.
    let mut config = app.world_mut().resource_mut::<FieldLodAppConfig>();
    config.advanced.bake_threads = Some(1);
    for red in [0.2, 0.5, 0.8] {
        let mesh = Mesh3d(add(&mut app, rock(4, 1)));
        let tinted = StandardMaterial::from_color(Color::srgb(red, 0.5, 0.5));
        let material = MeshMaterial3d(add(&mut app, tinted));
        app.world_mut().spawn((mesh, material, AutoLod::default()));
    }
    ready(&mut app, 3);
    let is_baked = |origin: &&LodOrigin| **origin == LodOrigin::Baked;
    let origins = origins(&app);
    assert_eq!(origins.iter().filter(is_baked).count(), 1, "{origins:?}");
    assert_eq!(entries(&cache).len(), 1);
}

#[test]
fn bake_waits_for_loading_texture() {
    let folder = tempfile::tempdir().unwrap();
    save(folder.path(), 3);
    let load = |app: &mut App| app.world().resource::<AssetServer>().load("needles.png");
    assert!(baked(folder.path(), load).1 == [known(3)]);
}

#[test]
fn unreadable_texture_leaves_surface_unknown() {
    let missing = |app: &mut App| app.world().resource::<AssetServer>().load("none.png");
    let on_gpu = |app: &mut App| add(app, image(3, RenderAssetUsages::RENDER_WORLD));
    let compressed = |app: &mut App| {
        let mut image = image(3, RenderAssetUsages::all());
        image.texture_descriptor.format = TextureFormat::Bc3RgbaUnorm;
        add(app, image)
    };
    let reserved = |app: &mut App| app.world().resource::<Assets<Image>>().reserve_handle();
    let textures: [&dyn Fn(&mut App) -> Handle<Image>; 4] =
        [&missing, &on_gpu, &compressed, &reserved];
    for texture in textures {
        let folder = tempfile::tempdir().unwrap();
        assert!(baked(folder.path(), texture).1 == [entry(None)]);
    }
}

#[test]
fn bark_and_leaves_are_baked_with_both_materials() {
    let mut file = tree();
    let glb = file.glb();
    let unknown = baked_entries(&glb);
    save(file.folder(), 2);
    let known = baked_entries(&glb);
    assert!(known != unknown);
    let mut app = app_in(file.folder());
    let cache = set_cache(&mut app, file.folder());
    let assets = app.world().resource::<AssetServer>();
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("mesh.glb"));
    let scene = (WorldAssetRoot(scene), AutoLod::default());
    app.world_mut().spawn(scene);
    ready(&mut app, 2);
    let mut found = entries(&cache);
    found.sort();
    assert!(found == known);
}
