//! The material that paints levels of detail and heat maps.

use bevy::asset::uuid_handle;
use bevy::pbr::Material;
use bevy::prelude::*;
use bevy::render::render_resource::AsBindGroup;
use bevy::shader::ShaderRef;

use super::{FieldLodDebug, FieldLodHeatMap};
use crate::compat::translated_shader;

/// Paints levels of detail, or a quantity of the field, on a surface.
///
/// The upper eight bits of an entity's mesh tag are its level. The lower 24 bits are the upper bits of its error in
/// world units, as a 32-bit float.
#[derive(Asset, AsBindGroup, TypePath, Clone, Copy, Debug, Default)]
pub(crate) struct LodDebugMaterial {
    #[uniform(0)]
    mode: UVec4,
}

impl Material for LodDebugMaterial {
    fn fragment_shader() -> ShaderRef {
        SHADER.into()
    }
}

const SHADER: Handle<Shader> = uuid_handle!("0a5f4f0e-54bb-4ef6-9f0b-7c7f3f1f4f2d");

/// Adds the shader of the material.
pub(super) fn add_shader(app: &mut App) {
    let shader = translated_shader(include_str!("material.wgsl"), "fieldlod_debug");
    // Without a renderer there are no shaders.
    if let Some(mut shaders) = app.world_mut().get_resource_mut::<Assets<Shader>>() {
        shaders.insert(&SHADER, shader).expect("the handle is new");
    }
}

/// One material per quantity.
#[derive(Resource)]
pub(super) struct DebugMaterials([Handle<LodDebugMaterial>; 5]);

impl FromWorld for DebugMaterials {
    fn from_world(world: &mut World) -> Self {
        let mut materials = world.resource_mut::<Assets<LodDebugMaterial>>();
        Self([0, 1, 2, 3, 4].map(|mode| {
            materials.add(LodDebugMaterial {
                mode: UVec4::new(mode, 0, 0, 0),
            })
        }))
    }
}

impl DebugMaterials {
    /// The material that the options select; `None` if nothing is painted.
    pub(super) fn wanted(&self, debug: &FieldLodDebug) -> Option<&Handle<LodDebugMaterial>> {
        let index = match debug.heat_map {
            Some(FieldLodHeatMap::SamplingDensity) => 1,
            Some(FieldLodHeatMap::AspectRatio) => 2,
            Some(FieldLodHeatMap::Curl) => 3,
            Some(FieldLodHeatMap::PixelError) => 4,
            None if debug.color_levels => 0,
            None => return None,
        };
        Some(&self.0[index])
    }
}

/// The mesh tag of an entity at `level`, with the error of its surface in world units.
pub(super) fn mesh_tag(level: u32, error_in_world: f32) -> u32 {
    level.min(255) << 24 | error_in_world.to_bits() >> 8
}

/// The colour of a level. Steps of 5/12 of the colour circle make neighbouring levels distinct.
pub(super) fn level_color(level: u32) -> Color {
    Color::hsl((level * 5 % 12) as f32 * 30.0, 0.75, 0.55)
}
