//! The material that paints.

use bevy::pbr::Material;
use bevy::prelude::*;
use bevy::render::render_resource::AsBindGroup;
use bevy::shader::ShaderRef;

use crate::{FieldLodDebug, FieldLodHeatMap};

/// Paints levels of detail, or a quantity of the field, on a surface.
///
/// What the whole entity has in common comes by its mesh tag: the level in the upper eight bits, below
/// it the upper bits of the error as a 32-bit float in world units.
#[derive(Asset, AsBindGroup, TypePath, Clone, Copy, Debug, Default)]
pub struct LodSurfaceMaterial {
    #[uniform(0)]
    mode: UVec4,
}

impl Material for LodSurfaceMaterial {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_fieldlod/debug/surface.wgsl".into()
    }
}

/// One material for each way to paint.
#[derive(Resource)]
pub(crate) struct Surfaces([Handle<LodSurfaceMaterial>; 5]);

impl FromWorld for Surfaces {
    fn from_world(world: &mut World) -> Self {
        let mut materials = world.resource_mut::<Assets<LodSurfaceMaterial>>();
        Self([0, 1, 2, 3, 4].map(|mode| {
            materials.add(LodSurfaceMaterial {
                mode: UVec4::new(mode, 0, 0, 0),
            })
        }))
    }
}

impl Surfaces {
    /// The material that is asked for, if any is.
    pub(crate) fn wanted(&self, debug: &FieldLodDebug) -> Option<&Handle<LodSurfaceMaterial>> {
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

/// The mesh tag of an entity at `level`, which may lie `error` from its source in world units.
pub(crate) fn tag(level: u32, error: f32) -> u32 {
    level.min(255) << 24 | error.to_bits() >> 8
}

/// As the shader paints it: steps of 5/12 of the circle keep neighbouring levels far apart.
pub(crate) fn level_color(level: u32) -> Color {
    Color::hsl((level * 5 % 12) as f32 * 30.0, 0.75, 0.55)
}
