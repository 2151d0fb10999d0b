//! The fires of the lamps, which light the ruins at night and cast shadows.

use bevy::light::{NotShadowCaster, PointLightShadowMap};
use bevy::prelude::*;

use super::layout;
use super::sky::TimeOfDay;
use crate::shapes::lamp::{self, FLAME_HEIGHT_IN_M};

const FIRE_IN_LUMEN: f32 = 1_500_000.0;
/// The light comes from the flame's tip, so that the bowl's shadow stays small.
const GLOW_ABOVE_FLAME_IN_M: f32 = 0.42;
const RANGE_IN_M: f32 = 38.0;

/// Adds the fires.
pub(crate) fn plugin(app: &mut App) {
    app.insert_resource(PointLightShadowMap { size: 1024 })
        .add_systems(Startup, spawn_fires);
}

fn spawn_fires(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let flame = meshes.add(lamp::flame().into_mesh().0);
    let glowing = materials.add(StandardMaterial {
        base_color: Color::BLACK,
        emissive: LinearRgba::rgb(9.0, 3.4, 0.7),
        ..default()
    });
    for lamp in layout::lamps() {
        let flame_at = lamp.transform * Transform::from_xyz(0.0, FLAME_HEIGHT_IN_M, 0.0);
        commands.spawn((
            TimeOfDay::Night,
            Mesh3d(flame.clone()),
            MeshMaterial3d(glowing.clone()),
            NotShadowCaster,
            flame_at,
        ));
        commands.spawn((
            TimeOfDay::Night,
            PointLight {
                color: Color::linear_rgb(1.0, 0.56, 0.24),
                intensity: FIRE_IN_LUMEN,
                range: RANGE_IN_M,
                radius: 0.1,
                shadow_maps_enabled: true,
                ..default()
            },
            flame_at * Transform::from_xyz(0.0, GLOW_ABOVE_FLAME_IN_M, 0.0),
        ));
    }
}
