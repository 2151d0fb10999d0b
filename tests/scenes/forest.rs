//! A forest: trees of two meshes, bark and leaves, which wind moves.

use std::sync::{Arc, OnceLock};

use bevy::asset::{RenderAssetUsages, uuid_handle};
use bevy::pbr::{ExtendedMaterial, MaterialExtension};
use bevy::prelude::*;
use bevy::render::render_resource::{AsBindGroup, Extent3d, TextureDimension, TextureFormat};
use bevy::shader::{Shader, ShaderRef};
use bevy_fieldlod::prelude::*;
use fieldlod_bake::fixtures::{cards, cut_out, tree_in_parts};
use fieldlod_hierarchy::Random;

use super::{Block, Paint, Place, Prop, Scene};

const KINDS: u32 = 12;
/// Metres between trees, and their size; their meshes have radius 1.3.
const SPACING: f32 = 4.5;
const TREE: f32 = 2.5;
const WIND: Handle<Shader> = uuid_handle!("6bb1ad57-2e0f-4d0a-8f33-0a4b6f3d9c11");

/// Bevy's material, with a vertex shader that moves vertices by their height.
pub type WindMaterial = ExtendedMaterial<StandardMaterial, Wind>;

/// Wind from the side.
#[derive(Asset, AsBindGroup, Reflect, Clone, Debug)]
pub struct Wind {
    /// Displacement at a height of one.
    #[uniform(100)]
    strength: f32,
}

impl MaterialExtension for Wind {
    fn vertex_shader() -> ShaderRef {
        WIND.into()
    }

    fn prepass_vertex_shader() -> ShaderRef {
        WIND.into()
    }
}

/// Adds the material and its shader.
pub fn wind_plugin(app: &mut App) {
    app.add_plugins(MaterialPlugin::<WindMaterial>::default())
        .bake_extended_material::<Wind>();
    let source = include_str!("../../crates/bevy_fieldlod/examples/assets/wind.wgsl");
    let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
    let shader = Shader::from_wgsl(source, "wind.wgsl");
    shaders.insert(&WIND, shader).expect("the handle is unused");
}

/// The material of leaves or of bark.
pub fn wind_material(world: &mut World, is_leaves: bool) -> Handle<WindMaterial> {
    let base = if is_leaves {
        let texture = world.resource_mut::<Assets<Image>>().add(leaf_texture());
        StandardMaterial {
            base_color_texture: Some(texture),
            alpha_mode: AlphaMode::Mask(0.5),
            double_sided: true,
            cull_mode: None,
            ..default()
        }
    } else {
        Color::srgb(0.35, 0.26, 0.18).into()
    };
    let extension = Wind { strength: 0.1 };
    let mut materials = world.resource_mut::<Assets<WindMaterial>>();
    materials.add(WindMaterial { base, extension })
}

/// A square forest of `count` trees.
pub(super) fn forest(count: u32) -> Scene {
    let surface = Arc::new(cut_out(is_leaf));
    let kind = |seed: u32| {
        let [bark, _] = tree_in_parts(0, seed);
        let mut leaves = cards(2_000 + 200 * seed, seed);
        leaves.surface = Some(surface.clone());
        Prop::tree([bark, leaves], [0, 1], 1.3 * TREE)
    };
    let side = (count as f32).sqrt().ceil() as u32;
    let mut random = Random::new(1);
    let places = (0..count).map(|index| {
        let cell = Vec2::new((index % side) as f32, (index / side) as f32);
        let shift = Vec2::new(random.unit(), random.unit()) * 0.6;
        let at = (cell + shift - Vec2::splat(side as f32 * 0.5)) * SPACING;
        let scale = TREE * (0.8 + 0.4 * random.unit());
        let turn = Quat::from_rotation_y(random.unit() * 6.0);
        let at = Transform::from_xyz(at.x, scale, at.y).with_rotation(turn);
        let tree = random.index(KINDS as usize);
        Place::new(tree, at.with_scale(Vec3::splat(scale)))
    });
    let (at, places) = (Vec3::ZERO, places.collect());
    Scene {
        name: "forest",
        props: (0..KINDS).map(kind).collect(),
        blocks: vec![Block { at, places }],
        paints: vec![Paint::Bark, Paint::Leaves],
        is_flat: false,
        ends_in_box: false,
        path: |metres| {
            // Above the crowns: between them, the nearest tree hides the forest.
            let eye = Vec3::new(-30.0 + metres, 11.0, 0.0);
            Transform::from_translation(eye).looking_to(Vec3::new(1.0, -0.2, 0.3), Vec3::Y)
        },
        range_scale: 1.0,
        levels: OnceLock::new(),
        cache: OnceLock::new(),
    }
}

fn is_leaf(uv: Vec2) -> bool {
    let at = (uv - 0.5) * Vec2::new(2.2, 4.0);
    at.length_squared() < 1.0
}

/// The texture of the surface that the hand-made levels are simplified with.
fn leaf_texture() -> Image {
    const SIDE: u32 = 64;
    let texels = (0..SIDE * SIDE).flat_map(|texel| {
        let at = Vec2::new((texel % SIDE) as f32, (texel / SIDE) as f32) + 0.5;
        let alpha = if is_leaf(at / SIDE as f32) { 255 } else { 0 };
        [60, 120, 30, alpha]
    });
    let size = Extent3d {
        width: SIDE,
        height: SIDE,
        ..default()
    };
    let format = TextureFormat::Rgba8UnormSrgb;
    let usage = RenderAssetUsages::default();
    Image::new(size, TextureDimension::D2, texels.collect(), format, usage)
}
