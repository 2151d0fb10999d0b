//! Paints each level of detail in its own colour.

use bevy::prelude::*;

use crate::LodDebug;
use crate::objects::{LodObject, LodUnit};

/// One material per level, finest first; coarser levels than there are colours repeat them.
#[derive(Resource)]
pub(crate) struct LevelMaterials(Vec<Handle<StandardMaterial>>);

impl FromWorld for LevelMaterials {
    fn from_world(world: &mut World) -> Self {
        const LEVELS: u16 = 12;
        let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
        let material = |level: u16| StandardMaterial {
            // Steps of 5/12 of the circle keep neighbouring levels far apart.
            base_color: Color::hsl(f32::from(level * 5 % LEVELS) * 30.0, 0.75, 0.55),
            perceptual_roughness: 0.9,
            ..default()
        };
        Self(
            (0..LEVELS)
                .map(|level| materials.add(material(level)))
                .collect(),
        )
    }
}

/// Exchanges the materials of the units when [`LodDebug::color_levels`] changes, and those of new
/// units while it is on.
pub(crate) fn color_levels(
    debug: Res<LodDebug>,
    colors: Res<LevelMaterials>,
    mut was_on: Local<bool>,
    objects: Query<&MeshMaterial3d<StandardMaterial>, (With<LodObject>, Without<LodUnit>)>,
    mut units: Query<(Ref<LodUnit>, &mut MeshMaterial3d<StandardMaterial>)>,
) {
    let toggled = *was_on != debug.color_levels;
    *was_on = debug.color_levels;
    if !toggled && !debug.color_levels {
        return;
    }
    for (unit, mut material) in &mut units {
        if debug.color_levels && (toggled || unit.is_added()) {
            material.0 = colors.0[unit.level as usize % colors.0.len()].clone();
        } else if toggled && let Ok(own) = objects.get(unit.object) {
            material.0 = own.0.clone();
        }
    }
}
